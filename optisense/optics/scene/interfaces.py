"""Refraction and reflection at smooth interfaces and at rough ones, of GGX micro-facets (Walter et
al. 2007).
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

MIN_DISC_COSINE = 0.1
"""Lower bound on the cosine of the half vector with the light, by which a disc of light widens
among half vectors. Below it the light and the eye are more than 168 degrees apart, so that both are
at grazing angles."""
MIN_DISC = 1e-9
"""Lower bound on the squared radius of a disc of half vectors (radians squared). It avoids a
division by zero; a disc of this radius (0.002 degrees) is a single direction."""
SMOOTH_ALPHA = 1e-3
"""GGX roughness below which a dielectric is treated as smooth. With 0.001, half of the micro-facets
tilt by less than 0.06 degrees: reflections blur by half a pixel of a picture with 320 pixels over
60 degrees, and refraction by less."""


def ggx(cos_m: mi.Float, alpha: mi.Float) -> mi.Float:
    """Return the GGX distribution (n,), 1/sr, of micro-facet normals.

    Args:
        cos_m: cosine of the micro-facet normal with the normal.
        alpha: GGX roughness.
    """
    a2 = alpha * alpha
    base = cos_m * cos_m * (a2 - 1) + 1
    return a2 / (dr.pi * base * base)


def ggx_of_disc(
    cos_m: mi.Float, cos_d: mi.Float, alpha: mi.Float, light_radius2: mi.Float
) -> mi.Float:
    """Return the GGX distribution averaged over the half vectors of a disc of light; it is exact
    but for the shape of the disc.

    With s the sine of the half vector with the normal, the distribution is
    a^2 / (pi (a^2 + (1 - a^2) s^2)^2): seen along the normal, the stereographic image of an even
    density on a sphere. As circles stay circles there, its integral over a disc of radius rho is
    the area of a spherical cap, of half angle c with cos(c) = q / h,
    q = a^2 + (1 - a^2) s^2 - rho^2, h^2 = q^2 + 4 a^2 rho^2. Peak, tail and integral are those of
    the convolution, while a larger alpha would raise the tail.

    Args:
        cos_m: cosine of the half vector with the normal.
        cos_d: cosine of the half vector with the light.
        alpha: GGX roughness.
        light_radius2: squared angular radius of the disc (radians squared).
    """
    a2 = alpha * alpha
    rho2 = dr.maximum((1 - a2) * _half_vector_disc(cos_m, cos_d, light_radius2), MIN_DISC)
    q = a2 + (1 - a2) * dr.maximum(1 - cos_m * cos_m, 0) - rho2
    h = dr.sqrt(q * q + 4 * a2 * rho2)
    # Two forms of (1 - cos c) / (2 rho^2); each is free of cancellation on its side.
    return dr.inv_pi * dr.select(q > 0, 2 * a2 / (h * (h + q)), (h - q) / (2 * rho2 * h))


def _half_vector_disc(cos_m: mi.Float, cos_d: mi.Float, light_radius2: mi.Float) -> mi.Float:
    """Return the squared radius (n,) of a disc of half vectors, seen along the normal.

    Their solid angle is that of the light over 4 cos_d; seen along the normal, it shrinks by cos_m.
    """
    return light_radius2 * cos_m / (4 * dr.maximum(cos_d, MIN_DISC_COSINE))


def smith_g1(cosine: mi.Float, alpha: mi.Float) -> mi.Float:
    """Return Smith's shadowing factor (n,) of one direction at GGX micro-facets.

    Args:
        cosine: cosine of the direction with the normal.
        alpha: GGX roughness.
    """
    tan2 = (1 - cosine * cosine) / dr.maximum(cosine * cosine, 1e-12)
    return 2 / (1 + dr.sqrt(1 + alpha * alpha * tan2))


def sample_ggx(local: mi.Vector3f, alpha: mi.Float, sample: mi.Point2f) -> mi.Vector3f:
    """Return a visible GGX normal, a unit vector (3, n) (Heitz 2018, "Sampling the GGX distribution
    of visible normals", listing 1).

    Args:
        local: unit directions towards the viewer, in the frame whose z axis is the surface's
            normal.
        alpha: GGX roughness (n,).
        sample: random point of the unit square.
    """
    stretched = dr.normalize(mi.Vector3f(alpha * local.x, alpha * local.y, local.z))
    length2 = stretched.x * stretched.x + stretched.y * stretched.y
    inverse = dr.select(length2 > 0, dr.rsqrt(dr.maximum(length2, 1e-20)), 0)
    t1 = dr.select(
        length2 > 1e-12,
        mi.Vector3f(-stretched.y * inverse, stretched.x * inverse, 0),
        mi.Vector3f(1, 0, 0),
    )
    t2 = dr.cross(stretched, t1)
    disk = mi.warp.square_to_uniform_disk_concentric(sample)
    s = 0.5 * (1 + stretched.z)
    y = (1 - s) * dr.safe_sqrt(1 - disk.x * disk.x) + s * disk.y
    z = dr.safe_sqrt(1 - disk.x * disk.x - y * y)
    half = t1 * disk.x + t2 * y + stretched * z
    return dr.normalize(mi.Vector3f(alpha * half.x, alpha * half.y, dr.maximum(half.z, 1e-6)))


def refract(
    incoming: mi.Vector3f, normal: mi.Vector3f, eta: mi.Float
) -> tuple[mi.Float, mi.Vector3f, mi.Vector3f, mi.Float]:
    """Return the Fresnel reflectance and the directions of light at an ideal interface.

    Args:
        incoming: unit directions in which the light travels.
        normal: unit normals.
        eta: index behind the normal over the index in front of it, (n,).

    Returns:
        The reflectance (n,), which is 1 at total internal reflection; the reflected and the
        transmitted unit direction (3, n); and the index of the far side over that of the near side
        (n,).
    """
    cosine = -dr.dot(incoming, normal)
    reflectance, cos_t, eta_it, eta_ti = mi.fresnel(cosine, eta)
    reflected = incoming + normal * (2 * cosine)
    transmitted = incoming * eta_ti + normal * (cosine * eta_ti + cos_t)
    return reflectance, dr.normalize(reflected), dr.normalize(transmitted), eta_it


def rough_lobes(
    incoming: mi.Vector3f,
    normal: mi.Vector3f,
    eta: mi.Float,
    alpha: mi.Float,
    sample: mi.Point2f,
) -> tuple[mi.Float, mi.Vector3f, mi.Float, mi.Vector3f, mi.Float, mi.Float]:
    """Draw a micro-facet of a rough (GGX) interface, which splits light in two (Walter et al.
    2007).

    Args:
        incoming: unit directions in which the light travels.
        normal: unit normals.
        eta: index behind the normal over the index in front of it, (n,).
        alpha: GGX roughness (n,).
        sample: random point of the unit square that chooses the micro-facet.

    Returns:
        The Fresnel reflectance (n,); the direction (3, n) and the weight (n,) of the reflected
        light, then those of the transmitted light; and the index of the far side over that of the
        near side (n,).
    """
    facing = normal * dr.sign(-dr.dot(incoming, normal))
    frame = mi.Frame3f(facing)
    half = frame.to_world(sample_ggx(frame.to_local(-incoming), alpha, sample))
    inside = dr.dot(facing, normal) < 0
    relative = dr.select(inside, dr.rcp(eta), eta)
    reflectance, reflected, transmitted, eta_it = refract(incoming, half, relative)

    def kept(cosine: mi.Float) -> mi.Float:
        return dr.select(cosine > 0, smith_g1(cosine, alpha), 0.0)

    turned, passed = kept(dr.dot(reflected, facing)), kept(-dr.dot(transmitted, facing))
    return reflectance, reflected, turned, transmitted, passed, eta_it


def sample_rough_interface(
    incoming: mi.Vector3f,
    normal: mi.Vector3f,
    eta: mi.Float,
    alpha: mi.Float,
    pick: mi.Float,
    sample: mi.Point2f,
) -> tuple[mi.Vector3f, mi.Float, mi.Float]:
    """Draw a direction at a rough interface.

    Args:
        incoming, normal, eta, alpha, sample: as in `rough_lobes`.
        pick: random number (n,) in [0, 1) that chooses reflection or transmission.

    Returns:
        The unit direction (3, n); its weight (n,); and the index on its side over the index on the
        side that the light comes from (n,), 1 for reflection.
    """
    reflectance, reflected, turned, transmitted, passed, eta_it = rough_lobes(
        incoming, normal, eta, alpha, sample
    )
    through = pick >= reflectance
    outgoing = dr.select(through, transmitted, reflected)
    return outgoing, dr.select(through, passed, turned), dr.select(through, eta_it, 1.0)
