"""Directions drawn from the beams of the radiance cache that narrow lobes reflect towards the eye.

A ray that is drawn from a narrow lobe alone rarely meets a lamp that lies at the side of the lobe.
The cache knows where light comes from, so that a part of the rays is drawn from its beams (path
guiding). The density of a direction is that of both ways to draw it, which leaves the mean
unchanged (the balance heuristic of Veach and Guibas 1995).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import GOLDEN_BITS, next_random, unit_float
from optisense.optics.radiance_cache.angular_variance import (
    AngularVariance,
    angular_variance,
    broadened_coating,
)
from optisense.optics.radiance_cache.beam_sums import beam_at
from optisense.optics.radiance_cache.beams import Beams
from optisense.optics.radiance_cache.shading_points import ShadingPoints
from optisense.optics.scene.coating_bsdf import (
    coating_density,
    grey,
    half_vector_cosine,
    peak_share,
)

SLOTS = 8
"""Number of beams that are drawn for each point. A beam of an eighth of the light that the point
reflects is always among them."""
ELLIPSE_RADIUS = 2.5
"""Radius, in standard deviations, of the ellipse of directions that are drawn from a beam. That of
an evenly lit ellipse is 2, and the corners of a square lamp lie at 2.45."""
MIN_VARIANCE = 0.02**2
"""Lower bound on the variances of a beam (radians squared), as one of few photons may have none:
that of a lamp of 1 mm at a distance of 15 mm."""
MIN_WEIGHT = 1e-20
"""Lower bound on the light that a point reflects, 1/(mm^2 sr) for lights of 1 mW, for beams to be
drawn: far below any light, it only avoids a division by zero."""


@dataclass
class LobeGuide:
    """Beams drawn for each of n points in proportion to the light that a point's lobe reflects.

    Attributes:
        beams: the beams of the cache.
        axis: unit vector, the axis of the direction bins.
        slots: (SLOTS n,) numbers of the beams drawn for each point.
        found: (n,) mask of the points that have any.
    """

    beams: Beams
    axis: mi.Vector3f
    slots: mi.UInt32
    found: mi.Bool

    @classmethod
    def of(cls, beams: Beams, groups: int, at: ShadingPoints, axis: mi.Vector3f) -> LobeGuide:
        """Draw beams for points.

        Args:
            groups: number of light groups.
            axis: unit vector, the axis of the direction bins.
        """
        lobes = replace(at, coating=replace(at.coating, specularity=mi.Float(1)))
        total = _total(beams, groups, lobes)
        found = at.active & (total > MIN_WEIGHT)
        lane = dr.arange(mi.UInt32, dr.width(total))
        first = dr.gather(mi.UInt32, beams.starts, at.cell * groups, found)
        dr.eval(total, found, first)
        # Rounding may leave the last slot of a point empty, which then holds its first beam.
        slots = dr.gather(mi.UInt32, first, dr.arange(mi.UInt32, SLOTS * dr.width(total)) // SLOTS)
        dr.eval(slots)
        _choose(beams, groups, lobes, SLOTS / total, found, lane, slots)
        dr.eval(slots)
        return cls(beams, axis, slots, found)

    def sample(self, point: mi.UInt32, pick: mi.Float, place: mi.Point2f) -> mi.Vector3f:
        """Return a unit direction (3, n) drawn from the beams of points.

        Args:
            point: numbers (n,) of the points.
            pick: random number (n,) in [0, 1) that chooses the beam.
            place: random point of the unit square that chooses the direction.
        """
        slot = dr.minimum(mi.UInt32(pick * SLOTS), SLOTS - 1)
        beam = self._beam(point, slot)
        radius = ELLIPSE_RADIUS * dr.sqrt(place.x)
        sine, cosine = dr.sincos(place.y * dr.two_pi)
        aside = beam.along * (cosine * dr.sqrt(beam.variance_along))
        aside += beam.up * (sine * dr.sqrt(beam.variance_up))
        return dr.normalize(beam.towards + radius * aside)

    @dr.syntax
    def density(self, point: mi.UInt32, direction: mi.Vector3f) -> mi.Float:
        """Return the density (n,), 1/sr, of the directions that `sample` draws.

        Args:
            point: numbers (n,) of the points.
            direction: unit directions.
        """
        total = mi.Float(0)
        slot = mi.UInt32(0)
        while dr.hint(slot < SLOTS, exclude=[self, point, direction]):
            beam = self._beam(point, slot)
            # The ellipse lies in the plane at distance 1, of which a solid angle sees its area
            # over the cube of the cosine.
            cosine = dr.dot(direction, beam.towards)
            x, y = dr.dot(direction, beam.along), dr.dot(direction, beam.up)
            square = x * x / beam.variance_along + y * y / beam.variance_up
            inside = (cosine > 0) & (square < dr.square(ELLIPSE_RADIUS * cosine))
            area = dr.pi * ELLIPSE_RADIUS**2 * dr.sqrt(beam.variance_along * beam.variance_up)
            total += dr.select(inside, dr.rcp(area * cosine * cosine * cosine), 0)
            slot += 1
        return total * (1 / SLOTS)

    def _beam(self, point: mi.UInt32, slot: mi.UInt32) -> AngularVariance:
        number = dr.gather(mi.UInt32, self.slots, point * SLOTS + slot)
        towards, cosine, _, tag = beam_at(self.beams, number)
        height = dr.gather(mi.Float, self.beams.heights, number)
        beam = angular_variance(self.axis, towards, self.beams.widened(cosine, tag), height)
        return replace(
            beam,
            variance_along=dr.maximum(beam.variance_along, MIN_VARIANCE),
            variance_up=dr.maximum(beam.variance_up, MIN_VARIANCE),
        )


@dr.syntax
def _total(beams: Beams, groups: int, at: ShadingPoints) -> mi.Float:
    """Return the sum (n,) of the weights of all beams of points."""
    total = mi.Float(0)
    j = dr.gather(mi.UInt32, beams.starts, at.cell * groups, at.active)
    end = dr.gather(mi.UInt32, beams.starts, (at.cell + 1) * groups, at.active)
    while dr.hint(j < end, exclude=[beams, groups, at, end]):
        total += _weight(beams, j, at)
        j += 1
    return total


@dr.syntax
def _choose(
    beams: Beams,
    groups: int,
    at: ShadingPoints,
    per_weight: mi.Float,
    found: mi.Bool,
    lane: mi.UInt32,
    slots: mi.UInt32,
) -> None:
    """Draw beams, evenly spaced in the running sum of their weights (systematic sampling).

    Args:
        per_weight: number (n,) of slots for a weight of 1.
        found: mask of the points with beams, whose numbers are ``lane``.
        slots: the numbers of the beams; they are set.
    """
    running = unit_float(next_random(at.seen.random ^ GOLDEN_BITS))
    filled = mi.UInt32(0)
    j = dr.gather(mi.UInt32, beams.starts, at.cell * groups, found)
    end = dr.gather(mi.UInt32, beams.starts, (at.cell + 1) * groups, found)
    while dr.hint(j < end, exclude=[beams, groups, at, end, per_weight, lane, slots]):
        running += _weight(beams, j, at) * per_weight
        reached = dr.minimum(mi.UInt32(running), SLOTS)
        while dr.hint(filled < reached, exclude=[lane, slots, j, reached]):
            dr.scatter(slots, j, lane * SLOTS + filled)
            filled += 1
        j += 1


def _weight(beams: Beams, number: mi.UInt32, at: ShadingPoints) -> mi.Float:
    """Return about how much light (n,) of beams lobes' peaks reflect, Fresnel reflectance left out.

    A beam counts if the light at one standard deviation from its mean direction is in the peak.
    """
    towards, cosine, flux, tag = beam_at(beams, number)
    cosine = beams.widened(cosine, tag)
    seen = at.seen
    cos_m = half_vector_cosine(seen.normal, towards, seen.towards_eye)
    # The half vector turns by half as much as the light.
    width = dr.safe_sqrt(0.5 * (1 - cosine))
    peak = peak_share(dr.cos(dr.maximum(dr.safe_acos(cos_m) - width, 0)))
    lobe = broadened_coating(at.coating, cosine)
    density = coating_density(lobe, seen.normal, towards, seen.towards_eye)
    return dr.maximum(grey(flux) * density * peak, 0)
