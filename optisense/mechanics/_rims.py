"""Warnings about contacts beside the rim of a gel, where the computed force is inaccurate."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.design.parts import Role
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh_points import closest_points
from optisense.mechanics._footprint import Footprint
from optisense.mechanics._gel_columns import LEAST_UPRIGHT
from optisense.mechanics._gel_patch import GelPatch

STEEP_RIM = 2.0
"""Distance (mm) of a contact from skin that is too steep for elements, below which forces are not
reliable: on DIGIT, they change by up to 5 % in 0.1 mm at 1.8 mm."""
LEFT_OUT = 0.85
"""Distance of the loads from skin without elements, in thicknesses, below which forces are not
reliable: at the end of GelSight Svelte's skin, steps of 6 % in 0.25 mm begin at 0.81."""
FREE_SIDE = 1.0
"""Distance (mm) of the middle of a contact from a free side of the gel, below which the error of
the force is more than 4 %; measured with a ball of radius 1.5 mm on the pad of GelSight Mini."""
AT_SIDE = 20
"""Largest error (%) of that force, at the side, where it is too small. Measured as above, against
columns a fifth as far apart."""


def rims_in_words(design: SensorDesign) -> str:
    """Return words on where forces of contacts on a skin are inaccurate; empty if nowhere."""
    meshes = design.deformed_meshes()
    skins = [meshes[name] for name in design.parts_of(Role.SENSING_SURFACE)]
    return Rims(TriangleMesh.joined(skins).welded()).in_words() if skins else ""


class Rims:
    """The places of a sensing surface beside which forces are inaccurate."""

    def __init__(self, skin: TriangleMesh) -> None:
        """Set the sensing surface, mm; its faces share vertices."""
        self._skin = skin

    def warning(self, place: Footprint, patch: GelPatch | None) -> str:
        """Return a sentence about the error of a contact's force; empty if there is none."""
        at = "the contact at ({:.2f}, {:.2f}, {:.2f}) mm".format(*place.origin)
        upright = -(self._skin.face_normals @ place.axes[:, 2])
        steep = self._distance(np.flatnonzero(upright < LEAST_UPRIGHT), place.origin, STEEP_RIM)
        if steep < STEEP_RIM:
            return (
                f"{at} is {steep:.1f} mm from skin that is steeper than 60 degrees against it; "
                f"within {STEEP_RIM:g} mm of such a rim, forces are not reliable"
            )
        if self._turns_beside(place):
            return (
                f"{at} is on skin that turns by more than 60 degrees within {STEEP_RIM:g} mm; "
                "forces there are not reliable"
            )
        if patch is not None and patch.columns.left_out < LEFT_OUT * patch.thickness:
            return (
                f"{at} is beside gel that has no elements, as its side leans under the skin; "
                "forces there are not reliable"
            )
        side = _distance_from_edges(place.origin, self._border)
        if side < FREE_SIDE:
            return (
                f"{at} is {side:.1f} mm from the side of the gel; within {FREE_SIDE:g} mm of it, "
                f"forces are up to {AT_SIDE} % too small"
            )
        return ""

    def in_words(self) -> str:
        """Return words on where forces of contacts are inaccurate; empty if the skin has no rim."""
        if self._has_steep_rim():
            return f"forces within {STEEP_RIM:g} mm of the steep rim of the gel are not reliable"
        if len(self._border):
            return (
                f"forces within {FREE_SIDE:g} mm of the side of the gel are up to {AT_SIDE} % "
                "too small"
            )
        return ""

    def _turns_beside(self, place: Footprint) -> bool:
        """Return whether skin around a contact is steep against other skin around it, as on the
        edge of a rim.
        """
        middle, _ = self._skin.face_spheres
        near = ((middle - place.origin) ** 2).sum(axis=1) < STEEP_RIM**2
        normals = np.vstack([self._skin.face_normals[near], -place.axes[:, 2]])
        # Fine meshes have far more faces than directions that matter.
        normals = np.unique(np.round(normals, 2), axis=0)
        return bool((normals @ normals.T).min() < LEAST_UPRIGHT)

    def _has_steep_rim(self) -> bool:
        """Return whether skin is steep against other skin that is less than `STEEP_RIM` away."""
        from scipy.spatial import cKDTree  # slow to import

        middles, normals = self._skin.triangles.mean(axis=1), self._skin.face_normals
        # Fine meshes have far more pairs of faces than are needed: one face is enough for each
        # quarter of the distance and each direction.
        alike = np.round(np.hstack([middles * (4.0 / STEEP_RIM), normals * 4.0]))
        _, some = np.unique(alike, axis=0, return_index=True)
        middles, normals = middles[some], normals[some]
        pairs = cKDTree(middles).query_pairs(STEEP_RIM, output_type="ndarray")
        cosines = np.einsum("pi,pi->p", normals[pairs[:, 0]], normals[pairs[:, 1]])
        return bool((cosines < LEAST_UPRIGHT).any())

    def _distance(self, faces: NDArray[np.int64], point: FloatArray, most: float) -> float:
        """Return the distance (mm) of a point from some faces; infinite if it is above ``most``."""
        middle, square = self._skin.face_spheres
        away = np.linalg.norm(middle[faces] - point, axis=1) - np.sqrt(square[faces])
        near = faces[away < most]
        if not len(near):
            return np.inf
        found = closest_points(TriangleMesh(self._skin.vertices, self._skin.faces[near]), point)
        return float(np.nanmin(np.linalg.norm(found - point, axis=1)))

    @cached_property
    def _border(self) -> FloatArray:
        """Return the ends (n, 2, 3) of the edges of single faces, mm."""
        return np.asarray(self._skin.vertices[self._skin.open_edges], dtype=np.float64)


def _distance_from_edges(point: FloatArray, edges: FloatArray) -> float:
    """Return the distance (mm) of a point from the nearest of edges (n, 2, 3), or infinity."""
    way = edges[:, 1] - edges[:, 0]
    square = np.maximum(np.einsum("ni,ni->n", way, way), np.finfo(float).tiny)
    share = np.clip(np.einsum("ni,ni->n", point - edges[:, 0], way) / square, 0.0, 1.0)
    apart = np.linalg.norm(edges[:, 0] + share[:, None] * way - point, axis=1)
    return float(apart.min(initial=np.inf))
