"""Checks of lights whose sizes the library knows: windows in parts, bodies and windows in one
another, and lights outside of the housing.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from optisense import library
from optisense.array_types import BoolArray, FloatArray
from optisense.design import Diagnostic, LightGroup, LightModel, Role, SensorDesign
from optisense.design.arrangement import one_medium
from optisense.design.check import OPAQUE_ROLES
from optisense.design.lights import frame_of
from optisense.design.limits import is_gas
from optisense.errors import OptiSenseError
from optisense.geometry import TriangleMesh
from optisense.geometry.containment import inside
from optisense.geometry.mesh_points import closest_points, distance_within
from optisense.geometry.rays import ray_hits

FLUSH = 0.1
"""Largest depth in a part of the window of a light that lies against its face, mm. A flat window
2 mm wide on a curved face of 10 mm radius reaches 0.05 mm deep."""

SAMPLES = np.array(
    [(0, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0)], dtype=float
)
"""Points (9, 2) of a window in half widths and half heights: the middle, then corners and middles
of the edges."""

RAYS = (1, 16, 500)
"""Numbers of straight rays that are traced from a light, one after another until a ray reaches the
sensor: along its axis, into a coarse and into a fine half sphere. Of the last, one falls into
7 degrees x 7 degrees."""

DARK_WALL = 0.1
"""Largest reflectance of a wall from which no light counts; the black plastics of the library
reflect 5 %, and a white housing lights a sensor by its reflections."""

TOGETHER = 1e-6
"""Distance, mm, within which a ray meets two parts at once, such as a gel and its skin; it covers
rounding of numbers in files."""


class WindowIn(NamedTuple):
    """Light whose window lies in a part, or partly.

    Attributes:
        group: its light group.
        number: its number in the group.
        part: the part.
        points: the samples (k, 3) of the window that lie in the part, mm.
        middle: whether the middle of the window is one of them.
        whole: whether all samples are.
    """

    group: str
    number: int
    part: str
    points: FloatArray
    middle: bool
    whole: bool

    def depth(self, mesh: TriangleMesh) -> float:
        """Return the largest depth of the samples below the surface of the part's mesh, mm."""
        away = (np.linalg.norm(closest_points(mesh, p) - p, axis=1).min() for p in self.points)
        return float(max(away))


def light_problems(design: SensorDesign) -> list[Diagnostic]:
    """Return warnings about lights: windows that are partly in a part, lights closer together than
    their bodies are wide, windows that overlap, and lights from which no straight ray reaches the
    sensor.

    Args:
        design: a design without errors.
    """
    meshes = design.deformed_meshes()
    problems = _buried(design, meshes)
    crowded = set()
    for name, group in design.lights.items():
        where = design.where("lights", name)
        crowd = _crowded(group)
        if crowd is not None:
            crowded.add(name)
            problems.append(
                Diagnostic(
                    f"lights of group '{name}' {crowd}",
                    where,
                    "Move them apart, or leave some out",
                    severity="warning",
                )
            )
        dark = int(np.count_nonzero(_reach_nothing(design, group, meshes)))
        if dark:
            problems.append(
                Diagnostic(
                    f"{dark} of {len(group.lights)} lights of group '{name}' send no straight ray "
                    "to a clear part or the inside of the sensing surface past the opaque parts",
                    where,
                    "Move them into the housing, or turn them",
                    severity="warning",
                )
            )
    return problems + _overlapping(design, crowded)


def windows_in(
    design: SensorDesign, parts: dict[str, TriangleMesh], exempt: set[tuple[str, int, str]]
) -> Iterator[WindowIn]:
    """Yield the lights of which a sample of the window lies in a closed part, by group and part,
    but for some that are exempt by group, number and part.
    """
    samples = {
        (name, index): window
        for name, group in design.lights.items()
        for index, window in enumerate(_samples(group))
    }
    for part, mesh in parts.items():
        windows = {key: at for key, at in samples.items() if (*key, part) not in exempt}
        if not windows:
            continue
        within = inside(np.concatenate(list(windows.values())), mesh)
        ends = np.cumsum([len(window) for window in windows.values()])
        found = np.split(within, ends[:-1])
        for ((name, index), window), mask in zip(windows.items(), found, strict=True):
            if mask.any():
                yield WindowIn(name, index, part, window[mask], bool(mask[0]), bool(mask.all()))


def _crowded(group: LightGroup) -> str | None:
    """Return a text that says how lights are closer together than their bodies are wide, or None.

    Lights of which the library does not know the body are never crowded.
    """
    if group.model not in library.names("light") or len(group.lights) < 2:
        return None
    package = getattr(library.entry("light", group.model), "package", None)
    if package is None:
        return None
    places = np.array([light.position for light in group.lights])
    nearest = float(cKDTree(places).query(places, k=2)[0][:, 1].min())
    if nearest >= min(package[:2]) - TOGETHER:
        return None
    return f"are {nearest:.2f} mm apart, but a {group.model} is {package[0]:g} x {package[1]:g} mm"


def _overlapping(design: SensorDesign, crowded: set[str]) -> list[Diagnostic]:
    """Return warnings about windows in nearly one plane that overlap, one for each two groups.

    Rays that end there meet only one of the windows. Lights with the same window, such as the dies
    of an RGB LED, count as one, and those of one crowded group are not compared.
    """
    windows = [
        (name, window) for name, group in design.lights.items() for window in _samples(group)
    ]
    windows = [(name, window) for name, window in windows if len(window) > 1]
    if len(windows) < 2:
        return []
    middles = np.array([window[0] for _, window in windows])
    reach = max(np.linalg.norm(window - window[0], axis=1).max() for _, window in windows)
    found: dict[tuple[str, str], int] = {}
    for i, j in sorted(cKDTree(middles).query_pairs(2.0 * reach)):
        (one, first), (other, second) = windows[i], windows[j]
        if one == other and one in crowded:
            continue
        if _overlap(first, second) and not _coincide(first, second):
            found[one, other] = found.get((one, other), 0) + 1
    return [
        Diagnostic(
            f"windows of lights of group '{one}' overlap those of group '{other}' partly in "
            f"{count} {'place' if count == 1 else 'places'}, where only one of two counts",
            design.where("lights", one),
            "Move them apart, or give both the same position, direction and outline",
            severity="warning",
        )
        for (one, other), count in found.items()
    ]


def _coincide(one: FloatArray, other: FloatArray) -> bool:
    """Return whether two windows in one plane, samples (9, 3) each as of `_samples`, have the same
    outline: the same corners, or the same middle and one radius.
    """
    away = np.linalg.norm(one[:, None] - other, axis=2).min(axis=1)
    if away.max() <= TOGETHER:
        return True
    radii = np.linalg.norm([window[1:] - window[0] for window in (one, other)], axis=2)
    return bool(away[0] <= TOGETHER and np.ptp(radii) <= TOGETHER)


def _overlap(one: FloatArray, other: FloatArray) -> bool:
    """Return whether two windows, samples (9, 3) each as of `_samples`, overlap (the test of
    separating axes), of which the second lies within `FLUSH` of the plane of the first.
    """
    sides = [np.roll(window[1:], -1, axis=0) - window[1:] for window in (one, other)]
    faces = [np.cross(side[0], side[2]) for side in sides]
    if np.abs((other - one[0]) @ faces[0]).max() > FLUSH * np.linalg.norm(faces[0]):
        return False
    for face, side in zip(faces, sides, strict=True):
        axes = np.cross(side, face)
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        a, b = one @ axes.T, other @ axes.T
        apart = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
        if apart.max() > -TOGETHER:
            return False
    return True


def _buried(design: SensorDesign, meshes: dict[str, TriangleMesh]) -> list[Diagnostic]:
    """Return warnings about windows that are partly in a part, one for each group and part.

    A window that is wholly in clear parts of one medium is cast into them, and one whose middle is
    in an opaque part is an error of its own.
    """
    solid = {
        name: mesh
        for name, mesh in meshes.items()
        if mesh.is_closed and design.parts[name].role is not Role.INDENTER
        if not _is_gap(design, name)
    }
    found: dict[tuple[str, str], list[float]] = {}
    for each in windows_in(design, solid, set()):
        opaque = design.parts[each.part].role in OPAQUE_ROLES
        if each.middle if opaque else each.whole or _is_cast(design, each, solid):
            continue
        depth = each.depth(solid[each.part])
        if depth > FLUSH:
            found.setdefault((each.group, each.part), []).append(depth)
    return [
        Diagnostic(
            f"the windows of {len(depths)} of {len(design.lights[group].lights)} lights of group "
            f"'{group}' are partly inside part '{part}', up to {max(depths):.2g} mm deep",
            design.where("lights", group),
            "Move them out, or make a hole in the part"
            if design.parts[part].role in OPAQUE_ROLES
            else "Move them out, or wholly in if they are cast into it",
            severity="warning",
        )
        for (group, part), depths in found.items()
    ]


def _is_cast(design: SensorDesign, found: WindowIn, solid: dict[str, TriangleMesh]) -> bool:
    """Return whether a window that is partly in a clear part is wholly in clear parts that are one
    medium with it, or on their faces.
    """
    meshes = [mesh for name, mesh in solid.items() if one_medium(design, found.part, name)]
    window = _samples(design.lights[found.group])[found.number]
    covered = np.any([inside(window, mesh) for mesh in meshes], axis=0)
    return all(
        min(distance_within(mesh, point, TOGETHER) for mesh in meshes) <= TOGETHER
        for point in window[~covered]
    )


def _is_gap(design: SensorDesign, name: str) -> bool:
    """Return whether a part is air, in which a light has room."""
    material = design.materials.get(design.parts[name].material or "")
    medium = None if material is None else material.medium()
    return medium is not None and is_gas(medium)


def _samples(group: LightGroup) -> FloatArray:
    """Return points (n, k, 3) of the windows of a group's lights, mm: the middle, then the outline.

    A point light, or one that the library lacks, has only its middle.
    """
    model = _model(group)
    window = None if model is None else model.window()
    places = np.array([light.position for light in group.lights])
    if window is None:
        return places[:, None]
    across = SAMPLES
    if window.shape == "disc":
        across = SAMPLES / np.linalg.norm(SAMPLES, axis=1, keepdims=True).clip(1.0)
    offsets = across * (np.array(window.size) / 2.0)
    axes = np.array([frame_of(light.direction, light.up)[:2] for light in group.lights])
    samples: FloatArray = places[:, None] + np.einsum("kc,nci->nki", offsets, axes)
    return samples


def _model(group: LightGroup) -> LightModel | None:
    try:
        return library.emitter(group)
    except OptiSenseError:
        return None


def _reach_nothing(
    design: SensorDesign, group: LightGroup, meshes: dict[str, TriangleMesh]
) -> BoolArray:
    """Return a mask (n,) of the lights of a group whose straight rays all miss the sensor, or meet
    a dark wall or the outside of the sensing surface first.
    """
    dark = np.ones(len(group.lights), dtype=bool)
    if not any(_is_dark(design, name) for name in meshes):
        return np.zeros(len(group.lights), dtype=bool)
    for count in RAYS:
        for index in np.flatnonzero(dark).tolist():
            light = group.lights[index]
            rays = _half_sphere(count) @ frame_of(light.direction, light.up)
            dark[index] = not _arrives(design, meshes, np.array(light.position), rays)
    return dark


def _arrives(
    design: SensorDesign, meshes: dict[str, TriangleMesh], place: FloatArray, rays: FloatArray
) -> bool:
    """Return whether one of the rays (k, 3) from a place (3,) meets a clear part, a bright wall or
    the inside of the sensing surface before anything else.
    """
    ends, goal = np.full((2, len(rays)), np.inf)
    for name, mesh in meshes.items():
        role = design.parts[name].role
        if role is Role.INDENTER:
            continue
        hits = ray_hits(mesh, place, rays)
        stops = np.full(len(hits.ray), _is_dark(design, name))
        if role is Role.SENSING_SURFACE:
            stops = np.einsum("ki,ki->k", mesh.face_normals[hits.face], rays[hits.ray]) > 0.0
        np.minimum.at(ends, hits.ray[stops], hits.distance[stops])
        np.minimum.at(goal, hits.ray[~stops], hits.distance[~stops])
    return bool((goal < ends - TOGETHER).any())


def _is_dark(design: SensorDesign, name: str) -> bool:
    """Return whether a part is a wall that reflects little."""
    part = design.parts[name]
    if part.role is not Role.BLOCKER:
        return False
    material = design.materials.get(part.material or "")
    return material is None or max(material.reflection().reflectance) <= DARK_WALL


def _half_sphere(count: int) -> FloatArray:
    """Return unit vectors (count, 3) spread evenly over the half sphere about +z, the first of them
    its axis (a Fibonacci lattice).
    """
    number = np.arange(count)
    height = 1.0 - number / count
    turn = number * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - height**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
