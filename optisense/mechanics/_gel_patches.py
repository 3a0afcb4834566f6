"""A cache of gel patches for contacts that return to the same places."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh
from optisense.mechanics._footprint import Footprint
from optisense.mechanics._gel_columns import gel_columns
from optisense.mechanics._gel_patch import GelPatch

FLAT = 0.02
"""Largest deviation from a flat layer (see `GelColumns.uneven`) at which a gel is treated as one.
Forces change by less than half of this share."""
NEAR, NEARER = 0.75, 0.5
"""Distances of the loaded rectangle from the border of a flat gel, in thicknesses, between which
the response changes from that of a flat layer to that of the elements. On GelSight Mini, their
forces differ by 1.2 % at the farther one."""
MOST_KEPT = 12
"""Number of patches that are kept: nine places and some more. Each takes about 20 MB, and three
times as much after a drag."""
STEP = 0.25
"""Step in which the loaded rectangle around a place grows, in thicknesses, so that presses of
several depths at one place share a patch."""
THICKNESSES_PER_OCTAVE = 16
"""Number of thicknesses per factor of two of the flat layers to which gels of other shapes are
compared. With few of them, contacts at different places share the kernels of their layer. The next
larger one is softer, so that the iteration converges where free sides make a gel softer."""
SAME_PLACE = 6
"""Number of decimals (of mm) to which equal places agree: far below any distance that matters, and
above the rounding of double precision."""


class _Kept(NamedTuple):
    """A patch (None where the gel is a flat layer) and half sides (mm) of its loaded rectangle."""

    loaded: tuple[float, float]
    patch: GelPatch | None


class GelPatches:
    """Factory and cache of the patches of one gel."""

    def __init__(
        self, skin: TriangleMesh, elastomers: Sequence[TriangleMesh], poisson_ratio: float
    ) -> None:
        """Create an empty cache for a sensing surface and the gels under it, in the design."""
        self._skin, self._elastomers, self._nu = skin, elastomers, poisson_ratio
        self._kept: OrderedDict[tuple[float, ...], _Kept] = OrderedDict()

    def around(self, place: Footprint) -> GelPatch | None:
        """Return the patch around a contact; None where the gel is a flat layer or no patch can be
        made.

        A patch takes a twentieth of a second to compute, and a solution with it a millisecond.
        """
        if not self._elastomers:
            return None
        key = _key(place)
        needed = tuple(float(np.abs(grid).max()) for grid in (place.x, place.y))
        kept = self._kept.get(key)
        if kept is None or any(a < b for a, b in zip(kept.loaded, needed, strict=True)):
            step = STEP * place.thickness
            wide, high = (step * math.ceil(half / step) for half in needed)
            kept = _Kept((wide, high), self._made(place, (wide, high)))
            self._kept[key] = kept
        self._kept.move_to_end(key)
        while len(self._kept) > MOST_KEPT:
            self._kept.popitem(last=False)
        return kept.patch

    def _made(self, place: Footprint, loaded: tuple[float, float]) -> GelPatch | None:
        columns = gel_columns(place, loaded, self._skin, self._elastomers)
        if columns is None:
            return None
        share = 1.0
        if columns.uneven <= FLAT:
            share = (NEAR - columns.room / place.thickness) / (NEAR - NEARER)
        if share <= 0.0:
            return None
        thickness = place.thickness
        if share >= 1.0:
            octaves = math.ceil(THICKNESSES_PER_OCTAVE * math.log2(thickness))
            thickness = 2.0 ** (octaves / THICKNESSES_PER_OCTAVE)
        return GelPatch(columns, loaded, thickness, self._nu, min(share, 1.0))


def _key(place: Footprint) -> tuple[float, ...]:
    numbers: NDArray[np.float64] = np.concatenate(
        [place.origin, place.axes.ravel(), [place.thickness]]
    )
    return tuple(np.round(numbers, SAME_PLACE).tolist())
