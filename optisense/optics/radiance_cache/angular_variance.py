"""The angular variance of a beam about its mean direction, and its use in shading."""

from __future__ import annotations

from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import unit_float
from optisense.optics.scene.coating_bsdf import (
    CoatingBsdf,
    evaluate_coating,
    metal_reflectance,
    metallic_lobe,
)

MAX_SPREAD = 0.1
"""Upper bound on 1 - mean cosine of a beam. It is that of a disc of directions of a radius of 36
degrees; the small angles that are assumed for beams hold only up to it."""
MIN_SQUARED_SINE = 0.1
"""Squared sine of the angle between a beam and the axis of the bins (18 degrees) below which the
second moment along that axis does not determine the beam's variance: the component along the axis
then varies with the cosine, which is flat there."""


@dataclass
class AngularVariance:
    """A beam of light about its mean direction.

    Attributes:
        towards: unit vector towards the light.
        along: unit vector perpendicular to ``towards``, in the direction in which the sectors of
            the bins are numbered.
        up: unit vector perpendicular to ``towards``, on the side of the axis of the bins.
        variance_along: variance of the angle (radians squared) along ``along``.
        variance_up: variance of the angle (radians squared) along ``up``.
    """

    towards: mi.Vector3f
    along: mi.Vector3f
    up: mi.Vector3f
    variance_along: mi.Float
    variance_up: mi.Float


def mean_direction(value: mi.Vector4f) -> tuple[mi.Vector3f, mi.Float]:
    """Return the mean direction (3, n), a unit vector, of a cache entry, and the mean cosine (n,)
    between its light and that direction.

    Args:
        value: the entry's moments, four floats (see `Tables.moments`). An entry and its negative
            give the same result.
    """
    mean = mi.Vector3f(value.x, value.y, value.z)
    length = dr.norm(mean)
    return mean * (dr.sign(value.w) / length), dr.minimum(length / dr.abs(value.w), 1.0)


def angular_variance(
    axis: mi.Vector3f, towards: mi.Vector3f, cosine: mi.Float, height: mi.Float
) -> AngularVariance:
    """Return the beam of a mean cosine (n,) and a second moment (n,).

    For small angles, the sum of both variances is twice the difference of the mean cosine from 1.

    Args:
        axis: unit vector, the axis of the direction bins.
        towards: unit vector, the mean direction towards the light.
        cosine: mean cosine between the light and ``towards``.
        height: mean squared component of the directions along ``axis``.
    """
    slope = dr.dot(axis, towards)
    flat = 1 - slope * slope
    half = dr.minimum(1 - cosine, MAX_SPREAD)
    variance = dr.maximum(height - dr.square(slope * cosine), 0) / dr.maximum(
        flat, MIN_SQUARED_SINE
    )
    variance = dr.select(flat > MIN_SQUARED_SINE, dr.minimum(variance, 2 * half), half)
    along = dr.cross(axis, towards)
    along = dr.select(flat > 1e-6, along * dr.rsqrt(dr.maximum(flat, 1e-6)), mi.Frame3f(towards).s)
    return AngularVariance(towards, along, dr.cross(towards, along), 2 * half - variance, variance)


def two_discs(light: AngularVariance) -> tuple[mi.Vector3f, mi.Vector3f, mi.Float]:
    """Return two discs side by side that together have the variances of an elongated beam.

    Returns:
        The mean directions of the two discs, unit vectors (3, n), and the mean cosine (n,) within
        each disc.
    """
    wide = dr.maximum(light.variance_along, light.variance_up)
    slim = dr.maximum(dr.minimum(light.variance_along, light.variance_up), 0)
    aside = dr.select(light.variance_along > light.variance_up, light.along, light.up)
    aside *= dr.sqrt(dr.maximum(wide - slim, 0))
    return dr.normalize(light.towards + aside), dr.normalize(light.towards - aside), 1 - slim


def squared_radius(cosine: mi.Float) -> mi.Float:
    """Return the squared angular radius R^2 (n,), radians squared, of the uniform disc of a mean
    cosine 1 - R^2 / 4 (n,).
    """
    return 4 * dr.minimum(1 - cosine, MAX_SPREAD)


def sample_direction(light: AngularVariance, state: mi.UInt32) -> mi.Vector3f:
    """Return a unit direction (3, n) drawn uniformly from the ellipse of a beam's variances; the
    random bits ``state`` (n,) choose it.
    """
    radius = 2 * dr.sqrt(unit_float((state ^ 0x9E3779B9) * 69069))
    sin_a, cos_a = dr.sincos(unit_float(state * 277803737) * dr.two_pi)
    aside = light.along * (cos_a * dr.sqrt(light.variance_along))
    aside += light.up * (sin_a * dr.sqrt(light.variance_up))
    return dr.normalize(light.towards + radius * aside)


def cosine_half_width(
    light: AngularVariance, normal: mi.Vector3f, upright: mi.Vector3f
) -> mi.Float:
    """Return the half-width (n,) of the distribution of the cosine between a beam and a normal.

    The distribution is taken to be uniform, with the beam's variance, so that its half-width is
    sqrt(3) standard deviations. All light comes from above the undeformed surface, which limits the
    width.

    Args:
        normal: unit normals.
        upright: unit normals of the undeformed surface.
    """
    variance = light.variance_along * dr.square(dr.dot(light.along, normal))
    variance += light.variance_up * dr.square(dr.dot(light.up, normal))
    return dr.minimum(dr.sqrt(3 * variance), dr.abs(dr.dot(upright, light.towards)))


def mirrored_above(direction: mi.Vector3f, normal: mi.Vector3f) -> mi.Vector3f:
    """Return directions (3, n), of which those that point below the plane of a normal are mirrored
    to above it.

    Shadow rays of an indenter that is not convex would otherwise meet the indenter itself. The
    studs of a brick then lose 0.1 % of their light.
    """
    return direction - normal * (2 * dr.minimum(dr.dot(direction, normal), 0))


def passes_near(ball: mi.Vector4f, start: mi.Point3f, light: AngularVariance) -> mi.Bool:
    """Return whether a beam from ``start`` may touch a ball, (n,).

    Args:
        ball: centre and radius, mm.
        start: the point that the beam arrives at, mm.
    """
    offset = mi.Vector3f(ball.x - start.x, ball.y - start.y, ball.z - start.z)
    along = dr.dot(offset, light.towards)
    gap = offset - light.towards * along
    gap2 = dr.squared_norm(gap)
    # Twice the standard deviation towards the ball is the half-width of the ellipse from which
    # `sample_direction` draws.
    variance = light.variance_along * dr.square(dr.dot(gap, light.along))
    variance += light.variance_up * dr.square(dr.dot(gap, light.up))
    variance /= dr.maximum(gap2, 1e-12)
    # The margin covers the spread of the beam over the way to the ball.
    reach = ball.w + along * (2 * dr.sqrt(variance))
    return (along > -ball.w) & (gap2 < reach * reach)


@dr.syntax
def occluder_horizon(
    balls: mi.Float,
    ball_count: mi.UInt32,
    point: mi.Point3f,
    upright: mi.Vector3f,
    own: mi.Bool,
) -> mi.Float:
    """Return the occluder horizon (n,): the sine of the elevation below which a ball may occlude
    the light.

    Args:
        balls: centre and radius of each ball, four floats, mm.
        ball_count: number of balls.
        point: the points, mm.
        upright: unit normal of the plane over which the elevation is measured.
        own: whether a point lies on the convex shape inside one of the balls; that ball does not
            occlude it.
    """
    highest = mi.Float(-1)
    inside = mi.UInt32(0)
    n = mi.UInt32(0)
    while dr.hint(n < ball_count, exclude=[balls, ball_count, point, upright, own]):
        ball = dr.gather(mi.Vector4f, balls, n)
        offset = mi.Vector3f(ball.x, ball.y, ball.z) - mi.Vector3f(point)
        distance = dr.norm(offset)
        if dr.hint(distance < ball.w * 1.0001, exclude=[ball, offset, distance, upright, own]):
            inside += 1
            highest = dr.select(own, highest, 1)
        else:
            # The top of the ball is at the elevation of its centre plus its angular radius, at most
            # 90 degrees.
            sine, width = dr.dot(offset, upright) / distance, ball.w / distance
            cosine, side = dr.safe_sqrt(1 - sine * sine), dr.safe_sqrt(1 - width * width)
            top = dr.select(sine > side, 1, sine * side + width * cosine)
            highest = dr.maximum(highest, top)
        n += 1
    # A point inside several balls may be occluded by any of them.
    return dr.select(inside > 1, 1, highest)


def broadened_coating(coating: CoatingBsdf, cosine: mi.Float) -> CoatingBsdf:
    """Return the coating that reflects light from one direction as ``coating`` reflects a beam of a
    mean cosine (n,).

    The diffuse lobe is linear in direction, so that scaling it with the mean cosine is exact. The
    metallic lobe is averaged over a disc of light.
    """
    reflectance = coating.reflectance * cosine
    if not coating.metallic:
        return replace(coating, reflectance=reflectance)
    return replace(coating, reflectance=reflectance, light_radius2=squared_radius(cosine))


def reflected_from_discs(
    coating: CoatingBsdf,
    light: AngularVariance,
    cosine: mi.Float,
    normal: mi.Vector3f,
    towards_eye: mi.Vector3f,
    cosine_half_width: mi.Float | None = None,
) -> mi.Color3f:
    """Return the radiance (3, n) that coatings reflect of beams of unit flux density, each of which
    the metallic lobe sees as two discs.

    Direction bins are longer than high. If the beams were single discs, the skin of GelSight Mini
    would be 1 % too bright at specularities of 0.6 and 0.8: light at the side of a lobe grows with
    its variance in the direction of the lobe.

    Args:
        cosine: mean cosine (n,) of the beams.
        cosine_half_width: as in `evaluate_coating`.
    """
    reflectance = coating.reflectance * (cosine * (1 - coating.specularity))
    diffuse = replace(coating, reflectance=reflectance, metallic=False)
    total = evaluate_coating(diffuse, normal, light.towards, towards_eye, cosine_half_width)
    one, other, within = two_discs(light)
    lobe = broadened_coating(coating, within)
    both = metallic_lobe(lobe, normal, one, towards_eye)
    both += metallic_lobe(lobe, normal, other, towards_eye)
    # The reflectance of a metal hardly varies between the two discs.
    metal = metal_reflectance(coating, light.towards, towards_eye)
    return total + dr.select(both > 0, metal * (0.5 * both), 0)


def coating_with_broadened_tail(
    coating: CoatingBsdf, light: AngularVariance, cosine: mi.Float
) -> CoatingBsdf:
    """Return the coating that reflects light from one direction as ``coating``, of whose metallic
    lobe only the tail counts, reflects a beam of a mean cosine (n,).

    Direction bins are longer than high. If the beams were round, the skin of GelSight Mini of
    specularity 1 would be 5 % too bright.
    """
    along = light.along * dr.sqrt(2 * light.variance_along)
    up = light.up * dr.sqrt(2 * light.variance_up)
    return replace(coating, reflectance=coating.reflectance * cosine, light_axes=(along, up))
