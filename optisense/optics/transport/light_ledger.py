"""The light ledger: the destinations of the light of each group.

Photons are followed as in the photon pass, and all losses on their paths are booked: absorption in
media, absorption by surfaces, escape from the sensor. The bookings of a photon add up to its power,
so that the ledger balances exactly despite its noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.interrupts import reraise_interrupts
from optisense.optics.backend.sequences import seed_of
from optisense.optics.scene.emitters import EmitterTable
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.transport.emission_guide import uniform_guide
from optisense.optics.transport.interact import Interaction, LobeSample, RayKind, interact
from optisense.optics.transport.photon_map import GROUP_MASK
from optisense.optics.transport.photons import Emission, TargetCells, hashed_generator, launch

PASS_PHOTONS = 1_000_000
"""Number of photons of one pass; progress is reported and Ctrl-C obeyed between passes, which take
about a second each."""

BATCHES = 16
"""Number of independent parts of the photons, whose standard deviation gives the noise of the sums.
With 16, the estimate of the noise is itself known to 18 % (1 / sqrt(2 * 15))."""

LEAST_SHARE = 1e-5
"""Share of a photon's power below which the opaque surface that it meets absorbs the rest. In
DIGIT's white housing, photons would otherwise be followed for a thousand surfaces, which takes 35
times as long."""


class Fate(IntEnum):
    """The fate of light, in the order of a surface's rows in the ledger."""

    ABSORBED = 0  # by the surface, where the camera does not look
    SEEN = 1  # by the surface, where the camera looks
    BEFORE = 2  # by the medium in front of the surface, on the way from it
    BEHIND = 3  # by the medium behind it
    ESCAPED = 4  # left the sensor after this surface


FATES = len(Fate)

SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Orientations of faces: the axis of the design's frame nearest to the outward normal."""


@dataclass(frozen=True)
class LedgerSums:
    """The sums of the ledger.

    Attributes:
        power: (batches, groups, 3, surfaces + media, fates) power (mW), for lights of 1 mW in each
            channel. The rows after the surfaces stand for the lights themselves, one for each
            medium that they start in (air first), and hold the losses before any surface.
        rest: (batches, groups, 3) power (mW) of photons whose paths were cut off.
        exits: (batches, groups, 3, surfaces, sides) power (mW) that escapes, by the orientation
            of the face that it leaves through (see `SIDES`). Light that meets no surface is not
            included.
    """

    power: NDArray[np.float64]
    rest: NDArray[np.float64]
    exits: NDArray[np.float64]


@dataclass
class _Sums:
    """Device arrays of `LedgerSums` in double precision, and the number of surfaces and rows."""

    power: mi.Float64
    rest: mi.Float64
    exits: mi.Float64
    surfaces: int
    rows: int

    def record(
        self, line: mi.UInt32, surface: mi.UInt32, fate: mi.UInt32, what: mi.Color3f, where: mi.Bool
    ) -> None:
        """Add power (mW per channel) to rows where a mask says so, also in symbolic loops."""
        row = (line * self.rows + surface) * FATES + fate
        for k in range(3):
            dr.scatter_add(self.power, mi.Float64(what[k]), row * 3 + k, where)


def _side_of(normal: mi.Vector3f) -> mi.UInt32:
    """Return the index in `SIDES` of the direction nearest to each unit normal."""
    far = dr.abs(normal)
    axis = dr.select(far.x >= dr.maximum(far.y, far.z), mi.UInt32(0), 1)
    axis = dr.select(far.z > dr.maximum(far.x, far.y), 2, axis)
    along = dr.select(axis == 0, normal.x, dr.select(axis == 1, normal.y, normal.z))
    return axis * 2 + dr.select(along < 0, mi.UInt32(1), 0)


def _is_interface(step: Interaction) -> mi.Bool:
    """Return whether light meets a surface from which its medium is known."""
    return step.hit.valid & step.goes_on & ~step.scattered


def medium_before(
    step: Interaction, bound: mi.UInt32, side: mi.UInt32
) -> tuple[mi.UInt32, mi.UInt32]:
    """Return the medium through which light has come to a surface.

    Args:
        bound, side: the interface that bounds the medium so far, and the medium's side of it, as a
            `Fate`.

    Returns:
        The new ``bound`` and ``side``; they refer to the surface itself where it is an interface.
    """
    near_side = dr.select(step.side > 0, mi.UInt32(int(Fate.BEFORE)), int(Fate.BEHIND))
    interface = _is_interface(step)
    return dr.select(interface, step.hit.surface, bound), dr.select(interface, near_side, side)


def medium_after(step: Interaction, side: mi.UInt32) -> mi.UInt32:
    """Return the side of the interface on which light continues, as a `Fate`."""
    ahead = dr.dot(step.lobe.direction, step.hit.normal) > 0
    far_side = dr.select(ahead, mi.UInt32(int(Fate.BEFORE)), int(Fate.BEHIND))
    return dr.select(_is_interface(step), far_side, side)


@dr.syntax
def _follow(
    scene: RayScene,
    ray: Ray,
    power: mi.Color3f,
    line: mi.UInt32,
    number: mi.UInt32,
    medium: mi.UInt32,
    sums: _Sums,
    seen: TargetCells,
    seed: mi.UInt32,
) -> None:
    """Follow photons to their ends, and record their losses and what remains."""
    rng = hashed_generator(number, seed)
    # The last surface of each photon and its normal on the side on which the photon continued, and
    # the power (mW) of those that left the sensor.
    last = mi.UInt32(sums.surfaces)
    outward = mi.Vector3f(0, 0, 1)
    gone = mi.Color3f(0)
    # The interface that bounds the medium, and the medium's side of it; at first, the light's row.
    bound = sums.surfaces + medium
    side = mi.UInt32(int(Fate.BEFORE))
    least = LEAST_SHARE * dr.max(power)
    while ray.active:
        sample = LobeSample.drawn(rng)
        step = interact(scene, ray, RayKind.PHOTON, sample)
        hit = step.hit
        if dr.hint(scene.absorbing, mode="scalar"):
            bound, side = medium_before(step, bound, side)
            sums.record(line, bound, side, power * (1 - step.transmittance), hit.valid)
            power *= step.transmittance
            side = medium_after(step, side)
        escaped = ray.active & ~hit.valid
        gone = dr.select(escaped, power, gone)
        kept = dr.select(step.goes_on, power * step.lobe.weight, 0)
        kept = dr.select(step.opaque & (dr.max(kept) < least), 0, kept)
        near = seen.contain(hit.point, step.sensed)
        fate = dr.select(near, mi.UInt32(int(Fate.SEEN)), int(Fate.ABSORBED))
        sums.record(line, hit.surface, fate, power - kept, hit.valid)
        power = dr.select(escaped, 0, kept)
        last = dr.select(step.goes_on, hit.surface, last)
        ahead = dr.sign(dr.dot(step.lobe.direction, hit.normal))
        outward = dr.select(step.goes_on, hit.normal * ahead, outward)
        ray = step.ray
        ray.active &= dr.max(power) > 0
    sums.record(line, last, mi.UInt32(int(Fate.ESCAPED)), gone, mi.Bool(True))
    through = (line * sums.surfaces + last) * len(SIDES) + _side_of(outward)
    for k in range(3):
        dr.scatter_add(sums.exits, mi.Float64(gone[k]), through * 3 + k, last < sums.surfaces)
        dr.scatter_add(sums.rest, mi.Float64(power[k]), line * 3 + k)


@reraise_interrupts
def trace_ledger(
    scene: RayScene,
    table: EmitterTable,
    surfaces: int,
    seen: TargetCells,
    photons: int,
    seed: int = 0,
) -> LedgerSums:
    """Trace photons from all lights, and record where their light ends.

    Args:
        table: the lights; each emits 1 mW in each channel.
        surfaces: the number of surfaces in the scene's table.
        seen: the cells of the sensing surface, with flags for those that the camera sees.
        photons: approximate number of photons of all lights together.
    """
    per_light = max(BATCHES, photons // table.count // BATCHES * BATCHES)
    lines = BATCHES * table.groups
    sums = _Sums(
        dr.zeros(mi.Float64, lines * (surfaces + table.media) * FATES * 3),
        dr.zeros(mi.Float64, lines * 3),
        dr.zeros(mi.Float64, lines * surfaces * len(SIDES) * 3),
        surfaces,
        surfaces + table.media,
    )
    guide = uniform_guide(table.count)
    at_once = max(BATCHES, PASS_PHOTONS // table.count // BATCHES * BATCHES)
    for first in range(0, per_light, at_once):
        count = min(at_once, per_light - first)
        emission = Emission(table, guide, count, seed_of(seed, 5), first=first)
        flight, _ = launch(scene, emission)
        group = flight.group & GROUP_MASK
        place = flight.number // table.count + first
        # Runs of photons share a batch: their bookings are then summed before they are added.
        batch = place // dr.opaque(mi.UInt32, per_light // BATCHES)
        line = batch * table.groups + group
        power = flight.throughput * (count * BATCHES / per_light)
        stream = dr.opaque(mi.UInt32, seed_of(seed, 6, first))
        _follow(scene, flight.ray, power, line, flight.number, flight.medium, sums, seen, stream)
        dr.eval(sums.power, sums.rest, sums.exits)

    def by_surface(values: mi.Float64, rows: int) -> NDArray[np.float64]:
        each = np.asarray(values, dtype=np.float64)
        return np.moveaxis(each.reshape(BATCHES, table.groups, rows, -1, 3), 4, 2)

    return LedgerSums(
        by_surface(sums.power, sums.rows),
        np.asarray(sums.rest, dtype=np.float64).reshape(BATCHES, table.groups, 3),
        by_surface(sums.exits, surfaces),
    )
