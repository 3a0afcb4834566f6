"""The paths of single photons from the lights to their ends, for drawing.

Photons are traced like those of the light ledger, but each carries all its power to a single end.
The share that a photon of the ledger loses at a place is the probability that one of these photons
ends there.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import floats
from optisense.optics.backend.interrupts import reraise_interrupts
from optisense.optics.backend.sequences import seed_of
from optisense.optics.scene.emitters import EmitterTable
from optisense.optics.scene.ray_scene import Ray, RayScene
from optisense.optics.transport.emission_guide import uniform_guide
from optisense.optics.transport.interact import MAX_DEPTH, LobeSample, RayKind, interact
from optisense.optics.transport.light_ledger import Fate, medium_after, medium_before
from optisense.optics.transport.photon_map import GROUP_MASK
from optisense.optics.transport.photons import Emission, TargetCells, hashed_generator, launch

ESCAPE_LENGTH = 4.0
"""Length (mm) of the last segment of a photon that escapes, in a drawing: enough to show its
direction beside a sensor of some 20 mm."""

POINTS = MAX_DEPTH + 2
"""Largest number of points of a path: the light, the surfaces, and the photon's end."""


@dataclass(frozen=True)
class TracedPhotons:
    """The paths of traced photons.

    Attributes:
        points: (photons, `POINTS`, 3) float32, the points of each path, mm.
        counts: (photons,) number of valid points of each path.
        group: (photons,) number of the light group.
        power: (photons,) power of each photon, in arbitrary units.
        surface: (photons,) number of the surface that the end belongs to, as in the ledger's sums.
        fate: (photons,) the `Fate` of each photon.
    """

    points: NDArray[np.float32]
    counts: NDArray[np.int64]
    group: NDArray[np.int64]
    power: NDArray[np.float64]
    surface: NDArray[np.int64]
    fate: NDArray[np.int64]


@dataclass
class _Course:
    """A buffer for `POINTS` points (mm) of each photon's path.

    Attributes:
        surfaces: number of surfaces, without the additional rows of the lights.
    """

    points: mi.Float
    surfaces: int

    def write(self, photon: mi.UInt32, place: mi.UInt32, point: mi.Point3f, where: mi.Bool) -> None:
        """Store a point of a photon's path; symbolic loops may call it."""
        row = (photon * POINTS + place) * 3
        for k in range(3):
            dr.scatter(self.points, point[k], row + k, where)


@dr.syntax
def _follow(
    scene: RayScene,
    ray: Ray,
    power: mi.Color3f,
    weights: mi.Color3f,
    photon: mi.UInt32,
    medium: mi.UInt32,
    course: _Course,
    seen: TargetCells,
    seed: mi.UInt32,
) -> tuple[mi.UInt32, mi.UInt32, mi.UInt32]:
    """Follow photons; return numbers of points, and the surfaces and fates of the ends."""
    rng = hashed_generator(photon, seed)
    course.write(photon, mi.UInt32(0), ray.origin, mi.Bool(ray.active))
    count = mi.UInt32(1)
    # Photons whose paths are cut off keep these values.
    ending = mi.UInt32(course.surfaces)
    fate = mi.UInt32(int(Fate.ABSORBED))
    last = mi.UInt32(course.surfaces)
    bound = course.surfaces + medium
    side = mi.UInt32(int(Fate.BEFORE))
    while ray.active:
        sample = LobeSample.drawn(rng)
        step = interact(scene, ray, RayKind.PHOTON, sample)
        hit = step.hit
        end = dr.select(hit.valid, hit.point, ray.origin + ESCAPE_LENGTH * ray.direction)
        stopped = mi.Bool(False)
        if dr.hint(scene.absorbing, mode="scalar"):
            bound, side = medium_before(step, bound, side)
            left = _part(power * step.transmittance, power, weights)
            chance = rng.next_float32()
            stopped = hit.valid & (chance >= left)
            # Beer-Lambert: after the part ln(chance) / ln(left) of the way, `chance` is left.
            depth = dr.log(dr.maximum(chance, 1e-6)) / dr.log(dr.clip(left, 1e-6, 1 - 1e-6))
            inside = ray.origin + dr.clip(depth, 0, 1) * (hit.point - ray.origin)
            end = dr.select(stopped, inside, end)
            ending = dr.select(stopped, bound, ending)
            fate = dr.select(stopped, side, fate)
            power *= step.transmittance / dr.maximum(left, 1e-6)
            side = medium_after(step, side)
        kept = dr.select(step.goes_on, power * step.lobe.weight, 0)
        goes = _part(kept, power, weights)
        absorbed = hit.valid & ~stopped & (rng.next_float32() >= goes)
        near = seen.contain(hit.point, step.sensed)
        by_surface = dr.select(near, mi.UInt32(int(Fate.SEEN)), int(Fate.ABSORBED))
        ending = dr.select(absorbed, hit.surface, ending)
        fate = dr.select(absorbed, by_surface, fate)
        ending = dr.select(hit.valid, ending, last)
        fate = dr.select(hit.valid, fate, int(Fate.ESCAPED))
        power = kept / dr.maximum(goes, 1e-6)
        last = dr.select(step.goes_on, hit.surface, last)
        course.write(photon, count, end, mi.Bool(True))
        count += 1
        ray = step.ray
        ray.active &= ~(stopped | absorbed) & (ray.depth < MAX_DEPTH)
    return count, ending, fate


def _part(some: mi.Color3f, whole: mi.Color3f, weights: mi.Color3f) -> mi.Float:
    """Return the share of ``some`` power in the ``whole``, over all channels; at most 1."""
    return dr.minimum(dr.dot(some, weights) / dr.maximum(dr.dot(whole, weights), 1e-30), 1)


@reraise_interrupts
def trace_photon_paths(
    scene: RayScene,
    table: EmitterTable,
    flux: NDArray[np.float64],
    seen: TargetCells,
    per_light: int,
    seed: int = 0,
) -> TracedPhotons:
    """Trace single photons from all lights, and record their paths.

    Args:
        flux: (groups, 3) power (mW) in each channel, the weights of the channels in the
            probabilities of ends.
        seen: the cells of the sensing surface, with flags for those that the camera sees.
        per_light: number of photons of each light.
    """
    emission = Emission(table, uniform_guide(table.count), per_light, seed_of(seed, 7))
    flight, _ = launch(scene, emission)
    count = per_light * table.count
    group = flight.group & GROUP_MASK
    weights = dr.gather(mi.Color3f, floats(flux), group)
    power = dr.dot(flight.throughput, weights)
    course = _Course(dr.zeros(mi.Float, count * POINTS * 3), len(scene.pieces))
    points, surface, fate = _follow(
        scene,
        flight.ray,
        mi.Color3f(flight.throughput),
        weights,
        dr.arange(mi.UInt32, count),
        flight.medium,
        course,
        seen,
        dr.opaque(mi.UInt32, seed_of(seed, 8)),
    )
    dr.eval(course.points, points, surface, fate, group, power)
    return TracedPhotons(
        points=np.asarray(course.points, dtype=np.float32).reshape(count, POINTS, 3),
        counts=np.asarray(points, dtype=np.int64),
        group=np.asarray(group, dtype=np.int64),
        power=np.asarray(power, dtype=np.float64),
        surface=np.asarray(surface, dtype=np.int64),
        fate=np.asarray(fate, dtype=np.int64),
    )
