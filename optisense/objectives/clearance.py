"""Clearance: how near parts that do not touch come to each other."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from optisense.design import Role, SensorDesign
from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.geometry.surface import closest_points
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

APART = 0.05
"""mm: parts that are nearer where nothing is bent lie on each other, and their distance is none
that can be kept. Glue and tape of the built-in sensors are drawn without a gap."""

BEGINNINGS = 2
"""Pairs of near corners from which the nearest points of two parts are looked for."""

SAMPLED = 1500
"""Places of each part among which these pairs are found: all distances between them take 10 ms."""

STEPS = 6
"""Times that the nearest point goes from one part to the other and back: each step of alternating
projections shortens the way, and on flat faces two or three are enough."""

MOST_FACES = 1000
"""Faces among which the nearest point is looked for; about a ms."""

MOST_CLEARANCE = 1e4
"""mm, larger than any sensor: what is told where no two parts are apart."""


@objective("clearance", title="Clearance", range=(0.0, MOST_CLEARANCE), unit="mm", rays_only=True)
def clearance(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The smallest distance between two parts that do not touch, in mm.

    Parts that lie on each other before cages bend anything, as a gel on its tray, are left out; 0
    where others cut through each other. `of_parts` names the two that are nearest.

    Args:
        evaluation: the sensor.
    """
    design = evaluation.design
    bent = design.deformed_meshes()
    least, nearest = MOST_CLEARANCE, ""
    for one, other in _apart(design):
        found = distance(bent[one], bent[other])
        if found < least:
            least, nearest = found, f"{one} and {other}"
    if not nearest:
        raise ObjectiveError("the design has no two parts that are apart")
    return least, {"of_parts": nearest}


def _apart(design: SensorDesign) -> list[tuple[str, str]]:
    """The pairs of parts that do not touch where nothing is bent."""
    names = [name for name, part in design.parts.items() if part.role is not Role.INDENTER]
    meshes = design.meshes
    return [
        (one, other)
        for one, other in combinations(names, 2)
        if distance(meshes[one], meshes[other]) > APART
    ]


def distance(one: TriangleMesh, other: TriangleMesh) -> float:
    """mm between the surfaces of two meshes; 0, or nearly, where they cut through each other."""
    here, there = _Places.of(one), _Places.of(other)
    few = [each.points[:: 1 + len(each.points) // SAMPLED] for each in (here, there)]
    gaps = cdist(*few)
    partners = gaps.argmin(axis=1)
    nearest = gaps[np.arange(len(gaps)), partners]
    found = float(nearest.min())
    for start in np.argsort(nearest)[:BEGINNINGS]:
        point = few[1][partners[start]]
        for _ in range(STEPS):
            on_one = here.nearest(point)
            point = there.nearest(on_one)
            found = min(found, float(np.linalg.norm(point - on_one)))
    return found


class _Places(NamedTuple):
    """Places (n, 3) mm on a mesh: corners of its faces, the middles of these and of their edges."""

    mesh: TriangleMesh
    points: NDArray[np.float64]
    tree: cKDTree

    @staticmethod
    def of(mesh: TriangleMesh) -> _Places:
        corners = mesh.triangles
        edges = 0.5 * (corners + np.roll(corners, -1, axis=1))
        places = np.concatenate([corners, edges, corners.mean(axis=1, keepdims=True)], axis=1)
        points = np.asarray(places.reshape(-1, 3), dtype=np.float64)
        return _Places(mesh, points, cKDTree(points))

    def nearest(self, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """The point (3,) mm of the mesh that is nearest to one; of a fine mesh among the faces that
        have the nearest places."""
        mesh = self.mesh
        if len(mesh.faces) > MOST_FACES:
            _, near = self.tree.query(point, MOST_FACES)
            faces = np.unique(near // (len(self.points) // len(mesh.faces)))
            mesh = TriangleMesh(mesh.vertices, mesh.faces[faces])
        found = closest_points(mesh, point)
        return np.asarray(found[int(np.linalg.norm(found - point, axis=1).argmin())])
