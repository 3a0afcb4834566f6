"""Changes of a sensor's body that a calibration tries: lights, edges, gel and coating.

Each takes a design and a number, and returns a changed design; the given one stays as it is.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from optisense import library
from optisense.design import Cage, Light, SensorDesign
from optisense.design.emitters import AreaEmitter, LightModel, SpotEmitter
from optisense.design.parts import FaceFinish, Role
from optisense.geometry import TriangleMesh

FloatArray = NDArray[np.float64]

FLAT = 0.2
"""mm that the skin of a flat gel may leave its plane; GelSight Mini's real one sags as much."""

EDGE_ANGLE = 30.0
"""Degrees that faces of an edge may lean from one of the four sides of the picture."""

WIDEST_ANGLE = 89.0
"""Degrees from its axis to which a spot is widened at most."""


def with_lights_moved(design: SensorDesign, group: str, along: float) -> SensorDesign:
    """The lights of a group, so many mm along the camera's axis."""
    offset = along * design.camera.axes()[2]

    def moved(light: Light) -> Light:
        place = np.array(light.position) + offset
        return light.model_copy(update={"position": tuple(place.tolist())})

    return _with_lights(design, group, moved)


def with_lights_tilted(design: SensorDesign, group: str, angle: float) -> SensorDesign:
    """The lights of a group, turned by so many degrees towards where the camera looks.

    Lights along the camera's axis stay as they are.
    """
    ahead = design.camera.axes()[2]

    def turned(light: Light) -> Light:
        direction = np.array(light.direction) / np.linalg.norm(light.direction)
        axis = np.cross(direction, ahead)
        if np.linalg.norm(axis) < 1e-6:
            return light
        axis /= np.linalg.norm(axis)
        update = {"direction": tuple(_turned(direction, axis, angle).tolist())}
        if light.up is not None:
            update["up"] = tuple(_turned(np.array(light.up), axis, angle).tolist())
        return light.model_copy(update=update)

    return _with_lights(design, group, turned)


def _with_lights(design: SensorDesign, group: str, change) -> SensorDesign:  # type: ignore[no-untyped-def]
    found = design.copy()
    own = found.lights[group]
    found.lights[group] = own.model_copy(update={"lights": [change(each) for each in own.lights]})
    return found


def _turned(vector: FloatArray, axis: FloatArray, angle: float) -> FloatArray:
    """A vector turned about a unit axis (Rodrigues)."""
    cosine, sine = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    along = axis * float(axis @ vector) * (1.0 - cosine)
    return np.asarray(vector * cosine + np.cross(axis, vector) * sine + along)


def widens(design: SensorDesign) -> list[str]:
    """The groups whose emission can be made wider: flat windows and spots."""
    return [
        name
        for name, group in design.lights.items()
        if isinstance(library.emitter(group), AreaEmitter | SpotEmitter)
    ]


def with_emission_width(design: SensorDesign, factor: float) -> SensorDesign:
    """Windows of lights so many times as large, and spots so many times as wide."""
    found = design.copy()
    for name in widens(design):
        group = found.lights[name]
        found.lights[name] = group.model_copy(
            update={"emitter": _widened(library.emitter(group), factor)}
        )
    return found


def _widened(emitter: LightModel, factor: float) -> LightModel:
    if isinstance(emitter, AreaEmitter):
        width, height = emitter.size
        return emitter.model_copy(update={"size": (factor * width, factor * height)})
    assert isinstance(emitter, SpotEmitter)
    most = min(factor, WIDEST_ANGLE / emitter.cutoff)
    return emitter.model_copy(update={"cutoff": most * emitter.cutoff, "beam": most * emitter.beam})


def edge_parts(design: SensorDesign) -> list[str]:
    """The rigid transparent parts whose edges may be rough: those with no finished faces."""
    return [name for name in design.parts_of(Role.SUPPORT) if not design.parts[name].faces]


def with_edge_roughness(design: SensorDesign, parts: list[str], roughness: float) -> SensorDesign:
    """Parts whose faces towards the four sides of the picture have a roughness."""
    found = design.copy()
    right, up, _ = design.camera.axes()
    sides = {"right": right, "left": -right, "top": up, "bottom": -up}
    meshes = found.deformed_meshes()
    for name in parts:
        normals = meshes[name].face_normals
        faces = {
            f"edge-{side}": FaceFinish(
                direction=tuple(way.tolist()), within=EDGE_ANGLE, roughness=roughness
            )
            for side, way in sides.items()
            if (normals @ way > math.cos(math.radians(EDGE_ANGLE))).any()
        }
        found.parts[name] = found.parts[name].model_copy(update={"faces": faces or None})
    return found


def flat_gel_thickness(design: SensorDesign) -> float | None:
    """mm of the gel of a sensor with one flat gel; None of others."""
    skins, gels = design.parts_of(Role.SENSING_SURFACE), design.parts_of(Role.ELASTOMER)
    if len(skins) != 1 or len(gels) != 1:
        return None
    skin, gel = design.meshes[skins[0]], design.meshes[gels[0]]
    blended = any(cage.blend is not None for cage in design.cages.values())
    if blended or np.ptp(skin.vertices @ _outward(skin)) > FLAT or _is_bent(design):
        return None
    return float(np.ptp(gel.vertices @ _outward(skin)))


def _is_bent(design: SensorDesign) -> bool:
    shaped = design.deformed_meshes()
    return any(
        not np.allclose(shaped[name].vertices, mesh.vertices, atol=1e-6)
        for name, mesh in design.meshes.items()
    )


def _outward(skin: TriangleMesh) -> FloatArray:
    """The direction out of the sensor of a flat skin, whose faces look into it."""
    mean = -(skin.face_normals * skin.face_areas[:, None]).sum(axis=0)
    return np.asarray(mean / np.linalg.norm(mean))


def with_gel_thickness(design: SensorDesign, thickness: float) -> SensorDesign:
    """A flat gel of another thickness, mm; its base stays where it is."""
    skin = design.parts_of(Role.SENSING_SURFACE)[0]
    gel = design.parts_of(Role.ELASTOMER)[0]
    out = _outward(design.meshes[skin])
    heights = design.meshes[gel].vertices @ out
    low, high = float(heights.min()), float(heights.max())
    factor = thickness / (high - low)
    found = design.copy()
    for name in (skin, gel):
        mesh = design.meshes[name]
        above = mesh.vertices @ out - low
        moved = mesh.vertices + ((factor - 1.0) * above)[:, None] * out
        found.meshes[name] = TriangleMesh(moved, mesh.faces)
    for name, cage in design.cages.items():
        if {skin, gel} & set(cage.parts):  # it is at rest, and shall enclose the gel as before
            around = np.concatenate([found.meshes[part].bounds for part in cage.parts])
            box = np.stack([around.min(axis=0), around.max(axis=0)])
            found.cages[name] = Cage.around(cage.parts, box, cage.resolution)
    return found


def with_reflectance(design: SensorDesign, factor: float) -> SensorDesign:
    """A coating that is so many times as bright in all colours."""
    found = design.copy()
    values = tuple(min(factor * value, 1.0) for value in design.coating.reflectance)  # type: ignore[attr-defined]
    found.coating = design.coating.model_copy(update={"reflectance": values})
    return found
