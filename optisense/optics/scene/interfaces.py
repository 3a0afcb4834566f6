"""Refraction and reflection at smooth and rough interfaces."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.scene._ggx import sample_ggx, smith_g1

SMOOTH_ALPHA = 1e-3
"""GGX roughness below which a dielectric is treated as smooth. With 0.001, half of the micro-facets
tilt by less than 0.06 degrees: reflections blur by half a pixel of a picture with 320 pixels over
60 degrees, and refraction by less."""


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


def sample_rough_interface(
    incoming: mi.Vector3f,
    normal: mi.Vector3f,
    eta: mi.Float,
    alpha: mi.Float,
    pick: mi.Float,
    sample: mi.Point2f,
) -> tuple[mi.Vector3f, mi.Float, mi.Bool, mi.Float]:
    """Draw a direction at a rough (GGX) interface (Walter et al. 2007).

    Args:
        incoming: unit directions in which the light travels.
        normal: unit normals.
        eta: index behind the normal over the index in front of it, (n,).
        alpha: GGX roughness (n,).
        pick: random number (n,) in [0, 1) that chooses reflection or transmission.
        sample: random point of the unit square that chooses the micro-facet.

    Returns:
        The unit direction (3, n); its weight (n,); whether it is transmitted (n,); and the index on
        its side over the index on the side that the light comes from (n,), 1 for reflection.
    """
    facing = normal * dr.sign(-dr.dot(incoming, normal))
    frame = mi.Frame3f(facing)
    half = frame.to_world(sample_ggx(frame.to_local(-incoming), alpha, sample))
    inside = dr.dot(facing, normal) < 0
    relative = dr.select(inside, dr.rcp(eta), eta)
    reflectance, reflected, transmitted, eta_it = refract(incoming, half, relative)
    through = pick >= reflectance
    outgoing = dr.select(through, transmitted, reflected)
    cosine = dr.dot(outgoing, facing)
    proper = dr.select(through, cosine < 0, cosine > 0)
    weight = dr.select(proper, smith_g1(dr.abs(cosine), alpha), 0.0)
    return outgoing, weight, through, dr.select(through, eta_it, 1.0)
