"""The light ledger: where the light of each group goes.

Photons are followed as in the photon pass, and whatever one loses on its way is booked: what a
medium absorbs, what a surface absorbs, what leaves the sensor. The bookings of a photon add up to
its power, so that the ledger closes whatever its noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import indices
from optisense.optics.backend.interrupts import lets_ctrl_c_through
from optisense.optics.backend.sequences import seed_of
from optisense.optics.scene.emitters import EmitterTable
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.scene.surface_cells import cell_at
from optisense.optics.transport.emission_guide import uniform_guide
from optisense.optics.transport.interact import Interaction, LobeSample, Path, interact
from optisense.optics.transport.photon_map import GROUP_MASK
from optisense.optics.transport.photons import Emission, TargetCells, launch

PASS_PHOTONS = 1_000_000
"""Number of photons of one pass, between which progress is told and Ctrl-C obeyed."""

BATCHES = 16
"""Independent parts of the photons, whose spread gives the noise of the sums."""


class Fate(IntEnum):
    """What becomes of light, in the order of a surface's rows in the ledger."""

    ABSORBED = 0  # by the surface, where the camera does not look
    SEEN = 1  # by the surface, where the camera looks
    BEFORE = 2  # by the medium in front of the surface, on the way from it
    BEHIND = 3  # by the medium behind it
    ESCAPED = 4  # left the sensor after this surface


FATES = len(Fate)


@dataclass(frozen=True)
class Bookings:
    """What the ledger holds.

    Attributes:
        power: (batches, groups, 3, surfaces + 1, fates) mW of lights of 1 mW in each channel. The
            last surface stands for the lights themselves: for what happens before any surface.
        rest: (batches, groups, 3) mW of photons that were given up on their way.
    """

    power: NDArray[np.float64]
    rest: NDArray[np.float64]


@dataclass
class _Sums:
    """Device arrays of `Bookings`, in double precision, and their sizes."""

    power: mi.Float64
    rest: mi.Float64
    surfaces: int

    def book(
        self, line: mi.UInt32, surface: mi.UInt32, fate: mi.UInt32, what: mi.Color3f, where: mi.Bool
    ) -> None:
        """Add power to rows; symbolic loops may call it.

        Args:
            line: the number of batch and group.
            surface: its number.
            fate: of `Fate`.
            what: mW per channel.
            where: which lanes count.
        """
        row = (line * self.surfaces + surface) * FATES + fate
        for k in range(3):
            dr.scatter_add(self.power, mi.Float64(what[k]), row * 3 + k, where)


def _is_interface(step: Interaction) -> mi.Bool:
    """Whether light meets a surface that tells which medium it is in."""
    return step.hit.valid & step.goes_on & ~step.scattered


def medium_before(
    step: Interaction, bound: mi.UInt32, side: mi.UInt32
) -> tuple[mi.UInt32, mi.UInt32]:
    """The medium through which light has come to a surface.

    Args:
        step: what happens at the surface.
        bound, side: the interface that told the medium so far, and the side of it, a `Fate`.

    Returns:
        The same two; the surface's own where it is an interface.
    """
    near_side = dr.select(step.side > 0, mi.UInt32(int(Fate.BEFORE)), int(Fate.BEHIND))
    interface = _is_interface(step)
    return dr.select(interface, step.hit.surface, bound), dr.select(interface, near_side, side)


def medium_after(step: Interaction, side: mi.UInt32) -> mi.UInt32:
    """The side of the interface on which light goes on, a `Fate`."""
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
    sums: _Sums,
    seen: TargetCells,
    seed: mi.UInt32,
) -> mi.Color3f:
    """Follow photons to their ends and book what they lose.

    Returns:
        What is left of those that were given up.
    """
    # Hashed: streams of neighbouring numbers resemble one another, and so would the batches.
    rng = mi.PCG32()
    first, second = mi.sample_tea_32(number, seed)
    rng.seed(mi.UInt64(first), mi.UInt64(second))
    last = mi.UInt32(sums.surfaces - 1)
    # The interface that tells the medium, and the side of it.
    bound = mi.UInt32(sums.surfaces - 1)
    side = mi.UInt32(int(Fate.BEFORE))
    while ray.active:
        sample = LobeSample(rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()))
        step = interact(scene, ray, Path.PHOTON, sample)
        hit = step.hit
        if dr.hint(scene.absorbing, mode="scalar"):
            bound, side = medium_before(step, bound, side)
            sums.book(line, bound, side, power * (1 - step.transmittance), hit.valid)
            power *= step.transmittance
            side = medium_after(step, side)
        escaped = ray.active & ~hit.valid
        sums.book(line, last, mi.UInt32(int(Fate.ESCAPED)), power, escaped)
        kept = dr.select(step.goes_on, power * step.lobe.weight, 0)
        cell, near = cell_at(seen.cells, hit.point, step.sensed)
        near &= dr.gather(mi.UInt32, seen.flags, cell, near) != 0
        fate = dr.select(near, mi.UInt32(int(Fate.SEEN)), int(Fate.ABSORBED))
        sums.book(line, hit.surface, fate, power - kept, hit.valid)
        power = dr.select(escaped, 0, kept)
        last = dr.select(step.goes_on, hit.surface, last)
        ray = step.ray
    return power


@lets_ctrl_c_through
def trace_ledger(
    scene: RayScene,
    table: EmitterTable,
    surfaces: int,
    seen: TargetCells,
    photons: int,
    seed: int = 0,
) -> Bookings:
    """Send photons from all lights, and book where their light goes.

    Args:
        scene: the sensor.
        table: its lights; each emits 1 mW in each channel.
        surfaces: the number of surfaces in the scene's table.
        seen: the cells of the sensing surface, and which of them the camera sees.
        photons: about so many, of all lights together.
        seed: another one gives other photons.
    """
    per_light = max(BATCHES, photons // table.count // BATCHES * BATCHES)
    lines = BATCHES * table.groups
    sums = _Sums(
        dr.zeros(mi.Float64, lines * (surfaces + 1) * FATES * 3),
        dr.zeros(mi.Float64, lines * 3),
        surfaces + 1,
    )
    guide = uniform_guide(table.count)
    at_once = max(BATCHES, PASS_PHOTONS // table.count // BATCHES * BATCHES)
    for first in range(0, per_light, at_once):
        count = min(at_once, per_light - first)
        emission = Emission(table, guide, count, seed_of(seed, 5), first=first)
        flight, _ = launch(scene, emission, indices(np.arange(table.count)))
        group = flight.group & GROUP_MASK
        place = flight.number // table.count + first
        # Runs of photons share a batch: their bookings are then summed before they are added.
        batch = place // dr.opaque(mi.UInt32, per_light // BATCHES)
        line = batch * table.groups + group
        power = flight.throughput * (count * BATCHES / per_light)
        stream = dr.opaque(mi.UInt32, seed_of(seed, 6, first))
        left = _follow(scene, flight.ray, power, line, flight.number, sums, seen, stream)
        for k in range(3):
            dr.scatter_add(sums.rest, mi.Float64(left[k]), line * 3 + k)
        dr.eval(sums.power, sums.rest)
    power = np.asarray(sums.power, dtype=np.float64)
    shape = (BATCHES, table.groups, surfaces + 1, FATES, 3)
    return Bookings(
        np.moveaxis(power.reshape(shape), 4, 2),
        np.asarray(sums.rest, dtype=np.float64).reshape(BATCHES, table.groups, 3),
    )
