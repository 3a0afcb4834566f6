"""Rays of lobes from one coating to the next, with branches at interfaces, and their selection."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.arrays import FEWEST_LANES, gathered, joined, tiled
from optisense.optics.backend.sequences import GOLDEN_BITS, richtmyer, unit_float
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.transport.camera_paths import (
    PathEnd,
    Paths,
    follow,
    follow_branches,
    generator,
)
from optisense.optics.transport.interact import LobeSample, RayKind

MOST_SCATTERED = 8
"""Largest number of rays into which a ray is split at a rough interface. In the contact of GelSight
Mini of specularity 1, where most of the noise is from the rough edges of the light guide, splitting
reduces the noise of pixels from 27 to 20 %, and takes a fifth more time."""
BRANCH_FACTOR = 2.0
"""Ratio of the probability with which the reflection of a ray at interfaces is followed to the
weight of that reflection, for rays from contacts. With 2, the noise in the contact of GelSight Mini
of specularity 1 is 2.5 %; with 4, it is 2.4 % in a tenth more time."""
SPLIT_SHARE = 1 / 16
"""Share of all rays up to which those that meet an indenter first are split into several. Few rays
from the skin do, and the contact is bright: on the skin around a contact of GelSight Mini of
specularity 1, splitting reduces the noise from 17 to 10 %."""
MOST_CACHED = 2_500
"""Largest number of places on the skin whose cached light is summed at each reflection; if rays
meet more, a part of them is drawn. With 10,000, the noise of contacts is the same, and images of
GelSight360 take up to a tenth longer."""
MOST_GATHERED = 40_000
"""The same where rays end. With 10,000, the noise of the skin of GelSight Mini far from contacts is
19 instead of 16 %."""
MOST_COPIES = 16
"""Largest number of rays into which a ray is split; with 64, the noise is the same."""


def follow_to_coating(
    scene: RayScene,
    ray: Ray,
    weight: mi.Color3f,
    bits: mi.UInt32,
    ray_kind: RayKind,
    roulette: bool,
) -> tuple[PathEnd, mi.UInt32]:
    """Follow rays to the lamp or the coating that they meet.

    Rays of the kind `RayKind.CAMERA` go through interfaces, and one of the reflections of each is
    followed as a ray of its own: little light is reflected at an interface, but from the skin of
    GelSight Mini only the reflected light meets other skin. Rays are split into several at the
    first rough interface, as the rough edges of a light guide scatter few rays towards lamps.

    Args:
        weight: factor (3, n) on the radiance at the rays' beginnings.
        bits: random bits (n,) of each ray.
        ray_kind: `RayKind.CAMERA` or `RayKind.REFLECTION`. Rays of the latter draw one of both ways
            at each interface.
        roulette: whether only a part of the reflections at interfaces are followed, with a
            probability of `BRANCH_FACTOR` times their weight (Russian roulette).

    Returns:
        The ends of those rays that meet a lamp or a coating, and the numbers of the rays that they
        belong to.
    """
    paths = follow(scene, ray, weight, generator(bits), ray_kind, until_rough=scene.rough)
    dr.eval(paths)
    parts = [_met(paths.end, dr.arange(mi.UInt32, dr.width(bits)))]
    rough = dr.compress(paths.stopped.active)
    if dr.width(rough) >= FEWEST_LANES:
        parts.append(_scattered(scene, paths, rough, bits))
    chosen = paths.branch.active
    if roulette:
        chance = dr.minimum(1, BRANCH_FACTOR * dr.max(paths.branch_weight))
        chosen &= unit_float(mi.sample_tea_32(bits, mi.UInt32(GOLDEN_BITS))[0]) < chance
        paths.branch_weight /= dr.select(chosen, chance, 1)
        dr.eval(paths.branch_weight, chosen)
    turned = dr.compress(chosen)
    if dr.width(turned) >= FEWEST_LANES:
        other = dr.gather(mi.UInt32, bits, turned) ^ GOLDEN_BITS
        parts.append(_met(follow_branches(scene, paths, turned, other), turned))
    out, *others = [part for part in parts if dr.width(part[1]) > 0] or parts[:1]
    for part in others:
        out = joined(out, part)
    return out


def _scattered(
    scene: RayScene, paths: Paths, lanes: mi.UInt32, bits: mi.UInt32
) -> tuple[PathEnd, mi.UInt32]:
    """Follow several rays, evenly spread, from each rough interface before which paths have
    stopped.

    All of them bring the light of lamps, and only the first that of coatings.

    Args:
        lanes: numbers (k,) of the stopped paths.
    """
    stopped = dr.width(lanes)
    copies = max(1, min(MOST_SCATTERED, round(dr.width(bits) / stopped)))
    number = dr.arange(mi.UInt32, stopped * copies)
    copy = number // dr.opaque(mi.UInt32, stopped)
    first = copy == 0
    lanes = tiled(lanes, copies)
    bits = dr.gather(mi.UInt32, bits, lanes)
    pick, *place = (richtmyer(bits, copy, k) for k in range(3))
    scattered = LobeSample(pick, mi.Point2f(*place))
    bits = mi.sample_tea_32(bits, number)[0]
    share = dr.opaque(mi.Float, 1 / copies)
    weight = dr.gather(mi.Color3f, paths.stopped_weight, lanes) * share
    ray = gathered(paths.stopped, lanes)
    end = follow(scene, ray, weight, generator(bits), RayKind.REFLECTION, first=scattered).end
    end.valid &= first
    end.weight *= dr.select(end.valid, 1 / share, 1)
    return _met(end, lanes)


def _met(end: PathEnd, number: mi.UInt32) -> tuple[PathEnd, mi.UInt32]:
    """Return the ends on lamps and coatings, and the numbers of their rays."""
    dr.eval(end)
    kept = dr.compress(end.valid | (end.light > 0))
    return gathered(end, kept), dr.gather(mi.UInt32, number, kept)


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
    """Return the index (m,) of the first of rising numbers (n,) above each value (m,), or the last.

    Unlike that of `drjit.binary_search`, the kernel does not depend on n.
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
