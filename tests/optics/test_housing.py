"""Housings: a blocker reflects what its material says, and absorbs all light without one."""

from __future__ import annotations

import numpy as np
import pytest
from reference_scenes import Landings

from optisense.design import SensorDesign
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh import grid_faces
from optisense.optics import OpticalModel
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.emission_guide import uniform_guide
from optisense.optics.transport.photons import Emission, trace_photons

RADIUS = 10.0
PORT = 40.0
"""Largest polar angle (degrees) of the sensing surface on the sphere."""

PHOTONS = 200_000
FEW_PHOTONS = 20_000
"""Number of photons that land a hundred times each."""
LANDED = 0.01
"""Relative error of sums over tens of thousands of landings; the sphere is a polyhedron."""


def zone(first: float, last: float) -> TriangleMesh:
    """The part of a sphere between two polar angles (degrees), facing inward."""
    rows = max(4, round((last - first) / 4))
    polar = np.radians(np.linspace(first, last, rows + 1))
    turn = np.linspace(0.0, 2 * np.pi, 91)
    p, t = np.meshgrid(polar, turn, indexing="ij")
    points = RADIUS * np.stack([np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)], axis=-1)
    mesh = TriangleMesh(points.reshape(-1, 3), grid_faces(rows + 1, len(turn))).welded()
    inward = (mesh.face_vectors * mesh.triangles.mean(axis=1)).sum() < 0
    return mesh if inward else mesh.flipped()


def sphere(reflectance: float | None, coating: float = 0.0) -> SensorDesign:
    """A sphere whose top is the sensing surface; a narrow lamp in its middle shines down."""
    housing = {"role": "blocker", "mesh": "meshes/housing.obj"}
    if reflectance is not None:
        housing["material"] = "paint"
    design = SensorDesign.model_validate(
        {
            "schema_version": 1,
            "name": "integrating sphere",
            "coating": {
                "reflectance": [coating] * 3, "eta": [1.0] * 3, "k": [0.0] * 3, "specularity": 0.0,
            },
            "materials": {"paint": {"kind": "diffuse", "reflectance": [reflectance or 0.0] * 3}},
            "parts": {
                "skin": {"role": "sensing_surface", "mesh": "meshes/skin.obj"},
                "housing": housing,
            },
            "lights": {
                "white": {
                    "model": "own", "colour": [1, 1, 1], "flux": 3.0,
                    "emitter": {"kind": "spot", "beam": 5.0, "cutoff": 10.0},
                    "lights": [{"position": [0, 0, 0], "direction": [0, 0, -1]}],
                }
            },
            "camera": {
                "model": "own", "projection": "perspective", "fov": 60, "resolution": [64, 48],
                "position": [0, 0, -2], "direction": [0, 0, 1], "up": [0, 1, 0],
            },
        }
    )  # fmt: skip
    design.meshes.update(skin=zone(0.0, PORT), housing=zone(PORT, 180.0))
    return design


def landed(model: OpticalModel, photons: int = PHOTONS) -> float:
    """The share of the lamp's light that lands on the sensing surface."""
    emission = Emission(model.scenes.emitter_table, uniform_guide(1), photons, 1)
    found = Landings(trace_photons(model.scene, emission, coloured=False))
    skin = [k for k, p in enumerate(model.scenes.pieces) if p.surface.region is Region.SENSING]
    return float(found.power[np.isin(found.surface, skin)].sum())


SHARE = (1 - np.cos(np.radians(PORT))) / 2
"""Share of the sphere's area that is the sensing surface."""


def test_a_grey_sphere_sends_its_light_out_of_the_port() -> None:
    """Every point of a sphere lights all others alike: r f / (1 - r (1 - f)). The ledger has the
    same formula for a white sphere.
    """
    reflectance = 0.2
    expected = reflectance * SHARE / (1 - reflectance * (1 - SHARE))
    assert landed(OpticalModel(sphere(reflectance))) == pytest.approx(expected, rel=LANDED)


def test_light_is_followed_to_its_end_between_white_walls() -> None:
    """In a closed sphere of reflectance r, every photon lands 1 / (1 - r) times in the mean. After
    64 surfaces, half of the light would be missing; 2 % escape between the facets."""
    white = 0.99
    expected = white * SHARE / (1 - white)
    found = landed(OpticalModel(sphere(white, white)), FEW_PHOTONS)
    assert found == pytest.approx(expected, rel=5 * LANDED)


def test_a_housing_without_a_material_absorbs_all_light() -> None:
    assert landed(OpticalModel(sphere(None))) == 0.0


def test_the_skin_in_a_white_sphere_is_evenly_bright() -> None:
    """Irradiance F r / (A (1 - r (1 - f) - c f)) for a coating of reflectance c."""
    wall, coating = 0.8, 0.5
    model = OpticalModel(sphere(wall, coating))
    image = model.render(resolution=(64, 48), photons=300_000)
    area = 4 * np.pi * RADIUS**2
    irradiance = 1.0 * wall / (area * (1 - wall * (1 - SHARE) - coating * SHARE))
    expected = coating / np.pi * irradiance
    middle = image.radiance[12:36, 16:48]
    assert middle.mean() == pytest.approx(expected, rel=0.02)
    assert middle.mean(axis=2).std() < 0.1 * expected
