"""The choice of the rays that are followed on: a part of many, or several copies of few."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.arrays import joined, tiled
from optisense.optics.backend.sequences import unit_float

SPLIT_SHARE = 1 / 16
"""Share of all rays up to which those that meet an indenter first are split into several. Few rays
from the skin do, and the contact is bright: on the skin around a contact of GelSight Mini of
specularity 1, splitting reduces the noise from 17 to 10 %."""
MOST_CACHED = 2_500
"""Largest number of places on the skin whose cached light is summed at each reflection; if rays
meet more, a part of them is drawn. The sum over beams takes up to ten times as long as a ray, on
GelSight360 with its nine light groups. With 10,000, the noise of contacts is the same, and images
take up to a tenth longer."""
MOST_GATHERED = 40_000
"""The same where rays end. With 10,000, the noise of the skin of GelSight Mini far from contacts is
19 instead of 16 %."""
MOST_COPIES = 16
"""Largest number of rays into which a ray is split; with 64, the noise is the same."""


def drawn(
    wanted: mi.Bool, weight: mi.Float, bits: mi.UInt32, most: int
) -> tuple[mi.UInt32, mi.Float]:
    """Return numbers of the ``wanted`` rays, and the mean number of times that each occurs.

    If there are more than ``most``, they are drawn in proportion to their weights.

    Args:
        weight: weight (n,) of each ray.
        bits: random bits (n,) of each ray.
    """
    kept = dr.compress(wanted)
    count = dr.width(kept)
    if count <= most:
        return kept, dr.full(mi.Float, 1, count)
    weight = dr.gather(mi.Float, weight, kept)
    until = dr.cumsum(weight)
    total = dr.gather(mi.Float, until, mi.UInt32(count - 1))
    shift = unit_float(dr.gather(mi.UInt32, bits, kept[0]))
    step = total / most
    place = _first_above(until, (dr.arange(mi.Float, most) + shift) * step)
    return dr.gather(mi.UInt32, kept, place), dr.gather(mi.Float, weight, place) / step


def _first_above(rising: mi.Float, values: mi.Float) -> mi.UInt32:
    """Return the index (m,) of the first entry of rising numbers (n,) that is greater than each of
    the values (m,), or that of the last entry.

    Unlike that of `drjit.binary_search`, the kernel does not depend on n, so that it is compiled
    once.
    """

    def halved(first: mi.UInt32, last: mi.UInt32) -> tuple[mi.UInt32, mi.UInt32]:
        middle = (first + last) // 2
        above = dr.gather(mi.Float, rising, middle) > values
        return dr.select(above, first, middle + 1), dr.select(above, middle, last)

    first = dr.zeros(mi.UInt32, dr.width(values))
    last = dr.opaque(mi.UInt32, dr.width(rising) - 1, dr.width(values))
    first, _ = dr.while_loop((first, last), lambda first, last: first < last, halved)
    return first


def split(on_skin: mi.Bool, count: int) -> tuple[mi.UInt32, int]:
    """Return numbers of rays, in which those that are not ``on_skin`` occur several times, and how
    often they do.

    Args:
        count: number of rays that were traced.
    """
    raised = dr.compress(~on_skin)
    few = int(SPLIT_SHARE * count)
    copies = min(MOST_COPIES, max(1, few // max(1, dr.width(raised))))
    every = dr.arange(mi.UInt32, dr.width(on_skin))
    if copies == 1 or dr.width(raised) == 0:
        return every, 1
    return joined(every, tiled(raised, copies - 1)), copies
