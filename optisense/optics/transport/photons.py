"""The photon pass: photons from the emitters are traced and recorded where they land.

Photons are refracted, reflected and scattered, and recorded at every landing on an opaque surface.
They carry all light, direct light included. There is no next-event estimation, so that no light is
counted twice.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.backend.arrays import indices
from optisense.optics.backend.sequences import seed_of, sequence_4d, unit_float
from optisense.optics.scene.emitters import EmitterTable, emit
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at
from optisense.optics.transport.emission_guide import GUIDE_CELLS, EmissionGuide, warp
from optisense.optics.transport.interact import (
    MAX_DEPTH,
    Interaction,
    LobeSample,
    RayKind,
    interact,
)
from optisense.optics.transport.photon_map import (
    HALF_SHIFT,
    SURFACE_SHIFT,
    Landing,
    PhotonMap,
    Records,
)
from optisense.optics.transport.volume_flux import SAMPLES_PER_SEGMENT, sample_segment

LANDINGS_PER_PHOTON = 1.5
"""Number of landings per photon for which memory is reserved at first. GelSight Mini, DIGIT,
GelSight Svelte and GelSight360 have 0.3 to 1.3; a pass with more landings is traced again with more
memory."""
MAX_SURVIVAL = 0.95
"""Probability with which a photon goes on from an interface after `MAX_DEPTH` surfaces (Russian
roulette). Total reflection would otherwise lead it through a clear part for ever."""


@dataclass(frozen=True)
class Emission:
    """The photons that a pass emits.

    Attributes:
        table: the lights; each emits 1 mW.
        guide: the sampling density of emission.
        per_light: number of photons of each light.
        seed: seed of the pass.
        first: number of photons that each light has already emitted in earlier passes of the same
            seed.
        groups: the light groups that are lit; all if None. The photons of a group do not depend on
            the other groups.
    """

    table: EmitterTable
    guide: EmissionGuide
    per_light: int
    seed: int
    first: int = 0
    groups: Collection[int] | None = None

    @cached_property
    def lights(self) -> mi.UInt32:
        """The numbers (k,) of the lights that are lit."""
        lit = [
            number
            for number, emitter in enumerate(self.table.emitters)
            if self.groups is None or emitter.group in self.groups
        ]
        return indices(np.array(lit))

    @property
    def emitted(self) -> int:
        """Number of photons of all lights, including those that are not lit."""
        return self.per_light * self.table.count


@dataclass
class TargetCells:
    """Surface cells that photons should reach; ``flags`` is 1 in or near the camera's view."""

    cells: SurfaceCells
    flags: mi.UInt32

    def contain(self, points: mi.Point3f, active: mi.Bool) -> mi.Bool:
        """Return a mask (n,) of the active points that lie in flagged cells."""
        cell, found = cell_at(self.cells, points, active)
        return found & (dr.gather(mi.UInt32, self.flags, cell, found) != 0)


@dataclass
class Flight:
    """Photons in flight.

    Attributes:
        ray: their current rays.
        throughput: their power.
        group: their light group and half, as bits.
        number: their index in the pass.
        medium: number of the solid that they start in, plus 1; 0 for air.
    """

    ray: Ray
    throughput: mi.Color3f
    group: mi.UInt32
    number: mi.UInt32
    medium: mi.UInt32


@dataclass
class _Recording:
    """Records of landings, of those that reach a target, and of crossings of a flux layer."""

    landings: Records
    target: TargetCells | None
    flux_cells: SurfaceCells | None
    crossings: Records


def launch(scene: RayScene, emission: Emission) -> tuple[Flight, mi.UInt32]:
    """Emit photons from the lights that are lit.

    If refractive indices differ between channels, each photon carries light of one channel; the
    channels take turns.

    Returns:
        The n photons, and the number (n,) of the guide's cell, over all lights, that each was drawn
        from.
    """
    table, lights = emission.table, emission.lights
    first, per_light, seed = (
        dr.opaque(mi.UInt32, value) for value in (emission.first, emission.per_light, emission.seed)
    )
    photons = emission.per_light * dr.width(lights)
    index = dr.arange(mi.UInt32, photons)
    count = dr.opaque(mi.UInt32, dr.width(lights))
    light = dr.gather(mi.UInt32, lights, index % count)
    place = index // count
    number = first + place
    u0, u1, u2, u3 = sequence_4d(number, light, seed)
    angle, weight, cell = warp(emission.guide, light, mi.Point2f(u0, u1))
    origin, direction, group, face_cell = emit(table, light, angle, mi.Point2f(u2, u3))
    ray = Ray(origin, direction, dr.full(mi.Bool, True, photons))
    power = mi.Color3f(weight / mi.Float(per_light))
    if scene.absorbing:
        ray.absorption = dr.gather(mi.Color3f, table.absorption, face_cell)
    if scene.dispersive:
        ray.channel = number % 3
        power = mi.Color3f(*(dr.select(ray.channel == k, 3 * power[k], 0) for k in range(3)))
    flight = Flight(
        ray=ray,
        throughput=power,
        group=group | ((number & 1) << HALF_SHIFT),
        number=place * table.count + light,
        medium=dr.gather(mi.UInt32, table.solids, face_cell),
    )
    return flight, light * (GUIDE_CELLS * GUIDE_CELLS) + cell


@dr.syntax
def _fly(scene: RayScene, flight: Flight, recording: _Recording, seed: mi.UInt64) -> mi.Bool:
    """Follow photons to their ends; return the mask (n,) of those that have met the target."""
    ray = flight.ray
    throughput = mi.Color3f(flight.throughput)
    landed = mi.Bool(False)
    scattered = mi.Bool(False)  # by the sensing surface, at the ray's start
    # The stream depends on the photon's number alone. With `size` it would also depend on the lane,
    # and one photon that ended earlier would change the paths of all photons after it. A small
    # change of the design therefore changes few paths.
    rng = mi.PCG32(initstate=seed, initseq=mi.UInt64(flight.number))
    while dr.hint(ray.active, exclude=[scene, flight, seed]):
        sample = LobeSample.drawn(rng)
        step = interact(scene, ray, RayKind.PHOTON, sample)
        hit = step.hit
        if dr.hint(recording.flux_cells is not None, mode="scalar"):
            assert recording.flux_cells is not None
            # Light that leaves the sensing surface and meets no other is handled by
            # interreflection.py. Light from walls, also from their foot, is recorded.
            passes = ray.active & (step.opaque | ~scattered)
            bits = mi.UInt32(seed) ^ (flight.number * 747796405) ^ (ray.depth * 0x9E3779B9)
            # The bits are hashed, as neighbouring photons have neighbouring bits.
            chance = unit_float(mi.sample_tea_32(bits, mi.UInt32(0))[0])
            piece = mi.UInt32(0)
            while dr.hint(
                passes & (piece < SAMPLES_PER_SEGMENT),
                exclude=[scene, ray, flight, step, hit, chance, scattered, passes],
            ):
                spot, share, crosses = sample_segment(
                    recording.flux_cells, ray, hit, chance, piece, step.opaque, scattered
                )
                if dr.hint(
                    crosses,
                    exclude=[scene, ray, flight, step, hit, spot, share, throughput, crosses],
                ):
                    power = mi.Color3f(throughput)
                    if dr.hint(scene.absorbing, mode="scalar"):
                        part = dr.norm(spot - ray.origin) / hit.distance
                        power *= dr.power(step.transmittance, part)
                    crossing = Landing(spot, ray.direction, share, power, flight.group)
                    recording.crossings.write(crossing, crosses)
                piece += 1
            scattered = step.sensed
        throughput *= step.transmittance
        if dr.hint(step.opaque, exclude=[scene, ray, flight, step, hit, throughput]):
            cosine = dr.abs(dr.dot(ray.direction, hit.normal))
            bits = flight.group | (hit.surface << SURFACE_SHIFT)
            landing = Landing(hit.point, ray.direction, cosine, throughput, bits)
            recording.landings.write(landing, step.opaque)
        if dr.hint(recording.target is not None, mode="scalar"):
            target = recording.target
            assert target is not None
            landed |= target.contain(hit.point, step.opaque)
        throughput *= step.lobe.weight
        ray = step.ray
        far = ray.depth >= MAX_DEPTH
        if dr.hint(step.scattered | far, exclude=[step, far]):
            survival = survival_probability(step)
            ray.active &= rng.next_float32() < survival
            throughput /= dr.maximum(survival, 1e-6)
    return landed


def hashed_generator(number: mi.UInt32, seed: mi.UInt32) -> mi.PCG32:
    """Return a random generator for each photon, by its number.

    The number is hashed, as streams of neighbouring numbers resemble one another.
    """
    rng = mi.PCG32()
    first, second = mi.sample_tea_32(number, seed)
    rng.seed(mi.UInt64(first), mi.UInt64(second))
    return rng


def survival_probability(step: Interaction) -> mi.Float:
    """Return the probability (n,) with which photons go on from a surface (Russian roulette).

    Where light is scattered, it is the reflectance in the brightest channel, so that the power of
    photons remains about the same: with a lower one, a few photons between white walls would gain
    much power.
    """
    scattered = dr.minimum(dr.max(step.lobe.weight), 1.0)
    return dr.select(step.scattered, scattered, MAX_SURVIVAL)


def trace_pilot(
    scene: RayScene, emission: Emission, target: TargetCells, coloured: bool
) -> tuple[mi.UInt32, PhotonMap]:
    """Trace the pilot pass.

    Returns:
        The guide's cell that each photon was drawn from, or a number of all one bits if it missed
        the target; and the photon map.
    """
    return _traced(scene, emission, target, None, coloured)


def trace_photons(
    scene: RayScene, emission: Emission, *, coloured: bool, flux_cells: SurfaceCells | None = None
) -> PhotonMap:
    """Emit photons and record where they land.

    Args:
        flux_cells: cells of the flux layer whose crossings are recorded as well; None for none.
    """
    return _traced(scene, emission, None, flux_cells, coloured)[1]


def _traced(
    scene: RayScene,
    emission: Emission,
    target: TargetCells | None,
    flux_cells: SurfaceCells | None,
    coloured: bool,
) -> tuple[mi.UInt32, PhotonMap]:
    """Trace a pass and collect its landings; a pass whose landings do not fit is repeated."""
    photons = emission.per_light * dr.width(emission.lights)
    room = [int(photons * LANDINGS_PER_PHOTON) + 1024, 0]
    if flux_cells is not None:
        room[1] = photons * SAMPLES_PER_SEGMENT + 1024
    while True:
        landings, crossings = (Records.of(each, coloured) for each in room)
        recording = _Recording(landings, target, flux_cells, crossings)
        flight, cell = launch(scene, emission)
        seed = dr.opaque(mi.UInt64, seed_of(emission.seed, emission.first))
        landed = _fly(scene, flight, recording, seed)
        cells = dr.select(landed, cell, mi.UInt32(0xFFFFFFFF))
        dr.eval(cells, landings, crossings)
        found = [int(records.counter[0]) for records in (landings, crossings)]
        if all(count <= each for count, each in zip(found, room, strict=True)):
            break
        room = [max(int(1.2 * count), 1024) for count in found]
    of = emission.emitted, 1 / emission.per_light
    passing = None if flux_cells is None else crossings.photon_map(*of)
    return cells, landings.photon_map(*of, passing)
