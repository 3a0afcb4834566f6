"""How light of a beam is spread about its mean direction, and what that means for shading."""

from __future__ import annotations

from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import unit_float
from optisense.optics.scene.bsdf import Coating

MOST_SPREAD = 0.1
"""Of a beam: 1 - its mean cosine, up to which directions are taken to lie on a disc."""
LEAST_SLOPE = 0.1
"""Squared sine from the axis of the bins, below which it tells nothing of a direction's spread."""


@dataclass
class Spread:
    """Light about the direction ``towards``: the variance of its angle (radians squared) along
    two directions across, ``along`` the sectors of the bins and ``up`` towards their axis.
    """

    towards: mi.Vector3f
    along: mi.Vector3f
    up: mi.Vector3f
    variance_along: mi.Float
    variance_up: mi.Float


def beam(value: mi.Vector4f) -> tuple[mi.Vector3f, mi.Float]:
    """Mean direction of an entry of the field, and the mean cosine with it of the entry's light."""
    mean = mi.Vector3f(value.x, value.y, value.z)
    length = dr.norm(mean)
    return mean / length, dr.minimum(length / value.w, 1.0)


def round_spread(towards: mi.Vector3f, cosine: mi.Float) -> Spread:
    """Light of this mean cosine, spread alike to all sides."""
    frame = mi.Frame3f(towards)
    half = dr.minimum(1 - cosine, MOST_SPREAD)
    return Spread(towards, frame.s, frame.t, half, half)


def spread(axis: mi.Vector3f, towards: mi.Vector3f, cosine: mi.Float, height: mi.Float) -> Spread:
    """Light whose squared part along ``axis`` is ``height`` in the mean.

    For small angles both variances add up to twice what the mean cosine is below 1.
    """
    slope = dr.dot(axis, towards)
    flat = 1 - slope * slope
    half = dr.minimum(1 - cosine, MOST_SPREAD)
    variance = dr.maximum(height - dr.square(slope * cosine), 0) / dr.maximum(flat, LEAST_SLOPE)
    variance = dr.select(flat > LEAST_SLOPE, dr.minimum(variance, 2 * half), half)
    along = dr.cross(axis, towards)
    along = dr.select(flat > 1e-6, along * dr.rsqrt(dr.maximum(flat, 1e-6)), mi.Frame3f(towards).s)
    return Spread(towards, along, dr.cross(towards, along), 2 * half - variance, variance)


def squared_radius(cosine: mi.Float) -> mi.Float:
    """R^2 of a disc (angular radius R) of this mean cosine, which is 1 - R^2 / 4."""
    return 4 * dr.minimum(1 - cosine, MOST_SPREAD)


def within(light: Spread, state: mi.UInt32) -> mi.Vector3f:
    """A direction of the light, drawn evenly from an ellipse of its variances."""
    radius = 2 * dr.sqrt(unit_float((state ^ 0x9E3779B9) * 69069))
    sin_a, cos_a = dr.sincos(unit_float(state * 277803737) * dr.two_pi)
    aside = light.along * (cos_a * dr.sqrt(light.variance_along))
    aside += light.up * (sin_a * dr.sqrt(light.variance_up))
    return dr.normalize(light.towards + radius * aside)


def reach(light: Spread, normal: mi.Vector3f, upright: mi.Vector3f) -> mi.Float:
    """How far a beam's light is spread in its cosine with a normal: half of a slab of the same
    deviation.

    All light comes from above the undeformed surface (normal ``upright``), which limits it.
    """
    variance = light.variance_along * dr.square(dr.dot(light.along, normal))
    variance += light.variance_up * dr.square(dr.dot(light.up, normal))
    return dr.minimum(dr.sqrt(3 * variance), dr.abs(dr.dot(upright, light.towards)))


def above(direction: mi.Vector3f, normal: mi.Vector3f) -> mi.Vector3f:
    """A direction, mirrored up if it lies below the plane of a normal."""
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
def skyline(
    balls: mi.Float,
    ball_count: mi.UInt32,
    point: mi.Point3f,
    upright: mi.Vector3f,
    own: mi.Bool,
) -> mi.Float:
    """Sine of the elevation (above the plane of ``upright``) below which a ball is in the way.

    For points with ``own`` the one ball that they lie in does not count: they stand on the convex
    shape within.
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


def widened(coating: Coating, cosine: mi.Float) -> Coating:
    """A coating as it reflects light that is spread about its mean direction.

    The diffuse lobe is linear in direction, so the mean cosine makes it exact. The metallic lobe is
    blurred as if by light from a disc: the half vector moves half as far as the light, which adds
    R^2 / 8 to alpha^2.
    """
    reflectance = coating.reflectance * cosine
    if not coating.metallic:
        return replace(coating, reflectance=reflectance)
    alpha = dr.sqrt(coating.alpha * coating.alpha + squared_radius(cosine) * 0.125)
    return replace(coating, reflectance=reflectance, alpha=alpha)
