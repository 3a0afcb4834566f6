"""Photons that land at one place of the sensing surface: their paths and directions.

Photons are traced like those of a picture. The power that lands within a disc is summed by the kind
of its path and by the direction of incidence.
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
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.transport.emission_guide import uniform_guide
from optisense.optics.transport.interact import MAX_DEPTH, LobeSample, RayKind, interact
from optisense.optics.transport.light_ledger import BATCHES
from optisense.optics.transport.photon_map import GROUP_MASK
from optisense.optics.transport.photons import (
    Emission,
    Flight,
    TargetCells,
    hashed_generator,
    launch,
    survival_probability,
)

TILT_BINS, TURN_BINS = 9, 12
"""Numbers of bins of the angle of incidence (10 degrees each) and of azimuth (30 degrees each), as
fine as a chart of directions shows them."""


class LightWay(IntEnum):
    """The interactions of light on its path to a place, of which the last in this list counts."""

    REFRACTED = 0  # nothing but interfaces that let it pass
    REFLECTED = 1  # an interface that reflected it, totally or in part
    MIRRORED = 2  # a mirror
    SCATTERED_BY_PARTS = 3  # a housing, a paint
    SCATTERED_BY_COATING = 4  # the coating at another place


WAYS = len(LightWay)


@dataclass(frozen=True)
class Disc:
    """A disc of the skin on which photons are counted.

    Attributes:
        middle: (3,) centre on the sensing surface, mm.
        inward: (3,) unit normal there, into the gel.
        right, up: (3,) unit vectors in the disc's plane; azimuth is counted anticlockwise from
            ``right``.
        radius: radius, mm.
    """

    middle: NDArray[np.float64]
    inward: NDArray[np.float64]
    right: NDArray[np.float64]
    up: NDArray[np.float64]
    radius: float


@dataclass
class _Tally:
    """Power that lands at a place.

    Attributes:
        middle, inward, right, up, radius: as in `Disc`.
        sums: power in the disc, (lines, ways, tilts, turns, 3), mW.
        moments: sums of that power times the angle to the normal (degrees), and times the
            components along ``right`` and ``up`` of the unit direction that it comes from,
            (lines, 3, 3).
        seen: the cells of the sensing surface, with flags for those that the camera sees.
        view: power in the camera's view, (lines, 3), mW.
    """

    middle: mi.Vector3f
    inward: mi.Vector3f
    right: mi.Vector3f
    up: mi.Vector3f
    radius: mi.Float
    sums: mi.Float64
    moments: mi.Float64
    seen: TargetCells
    view: mi.Float64


@dr.syntax
def _count(
    scene: RayScene, tally: _Tally, flight: Flight, line: mi.UInt32, seed: mi.UInt32
) -> None:
    """Follow photons to their ends and add their power to the lines of a tally."""
    middle, seen = tally.middle, tally.seen
    ray, power = flight.ray, flight.throughput
    rng = hashed_generator(flight.number, seed)
    way = mi.UInt32(0)
    while ray.active:
        sample = LobeSample.drawn(rng)
        step = interact(scene, ray, RayKind.PHOTON, sample)
        power *= step.transmittance
        offset = mi.Vector3f(step.hit.point) - middle
        lands = step.sensed & (dr.squared_norm(offset) < tally.radius * tally.radius)
        near = seen.contain(step.hit.point, step.sensed)
        for k in range(3):
            dr.scatter_add(tally.view, mi.Float64(power[k]), line * 3 + k, near)
        if lands:
            towards = -ray.direction
            cosine = dr.clip(dr.dot(towards, tally.inward), 0, 1)
            incidence = dr.acos(cosine)
            x, y = dr.dot(towards, tally.right), dr.dot(towards, tally.up)
            tilt = mi.UInt32(dr.minimum(incidence * (2 / dr.pi) * TILT_BINS, TILT_BINS - 0.5))
            angle = dr.atan2(y, x) * (1 / dr.two_pi)
            angle -= dr.floor(angle)
            turn = mi.UInt32(dr.minimum(angle * TURN_BINS, TURN_BINS - 0.5))
            row = ((line * WAYS + way) * TILT_BINS + tilt) * TURN_BINS + turn
            for k in range(3):
                dr.scatter_add(tally.sums, mi.Float64(power[k]), row * 3 + k)
                for number, value in enumerate((dr.rad2deg(incidence), x, y)):
                    moment = (line * 3 + number) * 3 + k
                    dr.scatter_add(tally.moments, mi.Float64(power[k] * value), moment)
        mirrored = step.scattered & ~step.opaque
        met = dr.select(step.turned, mi.UInt32(int(LightWay.REFLECTED)), 0)
        met = dr.select(mirrored, mi.UInt32(int(LightWay.MIRRORED)), met)
        met = dr.select(step.opaque, mi.UInt32(int(LightWay.SCATTERED_BY_PARTS)), met)
        met = dr.select(step.sensed, mi.UInt32(int(LightWay.SCATTERED_BY_COATING)), met)
        way = dr.maximum(way, met)
        power *= step.lobe.weight
        ray = step.ray
        if step.scattered | (ray.depth >= MAX_DEPTH):
            survival = survival_probability(step)
            ray.active &= rng.next_float32() < survival
            power /= dr.maximum(survival, 1e-6)


@reraise_interrupts
def trace_to_place(
    scene: RayScene,
    table: EmitterTable,
    disc: Disc,
    seen: TargetCells,
    photons: int,
    seed: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Sum the power of the photons that land at a place.

    Args:
        scene: the sensor without contacts.
        seen: the cells of the sensing surface, with flags for those that the camera sees.
        photons: number of photons of all lights together.

    Returns:
        The power (mW) that lands in the disc, (batches, groups, ways, tilts, turns, 3); sums of
        that power times the angle to the normal (degrees), and times the components along ``right``
        and ``up`` of the unit direction that it comes from, (groups, 3, 3); and the power (mW) in
        the camera's view, (batches, groups, 3). All are for lights of 1 mW in each channel.
    """
    groups = table.groups

    def vector(values: NDArray[np.float64]) -> mi.Vector3f:
        return mi.Vector3f(*(dr.opaque(mi.Float, float(part)) for part in values))

    tally = _Tally(
        middle=vector(disc.middle),
        inward=vector(disc.inward),
        right=vector(disc.right),
        up=vector(disc.up),
        radius=dr.opaque(mi.Float, disc.radius),
        sums=dr.zeros(mi.Float64, BATCHES * groups * WAYS * TILT_BINS * TURN_BINS * 3),
        moments=dr.zeros(mi.Float64, BATCHES * groups * 3 * 3),
        seen=seen,
        view=dr.zeros(mi.Float64, BATCHES * groups * 3),
    )
    per_light = max(1, photons // (BATCHES * table.count))
    guide = uniform_guide(table.count)
    for batch in range(BATCHES):
        emission = Emission(table, guide, per_light, seed_of(seed, 6, batch))
        flight, _ = launch(scene, emission)
        line = (flight.group & GROUP_MASK) + dr.opaque(mi.UInt32, batch * groups)
        _count(scene, tally, flight, line, dr.opaque(mi.UInt32, seed_of(seed, 7, batch)))
        dr.eval(tally.sums, tally.moments, tally.view)
    found = np.asarray(tally.sums, dtype=np.float64)
    return (
        found.reshape(BATCHES, groups, WAYS, TILT_BINS, TURN_BINS, 3),
        np.asarray(tally.moments, dtype=np.float64).reshape(BATCHES, groups, 3, 3).mean(axis=0),
        np.asarray(tally.view, dtype=np.float64).reshape(BATCHES, groups, 3),
    )
