"""Displacements that contacts on one skin cause at each other."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from optisense.array_types import FloatArray
from optisense.mechanics._displacement_field import DisplacementField
from optisense.mechanics._footprint import Footprint
from optisense.mechanics._grid_spline import GridSpline

SPARSE = 4
"""Distance, in pitches of a contact's grid, of the points at which displacements due to other
contacts are computed: a sixteenth of a contact, over which they change little."""


class Neighbours:
    """The displacements of each contact's grid by the other contacts."""

    def __init__(self, places: Sequence[Footprint]) -> None:
        """Set the footprints of all contacts, none of which is solved yet."""
        self._places = places
        self._points = [_sparse(place) for place in places]
        self._caused: list[dict[int, FloatArray]] = [{} for _ in places]

    def set_field(self, number: int, field: DisplacementField) -> None:
        """Set the displacement of a contact that was solved, which replaces an earlier one."""
        others = [k for k in range(len(self._places)) if k != number]
        if not others:
            return
        place = self._places[number]
        local = place.local(np.concatenate([self._points[k].reshape(-1, 3) for k in others]))
        depths = field.depth(local[:, 0], local[:, 1])
        self._caused[number] = {}
        for k in others:
            shape = self._points[k].shape[:2]
            depth, depths = np.split(depths, [shape[0] * shape[1]])
            upright = max(float(place.axes[:, 2] @ self._places[k].axes[:, 2]), 0.0)
            self._caused[number][k] = upright * depth.reshape(shape)

    def at(self, number: int) -> FloatArray:
        """Return the inward displacement (rows, columns), mm, on a contact's grid due to others."""
        place = self._places[number]
        caused = [at_places[number] for at_places in self._caused if number in at_places]
        if not caused:
            return np.zeros(place.overlap.shape)
        x, y = np.meshgrid(place.x, place.y)
        spline = GridSpline(np.sum(caused, axis=0), place.x[0], place.y[0], SPARSE * place.pitch)
        return spline.value(x.ravel(), y.ravel()).reshape(x.shape)


def _sparse(place: Footprint) -> FloatArray:
    """Return every `SPARSE`-th point (rows, columns, 3), mm, of a contact's grid."""
    x, y = np.meshgrid(
        *(
            at[0] + SPARSE * place.pitch * np.arange(math.ceil((len(at) - 1) / SPARSE) + 1)
            for at in (place.x, place.y)
        )
    )
    return np.asarray(place.origin + np.stack([x, y, np.zeros_like(x)], axis=2) @ place.axes.T)
