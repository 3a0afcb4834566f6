"""Displacements that contacts on one skin cause at each other."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from optisense.mechanics.displacement_field import DisplacementField, GridSpline
from optisense.mechanics.footprint import Footprint

FloatArray = NDArray[np.float64]

SPARSE = 4
"""Distance, in pitches of a contact's grid, of the points at which displacements due to other
contacts are computed: a sixteenth of a contact, over which they change little."""


class Neighbours:
    """The displacements of each contact's grid by the other contacts.

    Attributes:
        fields: the displacement of each contact; None until it is solved. What it causes at others
            is computed again after it was replaced.
    """

    def __init__(self, places: Sequence[Footprint]) -> None:
        """Set the footprints of all contacts, none of which is solved yet."""
        self._places = places
        self.fields: list[DisplacementField | None] = [None] * len(places)
        self._known: dict[tuple[int, int], tuple[DisplacementField, FloatArray]] = {}

    def at(self, number: int) -> FloatArray:
        """Return the inward displacement (rows, columns), mm, of the skin on a contact's grid due
        to the others.
        """
        place = self._places[number]
        total: FloatArray | None = None
        for other, field in enumerate(self.fields):
            if other == number or field is None:
                continue
            known = self._known.get((number, other))
            if known is None or known[0] is not field:
                known = field, _caused(self._places[other], field, place)
                self._known[number, other] = known
            total = known[1] if total is None else total + known[1]
        if total is None:
            return np.zeros(place.overlap.shape)
        x, y = np.meshgrid(place.x, place.y)
        spline = GridSpline(total, place.x[0], place.y[0], SPARSE * place.pitch)
        return spline.value(x.ravel(), y.ravel()).reshape(x.shape)


def _caused(cause: Footprint, field: DisplacementField, place: Footprint) -> FloatArray:
    """Return the inward displacement, mm, that one contact causes at every `SPARSE`-th point of the
    grid of another.
    """
    x, y = np.meshgrid(
        *(
            at[0] + SPARSE * place.pitch * np.arange(math.ceil((len(at) - 1) / SPARSE) + 1)
            for at in (place.x, place.y)
        )
    )
    flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    local = cause.local(place.origin + flat @ place.axes.T)
    upright = max(float(cause.axes[:, 2] @ place.axes[:, 2]), 0.0)
    return upright * field.depth(local[:, 0], local[:, 1]).reshape(x.shape)
