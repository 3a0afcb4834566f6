"""The arrangement of parts: overlaps and films of air between solids, what solids of higher
priority leave of others, and the picture along straight rays.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from optisense.design.camera import Camera
from optisense.design.limits import is_gas
from optisense.design.parts import TRANSPARENT_SOLIDS, Role
from optisense.design.problems import Diagnostic
from optisense.design.projection import directions, picture_places, within_view
from optisense.design.sensor_design import Meshes, SensorDesign
from optisense.geometry import TriangleMesh
from optisense.geometry.coincidence import sample_seam
from optisense.geometry.containment import inside
from optisense.geometry.rays import ray_hits
from optisense.geometry.solids import common_space, without

EQUAL_INDEX = 1e-6
"""Largest difference of refractive indices for which solids count as one medium; it covers rounding
of numbers in files."""

COINCIDENCE_TOLERANCE = 0.002
"""Distance (mm) below which faces touch, and thickness below which an overlap is a contact: a tenth
of the thinnest film that a design holds (0.02 mm). An intended gap (a film of air) must be wider.
"""

WIDEST_FILM = 0.05
"""Thickness (mm) up to which a gap beside a contact is taken as unintended: two tessellations of a
curved face of 10 mm radius with facets of 2 mm are as far apart."""

FILM_SHARE = 0.01
"""Share of the common face of two solids up to which a film of air is not reported, as pictures
change by about as much."""

SAMPLES, SAMPLES_TURN = 89, 55
"""Number of points of the picture at which the sensing surface is looked for, and the step by which
they go round it downwards. They are two Fibonacci numbers, so that the points are a lattice whose
rows are not parallel to the edges of the picture: of rectangles of any size and angle, the shares
of nine in ten are right to 0.02, and of all to 0.08."""


def one_medium(design: SensorDesign, name: str, other: str) -> bool:
    """Return whether two parts are solids that are one medium to the light."""
    parts = design.parts[name], design.parts[other]
    if not all(part.role in TRANSPARENT_SOLIDS for part in parts):
        return False
    one, two = (design.materials[part.material or ""].medium() for part in parts)
    if one is None or two is None:
        return False
    return abs(one.ior - two.ior) <= EQUAL_INDEX and one.absorption == two.absorption


def may_overlap(design: SensorDesign, name: str, other: str) -> bool:
    """Return whether two parts may share space: they are transparent solids that are one medium, or
    of which one is cut out of the other, as their priorities differ.
    """
    parts = design.parts[name], design.parts[other]
    solid = all(part.role in TRANSPARENT_SOLIDS for part in parts)
    return solid and (parts[0].priority != parts[1].priority or one_medium(design, name, other))


def overlaps(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Return problems of solids of different index that overlap without a priority between them."""
    problems: list[Diagnostic] = []
    solids = [n for n in meshes if design.parts[n].role in TRANSPARENT_SOLIDS]
    for name, other in combinations(solids, 2):
        if may_overlap(design, name, other):
            continue
        place = common_space(meshes[name], meshes[other])
        if place is not None:
            problems.append(
                Diagnostic(
                    f"parts '{name}' and '{other}' overlap near "
                    "({:.2f}, {:.2f}, {:.2f}) mm".format(*place)
                    + f" and have the same priority {design.parts[name].priority}",
                    design.where("parts", other, "priority"),
                    "Move them apart, or give the part that fills the common space the larger "
                    "priority",
                )
            )
    return problems


def films(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Return warnings about solids that touch over a part of a common face and leave a film of air
    over the rest, as two tessellations of one curved face do.
    """
    problems = []
    solids = {n: mesh for n, mesh in meshes.items() if design.parts[n].role in TRANSPARENT_SOLIDS}
    media = {n: design.materials[design.parts[n].material or ""].medium() for n in solids}
    dense = [n for n, medium in media.items() if medium is None or not is_gas(medium)]
    for name, other in combinations(dense, 2):
        seam = sample_seam(solids[name], solids[other], WIDEST_FILM)
        gap = seam.heights > COINCIDENCE_TOLERANCE
        least = FILM_SHARE * len(gap)
        if (~gap).sum() <= least:
            continue
        for between, mesh in solids.items():
            if gap.sum() > least and between not in (name, other):
                gap[gap] = ~inside(seam.middles[gap], mesh)
        if gap.sum() > least:
            problems.append(
                Diagnostic(
                    f"parts '{name}' and '{other}' touch, but leave a film of air of up to "
                    f"{seam.heights[gap].max():.2g} mm over {gap.sum() * seam.area:.3g} mm²",
                    design.where("parts", other, "mesh"),
                    "Give both the same triangles there, or let one reach into the other and "
                    "give it the larger priority",
                    severity="warning",
                )
            )
    return problems


def in_picture(camera: Camera, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return a mask (n,) of the points that lie in the picture along straight rays.

    Args:
        points: points (n, 3), mm.
    """
    across, down = picture_places(camera, points)
    with np.errstate(invalid="ignore"):
        inside: NDArray[np.bool_] = (np.abs(across - 0.5) <= 0.5) & (np.abs(down - 0.5) <= 0.5)
    return inside


def straight_rays(camera: Camera) -> NDArray[np.float64]:
    """Return unit vectors (k, 3) of rays through those of `SAMPLES` points of the picture that show
    something; each point stands for an equal share of the picture.
    """
    number = np.arange(SAMPLES)
    across, down = (number + 0.5) / SAMPLES, (number * SAMPLES_TURN % SAMPLES + 0.5) / SAMPLES
    return directions(camera, across, down)[within_view(camera, across, down)]


def skin_distances(
    design: SensorDesign, meshes: Meshes, rays: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distances (k,), mm, at which rays (k, 3) from the camera meet the sensing surface;
    infinite if they miss it, or meet a blocker or the outside of its coating first.
    """
    skin, blocker = np.full((2, len(rays)), np.inf)
    for name in design.parts_of(Role.SENSING_SURFACE, Role.BLOCKER):
        if name not in meshes:
            continue
        hits = ray_hits(meshes[name], design.camera.position, rays)
        inside = np.zeros(len(hits.ray), dtype=bool)
        if design.parts[name].role is Role.SENSING_SURFACE:  # its normals point inward
            normals = meshes[name].face_normals[hits.face]
            inside = np.einsum("ki,ki->k", normals, rays[hits.ray]) < 0.0
        np.minimum.at(skin, hits.ray[inside], hits.distance[inside])
        np.minimum.at(blocker, hits.ray[~inside], hits.distance[~inside])
    return np.where(skin < blocker, skin, np.inf)


def carved(design: SensorDesign, meshes: Meshes, name: str) -> TriangleMesh:
    """Return the mesh of a transparent solid without its overlaps with those of higher priority.

    It is the mesh itself if there are none, as where parts only touch.
    """
    mesh = meshes[name]
    for other, part in design.parts.items():
        if (
            part.role in TRANSPARENT_SOLIDS
            and part.priority > design.parts[name].priority
            and other in meshes
        ):
            mesh = without(mesh, meshes[other])
    return mesh
