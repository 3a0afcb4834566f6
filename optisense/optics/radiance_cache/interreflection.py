"""Interreflection: light that indenters and the skin near them reflect to each other.

The radiance cache holds the light that arrives from outside the contact, also after scattering.
Inside a contact, a point sees an indenter or, from an indenter, the skin beside it. The light from
there is sampled by rays. It is a few per cent of the total, so the place that a ray meets is
treated as diffuse. Its irradiance is read from nine spherical-harmonic coefficients per cell and
light group (Ramamoorthi and Hanrahan 2001), with one shadow ray per group towards the mean
direction of the light.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import STEPS_2D, next_random, unit_float
from optisense.optics.radiance_cache._irradiance import irradiance
from optisense.optics.radiance_cache.cache import BinnedLight, RadianceCache
from optisense.optics.radiance_cache.shading_points import ShadingPoints, may_be_cached
from optisense.optics.scene.coating_bsdf import albedo_of, sample_coating
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import Ray, leave
from optisense.optics.scene.surface_cells import cell_at

DIRECTIONS = 8
"""Number of rays per camera sample that sample interreflected light: a pixel of twelve samples then
has a hundred, whose mean is known to a tenth, and interreflection is a few per cent of the light.
"""
MAX_BOUNCES = 8
"""Largest number of reflections inside a contact. Even a coating of reflectance 0.7 keeps at most 6
% of the light after so many."""


@dr.syntax
def _sample(
    light: BinnedLight,
    scenes: ContactScenes,
    at: ShadingPoints,
    directions: mi.UInt32,
) -> list[mi.Color3f]:
    """Return the radiance (3, n) of interreflected light for each light group."""
    cells, table, groups = light.cells, light.irradiance, light.groups
    assert scenes.indenters is not None
    indenters, fixed, points = scenes.indenters, scenes.fixed, at.seen
    series, first = points.series, points.number * directions
    totals = [mi.Color3f(0) for _ in range(groups)]
    # The share of the light that a place reflects if it is diffuse.
    albedo = albedo_of(at.coating)
    survival = dr.max(albedo)
    k = mi.UInt32(0)
    while at.active & (k < directions):
        # All samples of a pixel share one sequence.
        u = unit_float(series + (first + k) * STEPS_2D[0])
        v = unit_float(series * 277803737 + (first + k) * STEPS_2D[1])
        state = (points.random ^ (k * 0x9E3779B9)) * 69069
        direction, weight = sample_coating(
            at.coating, points.normal, -points.towards_eye, unit_float(state), mi.Point2f(u, v)
        )
        weight *= albedo
        above = mi.Bool(at.raised)
        start = leave(points.point, points.face_normal, direction)
        walking = (dr.dot(direction, points.face_normal) > 0) & (dr.max(weight) > 0)
        places, home = mi.UInt32(0), mi.UInt32(at.cell)
        while walking:
            pressed = indenters.intersect(Ray(start, direction, mi.Bool(True)))
            skin = fixed.intersect(Ray(start, direction, above))
            on_indenter = pressed.valid & (~skin.valid | (pressed.distance < skin.distance))
            # The cache already holds the light along a line that comes from the skin behind.
            cached = may_be_cached(light, home, direction, above)
            behind = fixed.occluded(start, -direction, cached)
            walking = on_indenter | (skin.valid & ~behind)
            if walking:
                seen = dr.select(on_indenter, pressed.point, skin.point)
                facing = dr.select(on_indenter, pressed.shading_normal, skin.shading_normal)
                facing *= -dr.sign(dr.dot(direction, facing))
                there, exists = cell_at(cells, skin.point, ~on_indenter)
                # A place on an indenter is lit like the cell of the point that sees it.
                there = dr.select(exists, there, at.cell)
                lift = leave(seen, facing, facing)
                for g in range(groups):
                    falling, _mean, towards = irradiance(table, there * groups + g, facing)
                    lit = falling > 0
                    towards = dr.select(lit, dr.normalize(towards), facing)
                    hidden = indenters.occluded(lift, towards, mi.Bool(True))
                    totals[g] += dr.select(lit & ~hidden, falling, 0) * dr.inv_pi * weight
                # The path continues in a direction of the diffuse lobe.
                state = next_random(state)
                places += 1
                walking = (unit_float(state) < survival) & (places < MAX_BOUNCES)
                weight *= albedo / survival
                u = unit_float(state * 277803737)
                v = unit_float((state ^ 0x9E3779B9) * 69069)
                direction = mi.Frame3f(facing).to_world(
                    mi.warp.square_to_cosine_hemisphere(mi.Point2f(u, v))
                )
                start, home = lift, mi.UInt32(there)
                above = mi.Bool(on_indenter)
        k += 1
    return [total / mi.Float(directions) for total in totals]


def interreflected(
    cache: RadianceCache, scenes: ContactScenes, at: ShadingPoints, directions: int = DIRECTIONS
) -> list[mi.Color3f]:
    """Return the radiance (3, n) towards the camera due to interreflected light, for each light
    group.

    Args:
        cache: the radiance cache.
        scenes: the scenes of the image, with indenters.
        directions: number of rays from each point.
    """
    return _sample(cache.binned, scenes, at, dr.opaque(mi.UInt32, directions))
