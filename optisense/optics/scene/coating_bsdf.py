"""Scattering of light at a coating, which is a blend of two lobes.

The coating is ``(1 - s)`` times a Lambertian lobe of its reflectance plus ``s`` times a
metallic GGX lobe (Walter et al. 2007, separable Smith shadowing, sampled by visible normals:
Heitz 2018) of its complex index.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from optisense.optics.scene.interfaces import ggx, ggx_of_disc, sample_ggx, smith_g1

PEAK_ANGLES = 0.12, 0.3
"""Angles (radians) between the half vector and the normal over which the peak of a narrow metallic
lobe passes into its tail. With 0.3 and 0.5, the noise of the skin of GelSight Mini of specularity 1
is half as large again; with 0.08 and 0.2, the contact on GelSight Svelte is 1.2 % too dark instead
of 0.4 %."""


@dataclass
class CoatingBsdf:
    """The reflectance of opaque surfaces at hits: per-lane parameters of the blend of two lobes.

    ``metallic`` is False if no surface has a metallic lobe, which is then not compiled into
    kernels. ``light_radius2`` is the squared angular radius (radians squared) of the disc of light
    over which the metallic lobe is averaged; None for light of a single direction. ``only_tail`` is
    whether the peaks of metallic lobes are left out (see `peak_share`). Their tails are averaged
    over light of the variances of ``light_axes``: two vectors perpendicular to the light, of
    sqrt(2) standard deviations (radians); None for light of a single direction.
    """

    reflectance: mi.Color3f
    metal_eta: mi.Color3f
    metal_k: mi.Color3f
    specularity: mi.Float
    alpha: mi.Float
    metallic: bool = True
    light_radius2: mi.Float | None = None
    only_tail: bool = False
    light_axes: tuple[mi.Vector3f, mi.Vector3f] | None = None


def coating_of(
    table: mi.Float, surface: mi.UInt32, active: mi.Bool, metallic: bool = True
) -> CoatingBsdf:
    """Return reflectance parameters, (n,) each; ``metallic`` as in `CoatingBsdf`."""
    first = dr.gather(mi.Vector4f, table, surface * 4, active)
    base = dr.gather(mi.Vector4f, table, surface * 4 + 1, active)
    eta = dr.gather(mi.Vector4f, table, surface * 4 + 2, active)
    k = dr.gather(mi.Vector4f, table, surface * 4 + 3, active)
    return CoatingBsdf(
        reflectance=mi.Color3f(base.x, base.y, base.z),
        metal_eta=mi.Color3f(eta.x, eta.y, eta.z),
        metal_k=mi.Color3f(k.x, k.y, k.z),
        specularity=first.w,
        alpha=first.z,
        metallic=metallic,
    )


def grey(colour: mi.Color3f) -> mi.Float:
    """Return the mean (n,) of the three channels of a colour.

    ``dr.mean`` would make kernels depend on the number of lanes.
    """
    return (colour.x + colour.y + colour.z) * (1 / 3)


def albedo_of(coating: CoatingBsdf) -> mi.Color3f:
    """Return the approximate albedo per channel, with the metal at normal incidence."""
    metal = fresnel_metal(mi.Float(1), coating.metal_eta, coating.metal_k)
    return coating.reflectance * (1 - coating.specularity) + metal * coating.specularity


def fresnel_metal(cosine: mi.Float, eta: mi.Color3f, k: mi.Color3f) -> mi.Color3f:
    """Return the unpolarised Fresnel reflectance (3, n) of a metal (Born & Wolf, 13.2).

    Args:
        cosine: cosine (n,) of the angle of incidence.
        eta, k: real and imaginary part (3, n) of the metal's refractive index over the index of the
            medium in front of it.
    """
    cos2 = cosine * cosine
    sin2 = 1 - cos2
    eta2, k2 = eta * eta, k * k
    t0 = eta2 - k2 - sin2
    a2b2 = dr.safe_sqrt(t0 * t0 + 4 * k2 * eta2)
    a = dr.safe_sqrt(0.5 * (a2b2 + t0))
    rs = (a2b2 + cos2 - 2 * a * cosine) / (a2b2 + cos2 + 2 * a * cosine)
    ratio = (cos2 * a2b2 + sin2 * sin2 - 2 * a * cosine * sin2) / (
        cos2 * a2b2 + sin2 * sin2 + 2 * a * cosine * sin2
    )
    return 0.5 * rs * (1 + ratio)


def _facet_density(
    coating: CoatingBsdf, normal: mi.Vector3f, half: mi.Vector3f, towards_light: mi.Vector3f
) -> mi.Float:
    """Return the GGX distribution at half vectors, averaged over the disc of light if any."""
    cos_m = dr.dot(half, normal)
    if coating.light_radius2 is None:
        return ggx(cos_m, coating.alpha)
    cos_h = dr.dot(half, towards_light)
    return ggx_of_disc(cos_m, cos_h, coating.alpha, coating.light_radius2)


def _ggx_tail(
    normal: mi.Vector3f,
    towards_light: mi.Vector3f,
    towards_eye: mi.Vector3f,
    alpha: mi.Float,
    light_axes: tuple[mi.Vector3f, mi.Vector3f] | None,
) -> mi.Float:
    """Return the tail of the GGX distribution, averaged over light of the variances of two axes.

    Four directions have these variances: one on each side of the mean direction along each axis, at
    sqrt(2) standard deviations.
    """
    if light_axes is None:
        lights = [towards_light]
    else:
        lights = [
            dr.normalize(towards_light + axis * side) for axis in light_axes for side in (1, -1)
        ]
    total = mi.Float(0)
    for each in lights:
        cos_m = half_vector_cosine(normal, each, towards_eye)
        total += ggx(cos_m, alpha) * (1 - peak_share(cos_m))
    return total / len(lights)


def evaluate_coating(
    coating: CoatingBsdf,
    normal: mi.Vector3f,
    towards_light: mi.Vector3f,
    towards_eye: mi.Vector3f,
    cosine_half_width: mi.Float | None = None,
) -> mi.Color3f:
    """Return the BSDF (1/sr) times the cosine at the light, (3, n); 0 below the surface.

    Args:
        normal: unit normals.
        towards_light, towards_eye: unit directions away from the surface.
        cosine_half_width: half-width (n,) of the uniform distribution of cosines over which the
            diffuse lobe's cosine is averaged; cosines below 0 count as 0. None for light of a
            single direction.
    """
    cos_i = dr.dot(normal, towards_light)
    cos_o = dr.dot(normal, towards_eye)
    cos_d = cos_i
    if cosine_half_width is not None:
        half_width = cosine_half_width + 1e-9
        part = dr.maximum(cos_i + half_width, 0)
        cos_d = dr.select(cos_i < half_width, part * part / (4 * half_width), cos_i)
    diffuse = dr.select(
        (cos_d > 0) & (cos_o > 0), coating.reflectance * (dr.inv_pi * cos_d), mi.Color3f(0)
    )
    if not coating.metallic:
        return diffuse
    lobe = metallic_lobe(coating, normal, towards_light, towards_eye)
    shiny = metal_reflectance(coating, towards_light, towards_eye) * lobe
    return diffuse * (1 - coating.specularity) + dr.select(lobe > 0, shiny, 0)


def metal_reflectance(
    coating: CoatingBsdf, towards_light: mi.Vector3f, towards_eye: mi.Vector3f
) -> mi.Color3f:
    """Return the Fresnel reflectance (3, n) of coatings' metals, for outward unit directions."""
    half = dr.normalize(towards_light + towards_eye)
    cosine = dr.abs(dr.dot(half, towards_light))
    return fresnel_metal(cosine, coating.metal_eta, coating.metal_k)


def metallic_lobe(
    coating: CoatingBsdf,
    normal: mi.Vector3f,
    towards_light: mi.Vector3f,
    towards_eye: mi.Vector3f,
) -> mi.Float:
    """Return the BSDF (1/sr) of the metallic lobe times the cosine at the light, (n,), for a
    reflectance of 1 of the metal; 0 below the surface. The arguments are those of
    `evaluate_coating`.
    """
    cos_i = dr.dot(normal, towards_light)
    cos_o = dr.dot(normal, towards_eye)
    if coating.only_tail:
        density = _ggx_tail(normal, towards_light, towards_eye, coating.alpha, coating.light_axes)
    else:
        half = dr.normalize(towards_light + towards_eye)
        density = _facet_density(coating, normal, half, towards_light)
    lobe = density * smith_g1(cos_i, coating.alpha) * smith_g1(cos_o, coating.alpha) / (4 * cos_o)
    return dr.select((cos_i > 0) & (cos_o > 0), coating.specularity * lobe, 0)


def peak_share(cos_m: mi.Float) -> mi.Float:
    """Return the share (n,) of a narrow metallic lobe that belongs to its peak.

    Args:
        cos_m: cosine of the half vector with the normal.
    """
    first, last = PEAK_ANGLES
    x = dr.clip((math.cos(first) - cos_m) / (math.cos(first) - math.cos(last)), 0, 1)
    return 1 - x * x * (3 - 2 * x)


def evaluate_peak(
    coating: CoatingBsdf, normal: mi.Vector3f, towards_light: mi.Vector3f, towards_eye: mi.Vector3f
) -> mi.Color3f:
    """Return the part of `evaluate_coating` that belongs to the peaks of metallic lobes."""
    lobe = replace(coating, reflectance=mi.Color3f(0))
    value = evaluate_coating(lobe, normal, towards_light, towards_eye)
    return value * peak_share(half_vector_cosine(normal, towards_light, towards_eye))


def half_vector_cosine(normal: mi.Vector3f, one: mi.Vector3f, other: mi.Vector3f) -> mi.Float:
    """Return the cosine (n,) of the half vector of two unit directions with a unit normal."""
    return dr.dot(dr.normalize(one + other), normal)


def coating_density(
    coating: CoatingBsdf, normal: mi.Vector3f, towards_light: mi.Vector3f, towards_eye: mi.Vector3f
) -> mi.Float:
    """Return the density (n,), 1/sr, of the directions that `sample_coating` draws with random
    picks; 0 below the surface. For light of a disc (`CoatingBsdf.light_radius2`), the lobe is
    averaged over it.

    Args:
        normal: unit normals.
        towards_light, towards_eye: unit directions away from the surface.
    """
    cos_i, cos_o = dr.dot(normal, towards_light), dr.dot(normal, towards_eye)
    half = dr.normalize(towards_light + towards_eye)
    facets = _facet_density(coating, normal, half, towards_light)
    lobe = facets * smith_g1(cos_o, coating.alpha) / (4 * cos_o)
    density = lobe * coating.specularity + cos_i * (dr.inv_pi * (1 - coating.specularity))
    return dr.select((cos_i > 0) & (cos_o > 0), density, 0.0)


def sample_coating(
    coating: CoatingBsdf,
    normal: mi.Vector3f,
    incoming: mi.Vector3f,
    pick: mi.Float,
    sample: mi.Point2f,
) -> tuple[mi.Vector3f, mi.Color3f]:
    """Draw a scattered direction and its weight.

    Args:
        normal: unit normals.
        incoming: unit directions in which the light travels, towards the surface.
        pick: random number (n,) in [0, 1) that chooses the lobe.
        sample: random point of the unit square that chooses the direction.

    Returns:
        The unit direction (3, n), and the weight (3, n) of its light: the BSDF times the cosine
        over the sampling density; 0 below the surface.
    """
    frame = mi.Frame3f(normal)
    local = frame.to_local(-incoming)
    metallic = pick < coating.specularity
    half = sample_ggx(local, coating.alpha, sample)
    reflected = 2 * dr.dot(local, half) * half - local
    metal = fresnel_metal(dr.dot(local, half), coating.metal_eta, coating.metal_k) * smith_g1(
        dr.maximum(reflected.z, 1e-6), coating.alpha
    )
    spread = mi.warp.square_to_cosine_hemisphere(sample)
    outgoing = dr.select(metallic, reflected, spread)
    weight = dr.select(metallic, metal, coating.reflectance)
    return frame.to_world(outgoing), dr.select((outgoing.z > 0) & (local.z > 0), weight, 0.0)
