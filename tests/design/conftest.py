"""A small design that uses every field of the format, its folder, and an ideal GelSight Mini."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from optisense import sensors
from optisense.design import Camera, SensorDesign, save_design
from optisense.design.ies import parse_ies
from optisense.geometry import TriangleMesh

LAMP = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 2 3 1 1 2 0 0 0\n1 1 5\n0 45 90\n0\n10 5 0\n"


def corner(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def lattice(lower: list[float], upper: list[float], lift: float = 0.0) -> list[dict[str, float]]:
    """2 x 2 x 2 control points, the top ones lifted."""
    return [
        corner(x, y, z + (lift if z == upper[2] else 0.0))
        for x in (lower[0], upper[0])
        for y in (lower[1], upper[1])
        for z in (lower[2], upper[2])
    ]


TABLE = [[1.5, 1.2, 1.25, 1.6], [1.3, 1.1, 1.05, 1.4]] * 3

OTHER_KINDS = {
    "distortion": {
        "kind": "brown-conrady",
        "k1": 0.1,
        "k2": 0.02,
        "p1": 0.01,
        "p2": -0.01,
        "k3": 1,
    },
    "shading": {
        "kind": "radial",
        "corrected": 0.3,
        "falloff": 0.4,
        "red_falloff": 0.5,
        "blue_falloff": 0.3,
        "power": 3,
    },
    "blur": {"kind": "gaussian", "width": 0.8},
    "tone_curve": {"kind": "gamma", "gamma": 1.9},
}  # fmt: skip
"""Kinds of the camera's components that `full_data` does not use."""


def full_data() -> dict[str, object]:
    """Every field of the format, none left at its default where it can be helped."""
    low, high = [-5.0, -4.0, -2.0], [5.0, 4.0, 0.0]
    light = {"position": [6, 0.1, -4], "direction": [-1, 0, 0.25], "up": [0, 0, 1]}
    return {
        "schema_version": 1,
        "name": "every field: a \"test\" # 1",
        "description": "two\nlines, 'quotes', \u00fcml\u00e4uts, \u2028 and a tab\t",
        "coating": {
            "library": "diffuse-grey",
            "reflectance": [0.1, 0.2, 1 / 3],
            "eta": [1.43, 0.92, 0.69],
            "k": [7.5, 6.4, 5.6],
            "specularity": 0.25,
            "scattering": "conductor",
            "roughness": 0.3,
        },
        "materials": {
            "gel": {
                "kind": "dielectric", "ior": 1.41, "dispersion": [1.40, 1.41, 1.43],
                "roughness": 0.125,
            },
            "dyed": {
                "kind": "dielectric", "ior": 1.41, "absorption": [0.01, 0.02, 0.03],
                "elasticity": {"youngs_modulus": 0.3, "poisson_ratio": 0.48, "friction": 0.5},
            },
            "sellmeier": {
                "kind": "dielectric", "ior": 1.43, "sellmeier_b": [1.0093, 0, 0],
                "sellmeier_c": [0.013185, 0, 0], "extinction": [1e-6, 2e-6, 3e-6],
            },
            "cauchy": {
                "kind": "dielectric", "ior": 1.5, "cauchy": [1.49, 0.004, 0],
                "transmittance": [0.9, 0.8, 0.7], "thickness": 3,
            },
            "silver": {"kind": "conductor", "eta": [0.1] * 3, "k": [3] * 3, "roughness": 0.01},
            "white": {"kind": "diffuse", "reflectance": [0.8, 0.7, 0.6]},
            "black": {"kind": "absorber"},
        },
        "parts": {
            "skin": {"role": "sensing_surface", "mesh": "meshes/skin.obj"},
            "gel": {
                "role": "elastomer", "mesh": "meshes/gel.obj", "material": "gel", "priority": 2,
                "faces": {
                    "side": {
                        "direction": [1, 0, 0], "within": 12.5, "roughness": 0.25,
                        "box": [[5, -4, -2], [5, 4, 0]],
                    },
                    "end": {"direction": [0, 1, 0], "paint": "white"},
                },
            },
            "wall": {"role": "blocker", "mesh": "meshes/deep/wall.obj", "material": "black"},
            "mirror": {
                "role": "mirror", "mesh": "meshes/mirror.obj", "material": "silver",
                "thickness": 0.75,
            },
        },
        "lights": {
            "red": {"model": "smd-3528", "colour": [1, 0, 0.5], "flux": 12.5, "lights": [light]},
            "own-area": {
                "model": "mine", "colour": [0, 1, 0], "flux": 1e-3, "lights": [light],
                "spectrum": {
                    "red": {"wavelength": 622, "half_width": 18}, "green": {"wavelength": 530},
                    "blue": {"wavelength": 470, "half_width": 25},
                },
                "emitter": {
                    "kind": "area", "shape": "rectangle", "size": [2, 1], "lambertian": True
                },
            },
            "own-ies": {
                "model": "mine-2", "colour": [0, 1, 1], "flux": 3, "lights": [light, light],
                "emitter": {"kind": "ies", "file": "lamps/lamp.ies"},
            },
            "own-spot": {
                "model": "mine-3", "colour": [0, 0, 1], "flux": 3, "lights": [light],
                "emitter": {"kind": "spot", "cutoff": 40, "beam": 20},
            },
        },
        "camera": {
            "model": "pi-v2", "projection": "equidistant", "fov": 150, "resolution": [64, 48],
            "position": [0.5, 0, -20], "direction": [0, 0, 1], "up": [0, 1, 0],
            "response": {"kind": "full-well", "full_well": 0.9, "blur": 0.01},
            "distortion": {
                "kind": "kannala-brandt", "centre": [0.49, 0.51],
                "k1": -0.02, "k2": 0.003, "k3": -1e-4, "k4": 1e-5,
            },
            "shading": {
                "kind": "table", "corrected": 0.7, "gain": TABLE, "red": TABLE, "blue": TABLE,
                "colour_corrected": 0.9,
            },
            "blur": {
                "kind": "defocus", "focal_length": 1.6, "f_number": 2.2, "focus_distance": 25,
            },
            "crosstalk": [[0.8, 0.1, 0.1], [0.2, 0.7, 0.1], [0, 0.2, 0.8]],
            "stray_light": [0.01, 0.02, 0.005],
            "noise": {"full_well": 4865.7, "read_noise": 2, "gain": 1.5, "binning": 4},
            "black_level": {"level": 0.0625, "subtracted": 0.9},
            "white_balance": [1.6, 1, 1.5],
            "colour_matrix": [[1.5, -0.3, -0.2], [-0.2, 1.4, -0.2], [0, -0.5, 1.5]],
            "tone_curve": {"kind": "points", "points": [[0, 0], [0.25, 0.6], [1, 1]]},
        },
        "cages": {
            "skin": {
                "parts": ["skin", "gel"], "resolution": [2, 2, 2], "box": [low, high],
                "points": lattice(low, high, 0.5),
            },
            "mirror": {
                "parts": ["mirror"], "resolution": [2, 2, 2],
                "box": [[8, -4, -9], [9, 4, -1]],
                "c_min": lattice([8, -4, -9], [9, 4, -1]),
                "c_max": lattice([8, -4, -9], [9, 4, -1], 1.0),
                "blend": [corner(0.5, 0.25, 0.75)] * 8,
            },
        },
        "dispersion": True,
        "markers": {
            "radius": 0.3, "reflectance": [0.05, 0.04, 0.03], "grid": [4, 3], "pitch": 1.5,
        },
        "provenance": {"parts.gel": {"status": "assumed", "source": "for the test"}},
    }  # fmt: skip


@pytest.fixture
def other_cameras() -> list[Camera]:
    """The camera of `full_data` with others of what comes in kinds."""
    camera = full_data()["camera"]
    assert isinstance(camera, dict)
    given = camera | {"projection": "perspective", "fov": 50} | OTHER_KINDS
    last = {"tone_curve": {"kind": "srgb"}}
    return [Camera.model_validate(given), Camera.model_validate(given | last)]


@pytest.fixture
def data() -> dict[str, object]:
    return full_data()


@pytest.fixture
def design(data: dict[str, object], tmp_path_factory: pytest.TempPathFactory) -> SensorDesign:
    made = SensorDesign.model_validate(data)
    gel = TriangleMesh.box((-5, -4, -2), (5, 4, 0), (4, 4, 2))
    made.meshes.update(
        skin=TriangleMesh.grid((10, 8), (4, 4)).flipped(),
        gel=gel,
        wall=TriangleMesh.box((-20, -20, -30), (-15, 20, 0)),
        mirror=TriangleMesh(np.array([[8.5, -3, -8], [8.5, 3, -8], [8.2, 0, -2]]), [[0, 1, 2]]),
    )
    lamps = tmp_path_factory.mktemp("source") / "lamps"
    lamps.mkdir()
    (lamps / "lamp.ies").write_text(LAMP)
    assert parse_ies(LAMP, "lamp").candela[0, 0] == 20.0
    made.lights["own-ies"].emitter._folder = lamps.parent
    return made


@pytest.fixture
def folder(design: SensorDesign, tmp_path: Path) -> Path:
    save_design(design, tmp_path / "sensor")
    return tmp_path / "sensor"


@pytest.fixture(scope="session")
def mini() -> SensorDesign:
    return sensors.gelsight_mini_ideal()
