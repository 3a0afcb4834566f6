"""Changes of a sensor's body that a calibration tries: lights, edges, gel and coating.

Each function takes a design and, last, a number, and returns a changed design; the given one is not
changed.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from optisense import library
from optisense.array_types import FloatArray
from optisense.design import Cage, Light, SensorDesign
from optisense.design.emitters import AreaEmitter, LightModel, SpotEmitter
from optisense.design.parts import FaceFinish, Role
from optisense.design.posing import moved, triple, with_lights
from optisense.errors import CalibrationError
from optisense.geometry import TriangleMesh
from optisense.geometry.patches import mean_normal
from optisense.geometry.rotations import rotation

FLAT = 0.2
"""Largest deviation of a flat gel's skin from its plane, mm, as a real GelSight Mini sags."""

STRAIGHT = 1e-3
"""Largest distance of a light from the line of its row, as a share of the row's length: far above
rounding errors, and far below any bend that is meant.
"""

EDGE_ANGLE = 30.0
"""Largest angle between the normals of an edge's faces and the direction of one of the four sides
of the picture, degrees: more than edges are slanted, and less than half of the angle between
sides."""

EDGE = "edge-"
"""Beginning of the names of faces that are edges."""

WIDEST_ANGLE = 89.0
"""Largest angle from its axis to which a spot is widened, degrees: 90 would be a half-space."""


def with_lights_moved(group: str, design: SensorDesign, along: float) -> SensorDesign:
    """Return a design with the lights of a group moved by `along` mm along the camera's axis."""
    return with_lights(design, group, partial(moved, shift=along * design.camera.axes()[2]))


def with_lights_tilted(group: str, design: SensorDesign, angle: float) -> SensorDesign:
    """Return a design with the lights of a group turned by `angle` degrees towards the viewing
    direction.

    Lights along the camera's axis are not changed.
    """
    ahead = design.camera.axes()[2]

    def tilted(light: Light) -> Light:
        direction = np.array(light.direction) / np.linalg.norm(light.direction)
        axis = np.cross(direction, ahead)
        if np.linalg.norm(axis) < 1e-6:
            return light
        turn = rotation(axis, angle)
        up = None if light.up is None else triple(turn @ np.array(light.up))
        return light.model_copy(update={"direction": triple(turn @ direction), "up": up})

    return with_lights(design, group, tilted)


def row_length(design: SensorDesign, group: str) -> float | None:
    """Return the distance of the outer lights of a group in a straight row, mm; None for others."""
    places = np.array([light.position for light in design.lights[group].lights])
    if len(places) < 2:
        return None
    off = places - places.mean(axis=0)
    direction = np.linalg.svd(off, full_matrices=False)[2][0]
    along = off @ direction
    length = float(np.ptp(along))
    if length <= 0.0 or np.abs(off - along[:, None] * direction).max() > STRAIGHT * length:
        return None
    return length


def with_row_length(group: str, design: SensorDesign, length: float) -> SensorDesign:
    """Return a design whose lights of a straight row lie closer or farther apart, so that the outer
    ones have a distance of `length` mm; the middle of the row stays in place.
    """
    middle = np.mean([light.position for light in design.lights[group].lights], axis=0)
    before = row_length(design, group)
    assert before is not None  # only rows have this number

    def spread(light: Light) -> Light:
        place = middle + length / before * (np.array(light.position) - middle)
        return light.model_copy(update={"position": triple(place)})

    return with_lights(design, group, spread)


def with_single_lights(design: SensorDesign) -> SensorDesign:
    """Return a design in which each light has a group of its own, so that its power can be fitted:
    `red-1`, `red-2` and so on for the lights of the group `red`.

    Sources of a group become those of each of its lights.
    """
    found = design.copy()
    found.lights, found.provenance = {}, {}
    singles: dict[str, list[str]] = {}
    for name, group in design.lights.items():
        count = len(group.lights)
        singles[name] = [f"{name}-{number}" for number in range(1, count + 1)]
        if count == 1:
            singles[name] = [name]
        for single, light in zip(singles[name], group.lights, strict=True):
            if single in found.lights or (single != name and single in design.lights):
                raise CalibrationError(
                    f"there is already a light group '{single}'", hint="Give it another name"
                )
            found.lights[single] = group.model_copy(update={"lights": [light]})
    for path, source in design.provenance.items():
        first, _, rest = path.partition(".")
        name, dot, field = rest.partition(".")
        of = singles.get(name, [name]) if first == "lights" else []
        for single in of:
            found.provenance[f"lights.{single}{dot}{field}"] = source
        if not of:
            found.provenance[path] = source
    return found


def widens(design: SensorDesign) -> list[str]:
    """Return the groups whose emission can be widened: flat windows and spots."""
    return [
        name
        for name, group in design.lights.items()
        if isinstance(library.emitter(group), AreaEmitter | SpotEmitter)
    ]


def with_emission_width(design: SensorDesign, factor: float) -> SensorDesign:
    """Return a design with the windows of lights larger, and spots wider, by a factor."""
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
    """Return the rigid transparent parts whose edges may be rough, without other finished faces."""
    return [
        name
        for name in design.parts_of(Role.SUPPORT)
        if all(face.startswith(EDGE) for face in design.parts[name].faces or {})
    ]


def edge_roughness(design: SensorDesign, parts: list[str]) -> float | None:
    """Return the roughness of the edges of parts; None if they have none yet."""
    known = [face.roughness for name in parts for face in (design.parts[name].faces or {}).values()]
    return known[0] if known else None


def with_edge_roughness(parts: list[str], design: SensorDesign, roughness: float) -> SensorDesign:
    """Return a design with a roughness on the faces of parts towards the picture's four sides."""
    found = design.copy()
    right, up, _ = design.camera.axes()
    sides = {"right": right, "left": -right, "top": up, "bottom": -up}
    meshes = found.deformed_meshes()
    for name in parts:
        normals = meshes[name].face_normals
        faces = {
            f"{EDGE}{side}": FaceFinish(
                direction=tuple(way.tolist()), within=EDGE_ANGLE, roughness=roughness
            )
            for side, way in sides.items()
            if (normals @ way > math.cos(math.radians(EDGE_ANGLE))).any()
        }
        found.parts[name] = found.parts[name].model_copy(update={"faces": faces or None})
    return found


def flat_gel_thickness(design: SensorDesign) -> float | None:
    """Return the thickness of the gel of a sensor with one flat gel, mm; None for others."""
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
    """Return the outward direction of a flat skin, whose normals point into the sensor."""
    mean = mean_normal(skin)
    return np.asarray(-mean / np.linalg.norm(mean))


def with_gel_thickness(design: SensorDesign, thickness: float) -> SensorDesign:
    """Return a design with a flat gel of another thickness, mm; its base stays in place."""
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
    """Return a design with a coating that is brighter by a factor in all colours."""
    found = design.copy()
    values = tuple(min(factor * value, 1.0) for value in design.coating.reflectance)  # type: ignore[attr-defined]
    found.coating = design.coating.model_copy(update={"reflectance": values})
    return found
