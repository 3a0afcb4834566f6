"""Displacements that contacts on one skin cause at each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from optisense.array_types import FloatArray
from optisense.mechanics._footprint import Footprint
from optisense.mechanics._grid_spline import GridSpline

SPARSE = 4
"""Distance, in pitches of a contact's grid, of the points at which displacements due to other
contacts are computed: a sixteenth of a contact, over which they change little."""


ALONG, OUTWARD = (0, 1), 2
"""Numbers of the axes of a footprint: x and y along the skin, and z out of the sensor."""


class Neighbours:
    """The displacements (mm) of each contact's grid by the other contacts.

    They are given and returned along the axes of a contact's footprint.
    """

    def __init__(self, places: Sequence[Footprint]) -> None:
        """Set the footprints of all contacts, none of which is solved yet."""
        self._places = places
        self._points = [_sparse(place) for place in places]
        self._caused: list[dict[int, FloatArray]] = [{} for _ in places]

    def set_displacement(
        self, number: int, moved: Callable[[FloatArray, FloatArray], FloatArray]
    ) -> None:
        """Set the displacement by a contact that was solved, which replaces an earlier one, as a
        function that returns it (3, n) at coordinates x and y (n,) of the tangent plane.
        """
        others = [k for k in range(len(self._places)) if k != number]
        if not others:
            return
        place = self._places[number]
        local = place.local(np.concatenate([self._points[k].reshape(-1, 3) for k in others]))
        every = moved(local[:, 0], local[:, 1])
        self._caused[number] = {}
        for k in others:
            shape = self._points[k].shape[:2]
            each, every = np.split(every, [shape[0] * shape[1]], axis=1)
            turn = self._places[k].axes.T @ place.axes
            found = turn @ each if turn[2, 2] > 0.0 else np.zeros_like(each)
            self._caused[number][k] = found.reshape(3, *shape)

    def at(self, number: int, axis: int) -> FloatArray:
        """Return the displacement (rows, columns), mm, on a contact's grid due to others, along one
        of the axes `ALONG` and `OUTWARD`.
        """
        place = self._places[number]
        caused = [at_places[number][axis] for at_places in self._caused if number in at_places]
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
