"""Clearance: the smallest distance between parts that do not touch."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from optisense.design import Role, SensorDesign
from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh_points import closest_points
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

APART = 0.05
"""Distance (mm) below which undeformed parts count as touching, so that they have no clearance.
Glue and tape of the built-in sensors have no gap."""

BEGINNINGS = 2
"""Number of pairs of near vertices from which the search for the nearest points of two parts
starts, as the nearest pair may lead to a local minimum.
"""

SAMPLED = 1500
"""Number of places of each part among which these pairs are found, which takes 10 ms."""

STEPS = 6
"""Number of steps of alternating projections between two parts: each step shortens the distance,
and on flat faces two or three are enough."""

MOST_FACES = 1000
"""Number of faces among which the nearest point is searched, which takes about a ms."""

MOST_CLEARANCE = 1e4
"""Value (mm) if no two parts are apart: ten metres, larger than any sensor."""


@objective(
    "clearance",
    title="Clearance",
    range=(0.0, MOST_CLEARANCE),
    unit="mm",
    rays_only=True,
    numbers=(),
)
def clearance(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The smallest distance between two parts that do not touch, in mm.

    Parts that touch before cages bend them, such as a gel and its tray, are left out. The value is
    0 if others intersect. `of_parts` names the two that are nearest.
    """
    design = evaluation.design
    bent = _places(design.deformed_meshes())
    least, nearest = MOST_CLEARANCE, ""
    for one, other in _apart(design):
        here, there = bent[one], bent[other]
        if here.gap(there) < least and (found := here.distance(there)) < least:
            least, nearest = found, f"{one} and {other}"
    if not nearest:
        raise ObjectiveError("the design has no two parts that are apart")
    return least, {"of_parts": nearest}


def _apart(design: SensorDesign) -> list[tuple[str, str]]:
    """Return the pairs of parts that do not touch before they are bent."""
    names = [name for name, part in design.parts.items() if part.role is not Role.INDENTER]
    at = _places(design.meshes)
    return [
        (one, other)
        for one, other in combinations(names, 2)
        if at[one].gap(at[other]) > APART or at[one].distance(at[other]) > APART
    ]


def _places(meshes: Mapping[str, TriangleMesh]) -> dict[str, _Places]:
    return {name: _Places.of(mesh) for name, mesh in meshes.items()}


def distance(one: TriangleMesh, other: TriangleMesh) -> float:
    """Return the distance (mm) between the surfaces of two meshes; about 0 if they intersect."""
    return _Places.of(one).distance(_Places.of(other))


class _Places(NamedTuple):
    """Places (n, 3), mm, on a mesh: vertices, and the middles of faces and edges."""

    mesh: TriangleMesh
    points: NDArray[np.float64]
    tree: cKDTree

    @staticmethod
    def of(mesh: TriangleMesh) -> _Places:
        """Return the places on a mesh, with a tree to find the nearest ones."""
        corners = mesh.triangles
        edges = 0.5 * (corners + np.roll(corners, -1, axis=1))
        places = np.concatenate([corners, edges, corners.mean(axis=1, keepdims=True)], axis=1)
        points = np.asarray(places.reshape(-1, 3), dtype=np.float64)
        return _Places(mesh, points, cKDTree(points))

    def gap(self, other: _Places) -> float:
        """Return the distance (mm) between the bounding boxes, which that of the meshes is not
        below.
        """
        (low, high), (other_low, other_high) = self.mesh.bounds, other.mesh.bounds
        return float(np.linalg.norm(np.maximum(np.maximum(low - other_high, other_low - high), 0)))

    def distance(self, other: _Places) -> float:
        """Return the distance (mm) between the surfaces of two meshes, as `distance` does."""
        few = [each.points[:: 1 + len(each.points) // SAMPLED] for each in (self, other)]
        gaps = cdist(*few)
        partners = gaps.argmin(axis=1)
        nearest = gaps[np.arange(len(gaps)), partners]
        found = float(nearest.min())
        for start in np.argsort(nearest)[:BEGINNINGS]:
            point = few[1][partners[start]]
            for _ in range(STEPS):
                on_one = self.nearest(point)
                point = other.nearest(on_one)
                found = min(found, float(np.linalg.norm(point - on_one)))
        return found

    def nearest(self, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the point (3,), mm, of the mesh that is nearest to a point; on a fine mesh, only
        the faces with the nearest places are searched.
        """
        mesh = self.mesh
        if len(mesh.faces) > MOST_FACES:
            _, near = self.tree.query(point, MOST_FACES)
            faces = np.unique(near // (len(self.points) // len(mesh.faces)))
            mesh = TriangleMesh(mesh.vertices, mesh.faces[faces])
        found = closest_points(mesh, point)
        return np.asarray(found[int(np.linalg.norm(found - point, axis=1).argmin())])
