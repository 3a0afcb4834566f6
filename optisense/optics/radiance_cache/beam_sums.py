"""Sums over beams for points on the undeformed surface, and the part that indenters occlude."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import GOLDEN_BITS, next_random, unit_float
from optisense.optics.radiance_cache._irradiance import vector_sum
from optisense.optics.radiance_cache.angular_variance import (
    angular_variance,
    broadened_coating,
    coating_with_broadened_tail,
    reflected_from_discs,
    sample_direction,
)
from optisense.optics.radiance_cache.beams import Beams
from optisense.optics.radiance_cache.lit_scene import TRACED_ROUGHNESS
from optisense.optics.radiance_cache.shading_points import ShadingPoints
from optisense.optics.scene.coating_bsdf import albedo_of, evaluate_coating, grey
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.transport.photon_map import GROUP_MASK

MIN_STEP = 1e-20
"""Lower bound on the step of the systematic sampling (mW/mm^2/sr): far below any light, it only
avoids a division by zero where there is none."""


@dr.syntax
def sum_beams(
    beams: Beams,
    groups: int,
    at: ShadingPoints,
    axis: mi.Vector3f,
) -> list[mi.Color3f]:
    """Return the radiance (3, n) towards the camera due to all beams, for points on the undeformed
    surface, for each light group.

    Args:
        axis: unit vector, the axis of the direction bins.
    """
    totals = [mi.Color3f(0) for _ in range(groups)]
    j = dr.gather(mi.UInt32, beams.starts, at.cell * groups, at.active)
    end = dr.gather(mi.UInt32, beams.starts, (at.cell + 1) * groups, at.active)
    while dr.hint(j < end, exclude=[beams, groups, at, end, axis]):
        towards, cosine, flux, tag = beam_at(beams, j)
        group = tag & GROUP_MASK
        reflected = flux * _reflected(beams, j, at, axis, towards, cosine, tag)
        for g in range(groups):
            totals[g] += dr.select(group == g, reflected, 0)
        j += 1
    return totals


def sum_diffuse(
    table: mi.Float,
    groups: int,
    at: ShadingPoints,
) -> list[mi.Color3f]:
    """Return the radiance (3, n) towards the camera for points with diffuse, grey coatings, for
    each light group.

    The result is that of `sum_beams`; the vector sum of the light in the `irradiance_table`
    replaces the loop over beams.
    """
    reflectance = dr.select(at.active, albedo_of(at.coating) * dr.inv_pi, 0)
    return [
        reflectance * dr.maximum(dr.dot(vector_sum(table, at.cell * groups + g), at.seen.normal), 0)
        for g in range(groups)
    ]


@dr.syntax
def sum_hidden(
    beams: Beams,
    totals: list[mi.Color3f],
    indenters: RayScene,
    at: ShadingPoints,
    axis: mi.Vector3f,
    shadow_rays: mi.Float,
) -> list[mi.Color3f]:
    """Return the part of ``totals`` (3, n), for each light group, that indenters occlude.

    Shadow rays are drawn in proportion to the light, evenly spaced in its running sum (systematic
    sampling). They are spaced so that all the light of a group would take ``shadow_rays`` of them;
    ``beams``, which are only those that pass near indenters, take their share.

    The rays of a beam have its variances along and across ``axis``, the axis of the direction bins.
    Bins near the horizon are three times as long as high. With round beams, a low lamp would count
    as twice as high as it is, and the skin of GelSight Mini behind a contact would lose 4 to 5 % of
    the lamp's light to the shadow.
    """
    groups = len(totals)
    hidden = [mi.Color3f(0) for _ in range(groups)]
    steps = [dr.maximum(grey(total) / shadow_rays, MIN_STEP) for total in totals]
    random = next_random(at.seen.random)
    running = unit_float(random)
    j = dr.gather(mi.UInt32, beams.starts, at.cell * groups, at.active)
    end = dr.gather(mi.UInt32, beams.starts, (at.cell + 1) * groups, at.active)
    while dr.hint(
        j < end, exclude=[beams, indenters, at, axis, steps, groups, random, shadow_rays, end]
    ):
        towards, cosine, flux, tag = beam_at(beams, j)
        group = tag & GROUP_MASK
        reflected = flux * _reflected(beams, j, at, axis, towards, cosine, tag)
        step = mi.Float(MIN_STEP)
        for g in range(groups):
            step = dr.select(group == g, steps[g], step)
        share = dr.minimum(dr.abs(grey(reflected)) / step, shadow_rays)
        before = dr.floor(running)
        running += share
        times = dr.floor(running) - before
        weight = dr.rcp(dr.select(share < 1, share, times))
        # Each beam has random bits of its own, so that a beam added or dropped by rounding does not
        # change the rays of the others.
        state = random + tag * GOLDEN_BITS
        height = dr.gather(mi.Float, beams.heights, j, times > 0)
        while dr.hint(
            times > 0,
            exclude=[
                beams,
                indenters,
                at,
                axis,
                towards,
                cosine,
                tag,
                height,
                weight,
                group,
                groups,
                reflected,
            ],
        ):
            state = next_random(state)
            beam = angular_variance(axis, towards, beams.widened(cosine, tag), height)
            blocked = indenters.occluded(at.start, sample_direction(beam, state), mi.Bool(True))
            part = dr.select(blocked, weight, 0)
            for g in range(groups):
                hidden[g] += dr.select(group == g, reflected * part, 0)
            times -= 1
        j += 1
    return hidden


def _reflected(
    beams: Beams,
    number: mi.UInt32,
    at: ShadingPoints,
    axis: mi.Vector3f,
    towards: mi.Vector3f,
    cosine: mi.Float,
    tag: mi.UInt32,
) -> mi.Color3f:
    """Return the radiance (3, n) that coatings reflect of beams of unit flux density."""
    normal, towards_eye = at.seen.normal, at.seen.towards_eye
    if not at.coating.metallic:
        coating = broadened_coating(at.coating, cosine)
        return evaluate_coating(coating, normal, towards, towards_eye)
    height = dr.gather(mi.Float, beams.heights, number)
    light = angular_variance(axis, towards, cosine, height)
    if at.coating.only_tail:
        coating = coating_with_broadened_tail(at.coating, light, cosine)
        return evaluate_coating(coating, normal, towards, towards_eye)
    # Narrow lobes see widened beams as round.
    variance = 1 - beams.widened(cosine, tag)
    widened = (at.coating.alpha < TRACED_ROUGHNESS) & (variance > 1 - cosine)
    light.variance_along = dr.select(widened, variance, light.variance_along)
    light.variance_up = dr.select(widened, variance, light.variance_up)
    return reflected_from_discs(at.coating, light, cosine, normal, towards_eye)


def beam_at(beams: Beams, number: mi.UInt32) -> tuple[mi.Vector3f, mi.Float, mi.Color3f, mi.UInt32]:
    """Return the unit direction towards the light (3, n), mean cosine (n,) and flux density (3, n),
    mW/mm^2, of beams, and their tags (n,), as in `Beams`.
    """
    way = dr.gather(mi.Vector4f, beams.ways, number)
    flux = dr.gather(mi.Vector4f, beams.fluxes, number)
    towards = mi.Vector3f(way.x, way.y, way.z)
    colour = mi.Color3f(flux.x, flux.y, flux.z)
    return towards, way.w, colour, dr.reinterpret_array(mi.UInt32, flux.w)
