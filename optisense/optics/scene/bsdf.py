"""Scattering of light at a surface: refraction, mirror reflection, and the coating's blend of
two lobes.

The coating is ``(1 - s)`` times a Lambertian lobe of its reflectance plus ``s`` times a
metallic GGX lobe (Walter et al. 2007, separable Smith shadowing, sampled by visible normals:
Heitz 2018) of its complex index.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.scene.surfaces import CLEAR, Surface, SurfaceKind

FLOATS_PER_SURFACE = 16
"""Number of floats of a surface in the table of optical data; four gathers of four floats read
them."""
SMOOTH_ALPHA = 1e-3
"""GGX roughness below which a dielectric is treated as smooth. With 0.001, half of the micro-facets
tilt by less than 0.06 degrees: reflections blur by half a pixel of a picture with 320 pixels over
60 degrees, and refraction by less."""
MIN_DISC_COSINE = 0.1
"""Lower bound on the cosine of the half vector with the light, by which a disc of light widens
among half vectors. Below it the light and the eye are more than 168 degrees apart, so that both are
at grazing angles."""
PEAK_ANGLES = 0.12, 0.3
"""Angles (radians) between the half vector and the normal over which the peak of a narrow metallic
lobe passes into its tail. At wide angles, few rays from the skin meet a lamp: with 0.3 and 0.5, the
noise of the skin of GelSight Mini of specularity 1 is half as large again. Direction bins do not
describe the lamps at narrow angles: with 0.08 and 0.2, the contact on GelSight Svelte is 1.2 % too
dark instead of 0.4 %."""
MIN_DISC = 1e-9
"""Lower bound on the squared radius of a disc of half vectors (radians squared). It avoids a
division by zero; a disc of this radius (0.002 degrees) is a single direction."""


def surface_table(surfaces: list[Surface]) -> mi.Float:
    """Return the optical data of n surfaces on the device, (16 n,): those of `surface_rows`."""
    return mi.Float(surface_rows(surfaces).ravel())


def surface_rows(surfaces: list[Surface]) -> np.ndarray:
    """Return the rows (n, 16) float32 of the table of optical data.

    The four groups of four floats are: kind (as bits), eta, alpha, specularity | reflectance,
    region | metal eta, light | metal k. Dielectrics have the etas of the channels in place of the
    reflectance, the absorption coefficients inside and outside in place of the metal's eta and k,
    and in the last float a flag that these are known.
    """
    rows = np.zeros((len(surfaces), FLOATS_PER_SURFACE), dtype=np.float32)
    for row, surface in zip(rows, surfaces, strict=True):
        bits = np.array([int(surface.kind), int(surface.region), surface.light], dtype=np.uint32)
        row[0], row[7], row[11] = bits.view(np.float32)
        row[1:4] = surface.eta, surface.alpha, surface.specularity
        row[4:7] = surface.reflectance
        row[8:11] = surface.metal_eta
        row[12:15] = surface.metal_k
        if surface.kind is SurfaceKind.DIELECTRIC:
            row[4:7] = surface.eta if surface.etas is None else surface.etas
            row[8:11], row[12:15] = surface.absorption or (CLEAR, CLEAR)
            row[15] = surface.absorption is not None
    return rows


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


def surface_kind(
    table: mi.Float, surface: mi.UInt32, active: mi.Bool
) -> tuple[mi.UInt32, mi.Float, mi.Float]:
    """Return the kind, eta and alpha, (n,) each, of surfaces (n,).

    The arguments ``table``, ``surface`` and ``active`` of this and the following functions are the
    table of `surface_table`, the numbers (n,) of surfaces in it, and a mask (n,).
    """
    row = dr.gather(mi.Vector4f, table, surface * 4, active)
    return dr.reinterpret_array(mi.UInt32, row.x), row.y, row.z


def channel_eta(
    table: mi.Float, surface: mi.UInt32, channel: mi.UInt32, active: mi.Bool
) -> mi.Float:
    """Return the eta (n,) of dielectrics for light of one channel (n,), 0 to 2 for R, G, B."""
    return dr.gather(mi.Float, table, surface * FLOATS_PER_SURFACE + 4 + channel, active)


def media_absorption(
    table: mi.Float, surface: mi.UInt32, active: mi.Bool
) -> tuple[mi.Bool, mi.Color3f, mi.Color3f]:
    """Return whether the media of dielectrics are known (n,), and their absorption coefficients
    (3, n), 1/mm, in front of the face normal and behind it.
    """
    inside = dr.gather(mi.Vector4f, table, surface * 4 + 2, active)
    outside = dr.gather(mi.Vector4f, table, surface * 4 + 3, active)
    behind = mi.Color3f(inside.x, inside.y, inside.z)
    return outside.w > 0, mi.Color3f(outside.x, outside.y, outside.z), behind


def surface_region(table: mi.Float, surface: mi.UInt32, active: mi.Bool) -> mi.UInt32:
    """Return the `Region` (n,) of surfaces."""
    return dr.reinterpret_array(
        mi.UInt32, dr.gather(mi.Float, table, surface * FLOATS_PER_SURFACE + 7, active)
    )


def surface_light(table: mi.Float, surface: mi.UInt32, active: mi.Bool) -> mi.UInt32:
    """Return the number (n,) of the light whose emitting face a surface is."""
    return dr.reinterpret_array(
        mi.UInt32, dr.gather(mi.Float, table, surface * FLOATS_PER_SURFACE + 11, active)
    )


def coating_of(
    table: mi.Float, surface: mi.UInt32, active: mi.Bool, metallic: bool = True
) -> CoatingBsdf:
    """Return the reflectance parameters, (n,) each, of surfaces; ``metallic`` as in
    `CoatingBsdf`.
    """
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
    """Return the approximate albedo of a coating per channel, with its metal at normal
    incidence.
    """
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


def _ggx(cos_m: mi.Float, alpha: mi.Float) -> mi.Float:
    a2 = alpha * alpha
    base = cos_m * cos_m * (a2 - 1) + 1
    return a2 / (dr.pi * base * base)


def _ggx_of_disc(
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


def _facet_density(
    coating: CoatingBsdf, normal: mi.Vector3f, half: mi.Vector3f, towards_light: mi.Vector3f
) -> mi.Float:
    """Return the GGX distribution at half vectors, averaged over the disc of light if there is
    one.
    """
    cos_m = dr.dot(half, normal)
    if coating.light_radius2 is None:
        return _ggx(cos_m, coating.alpha)
    cos_h = dr.dot(half, towards_light)
    return _ggx_of_disc(cos_m, cos_h, coating.alpha, coating.light_radius2)


def _half_vector_disc(cos_m: mi.Float, cos_d: mi.Float, light_radius2: mi.Float) -> mi.Float:
    """Return the squared radius (n,) of a disc of half vectors, seen along the normal; see
    `_ggx_of_disc`.

    The solid angle of half vectors is that of the light over 4 cos_d; seen along the normal, it
    shrinks by cos_m.
    """
    return light_radius2 * cos_m / (4 * dr.maximum(cos_d, MIN_DISC_COSINE))


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
        total += _ggx(cos_m, alpha) * (1 - peak_share(cos_m))
    return total / len(lights)


def _smith(cosine: mi.Float, alpha: mi.Float) -> mi.Float:
    tan2 = (1 - cosine * cosine) / dr.maximum(cosine * cosine, 1e-12)
    return 2 / (1 + dr.sqrt(1 + alpha * alpha * tan2))


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
    """Return the Fresnel reflectance (3, n) of the metal of coatings, for unit directions away from
    the surface.
    """
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
    lobe = density * _smith(cos_i, coating.alpha) * _smith(cos_o, coating.alpha) / (4 * cos_o)
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
    lobe = facets * _smith(cos_o, coating.alpha) / (4 * cos_o)
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
    metal = fresnel_metal(dr.dot(local, half), coating.metal_eta, coating.metal_k) * _smith(
        dr.maximum(reflected.z, 1e-6), coating.alpha
    )
    spread = mi.warp.square_to_cosine_hemisphere(sample)
    outgoing = dr.select(metallic, reflected, spread)
    weight = dr.select(metallic, metal, coating.reflectance)
    return frame.to_world(outgoing), dr.select((outgoing.z > 0) & (local.z > 0), weight, 0.0)


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
    weight = dr.select(proper, _smith(dr.abs(cosine), alpha), 0.0)
    return outgoing, weight, through, dr.select(through, eta_it, 1.0)
