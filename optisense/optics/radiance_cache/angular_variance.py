"""The angular variance of a beam about its mean direction, and what it means for shading."""

from __future__ import annotations

from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import unit_float
from optisense.optics.scene.bsdf import CoatingBsdf

MAX_SPREAD = 0.1
"""Upper bound on 1 - mean cosine of a beam, up to which its directions are treated as a flat
disc."""
MIN_SQUARED_SINE = 0.1
"""Squared sine of the angle to the axis of the bins below which the moment along that axis does not
tell the variance of a direction."""


@dataclass
class AngularVariance:
    """A beam of light about its mean direction.

    Attributes:
        towards: unit vector towards the light.
        along: unit vector across it, along the sectors of the bins.
        up: unit vector across it, towards the axis of the bins.
        variance_along: variance of the angle (radians squared) in the direction ``along``.
        variance_up: variance in the direction ``up``.
    """

    towards: mi.Vector3f
    along: mi.Vector3f
    up: mi.Vector3f
    variance_along: mi.Float
    variance_up: mi.Float


def mean_direction(value: mi.Vector4f) -> tuple[mi.Vector3f, mi.Float]:
    """The mean direction of a cache entry, and the mean cosine of its light with it.

    Both are the same for an entry of opposite sign.
    """
    mean = mi.Vector3f(value.x, value.y, value.z)
    length = dr.norm(mean)
    return mean * (dr.sign(value.w) / length), dr.minimum(length / dr.abs(value.w), 1.0)


def isotropic_variance(towards: mi.Vector3f, cosine: mi.Float) -> AngularVariance:
    """A beam of this mean cosine whose variance is the same in all directions."""
    frame = mi.Frame3f(towards)
    half = dr.minimum(1 - cosine, MAX_SPREAD)
    return AngularVariance(towards, frame.s, frame.t, half, half)


def angular_variance(
    axis: mi.Vector3f, towards: mi.Vector3f, cosine: mi.Float, height: mi.Float
) -> AngularVariance:
    """A beam from its mean cosine and a second moment.

    For small angles, the sum of both variances is twice the difference of the mean cosine from 1.

    Args:
        axis: of the bins.
        towards: mean direction.
        cosine: mean cosine with it.
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
    """Two discs beside each other with the variances of a beam that is longer than wide.

    Returns:
        The mean directions of both, and the mean cosine of each with its own.
    """
    wide = dr.maximum(light.variance_along, light.variance_up)
    slim = dr.maximum(dr.minimum(light.variance_along, light.variance_up), 0)
    aside = dr.select(light.variance_along > light.variance_up, light.along, light.up)
    aside *= dr.sqrt(dr.maximum(wide - slim, 0))
    return dr.normalize(light.towards + aside), dr.normalize(light.towards - aside), 1 - slim


def squared_radius(cosine: mi.Float) -> mi.Float:
    """Squared angular radius R^2 of a uniform disc of this mean cosine, which is 1 - R^2 / 4."""
    return 4 * dr.minimum(1 - cosine, MAX_SPREAD)


def sample_direction(light: AngularVariance, state: mi.UInt32) -> mi.Vector3f:
    """A direction of a beam, drawn uniformly from the ellipse of its variances."""
    radius = 2 * dr.sqrt(unit_float((state ^ 0x9E3779B9) * 69069))
    sin_a, cos_a = dr.sincos(unit_float(state * 277803737) * dr.two_pi)
    aside = light.along * (cos_a * dr.sqrt(light.variance_along))
    aside += light.up * (sin_a * dr.sqrt(light.variance_up))
    return dr.normalize(light.towards + radius * aside)


def cosine_half_width(
    light: AngularVariance, normal: mi.Vector3f, upright: mi.Vector3f
) -> mi.Float:
    """Half-width of the distribution of a beam's cosine with a normal.

    The distribution is taken to be uniform, with the beam's variance. All light comes from above
    the undeformed surface (normal ``upright``), which limits the width.
    """
    variance = light.variance_along * dr.square(dr.dot(light.along, normal))
    variance += light.variance_up * dr.square(dr.dot(light.up, normal))
    return dr.minimum(dr.sqrt(3 * variance), dr.abs(dr.dot(upright, light.towards)))


def mirrored_above(direction: mi.Vector3f, normal: mi.Vector3f) -> mi.Vector3f:
    """A direction, mirrored at the plane of a normal if it lies below it."""
    return direction - normal * (2 * dr.minimum(dr.dot(direction, normal), 0))


def passes_near(
    ball: mi.Vector4f, start: mi.Point3f, towards: mi.Vector3f, radius2: mi.Float
) -> mi.Bool:
    """Whether a beam (squared angular radius) from ``start`` may touch a ball (centre, radius)."""
    offset = mi.Vector3f(ball.x - start.x, ball.y - start.y, ball.z - start.z)
    along = dr.dot(offset, towards)
    # The margin covers the spread of the beam over the way to the ball.
    reach = ball.w + along * dr.sqrt(radius2)
    gap2 = dr.squared_norm(offset) - along * along
    return (along > -ball.w) & (gap2 < reach * reach)


@dr.syntax
def occluder_horizon(
    balls: mi.Float,
    ball_count: mi.UInt32,
    point: mi.Point3f,
    upright: mi.Vector3f,
    own: mi.Bool,
) -> mi.Float:
    """Sine of the elevation over the plane of ``upright`` below which a ball occludes the light.

    For points with ``own``, the one ball that they lie in does not count: they lie on the convex
    shape within it.
    """
    highest = mi.Float(-1)
    inside = mi.UInt32(0)
    n = mi.UInt32(0)
    while n < ball_count:
        ball = dr.gather(mi.Vector4f, balls, n)
        offset = mi.Vector3f(ball.x, ball.y, ball.z) - mi.Vector3f(point)
        distance = dr.norm(offset)
        if distance < ball.w * 1.0001:
            inside += 1
            highest = dr.select(own, highest, 1)
        else:
            # The sum of the angles of the ball's middle and of its radius; at most a right angle.
            sine, width = dr.dot(offset, upright) / distance, ball.w / distance
            cosine, side = dr.safe_sqrt(1 - sine * sine), dr.safe_sqrt(1 - width * width)
            top = dr.select(sine > side, 1, sine * side + width * cosine)
            highest = dr.maximum(highest, top)
        n += 1
    # Within several, each may be in the way of the others.
    return dr.select(inside > 1, 1, highest)


def broadened_coating(coating: CoatingBsdf, cosine: mi.Float) -> CoatingBsdf:
    """A coating as it reflects light that is spread about its mean direction.

    The diffuse lobe is linear in direction, so the mean cosine makes it exact. The metallic lobe is
    averaged over a disc of light.
    """
    reflectance = coating.reflectance * cosine
    if not coating.metallic:
        return replace(coating, reflectance=reflectance)
    return replace(coating, reflectance=reflectance, light_radius2=squared_radius(cosine))
