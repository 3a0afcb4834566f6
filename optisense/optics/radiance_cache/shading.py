"""Shading of visible points from the radiance cache: tilt, shadows and interreflection.

A visible point sums the cache over direction bins and reflects each with its own normal. On an
indenter, which stands off the undeformed surface, a bin is looked up where the light's line goes on
to meet that surface. A shadow ray tests whether an indenter is in the way; it is drawn within the
angular variance of the bin, so that lights of some size cast soft shadows. Light that indenters and
the skin beside them reflect to each other is added by `interreflection`.
"""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import in_series, next_random
from optisense.optics.radiance_cache.angular_variance import (
    angular_variance,
    broadened_coating,
    cosine_half_width,
    mean_direction,
    mirrored_above,
    occluder_horizon,
    sample_direction,
    squared_radius,
)
from optisense.optics.radiance_cache.beam_sums import sum_beams, sum_diffuse, sum_hidden
from optisense.optics.radiance_cache.beams import Beams
from optisense.optics.radiance_cache.cache import MIN_COSINE, BinnedLight, RadianceCache
from optisense.optics.radiance_cache.interreflection import interreflected
from optisense.optics.radiance_cache.irradiance import irradiance
from optisense.optics.radiance_cache.shading_points import ShadingPoints
from optisense.optics.scene.bsdf import (
    albedo_of,
    coating_of,
    evaluate_coating,
    grey,
    surface_region,
)
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import Ray, RayScene, leave
from optisense.optics.scene.surface_cells import SurfaceCells, bin_axis, cell_at, plane_of
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.camera_paths import VisiblePoints
from optisense.optics.transport.volume_flux import LAYER_HEIGHT

MIN_IRRADIANCE_SHARE = 0.2
"""Share of the mean irradiance that is added to the expected light when shadow rays are spaced, so
that points in little light do not take many."""
CONTACT_SHADOW_RAYS = 16.0
"""Shadow rays per light group of a camera sample in and near contacts."""
SHADOW_RAYS = 32.0
"""Shadow rays per light group of a camera sample elsewhere, for all the light. Only those of beams
that pass near an indenter are traced."""
REFLECTED_SHADOW_RAYS = 4.0
"""The same for points seen in the reflection of an interface, of which little reaches the
camera."""
CELLS_PER_SAMPLE = 8
"""Cells that a camera sample averages where coatings are diffuse and reading a cell is cheap."""
MAX_EXTRAPOLATION = 1.5
"""Largest height, in units of half the flux layer's height, up to which the light above the surface
is extrapolated; it is constant above."""
MIN_SINE = 0.1
"""Lower bound on the sine of elevation by which the way of light from a point on an indenter on to
the undeformed surface is found: lower light meets another indenter or a wall before it."""
MIN_STEP = 1e-20
"""Lower bound on the step of the systematic sampling; it avoids a division by zero without
light."""


@dr.syntax
def _sum_chosen(
    light: BinnedLight,
    scenes: ContactScenes,
    at: ShadingPoints,
    shadow_rays: mi.Float,
    sky: mi.Float,
) -> list[mi.Color3f]:
    """Every bin, looked up along its own line, with shadow rays for some of the bins.

    Shadow rays go to bins that are not wholly above the occluder horizon (``sky``, a sine). They
    are
    drawn in proportion to the light, evenly spaced in its running sum (systematic sampling); where
    nothing is occluded, the sum is exact to half a step.

    With light above the surface (half-way up the flux layer), points on indenters interpolate
    between it and that of the surface below them.
    """
    moments, heights, colours = light.tables
    upper, groups, bins, points = light.above, light.groups, light.bins, at.seen
    assert scenes.indenters is not None
    indenters, active, raised = scenes.indenters.scene, at.active, at.raised
    totals = [mi.Color3f(0) for _ in range(groups)]
    state = mi.UInt32(points.random)
    steps = []
    running = []
    for g in range(groups):
        # About what the bins bring in all: how far apart the shadow rays are in the running sum.
        falling, mean, _ = irradiance(light.irradiance, at.cell * groups + g, points.normal)
        expected = (falling + MIN_IRRADIANCE_SHARE * mean) * grey(albedo_of(at.coating))
        expected *= dr.inv_pi
        steps.append(dr.maximum(expected / shadow_rays, MIN_STEP))
        # Of the samples of a pixel, each begins at another part of a step.
        running.append(in_series(points.series + (g + 1), points.number, 0))
    upright, offset = plane_of(light.cells, at.cell, active)
    up = dr.select(raised, (dr.dot(upright, points.point) - offset) / (LAYER_HEIGHT / 2), 0)
    up = dr.clip(up, 0, MAX_EXTRAPOLATION)
    rise = dr.dot(upright, points.point) - offset
    axis = bin_axis(light.cells, 2)
    k = mi.UInt32(0)
    while active & (k < bins):
        there = mi.UInt32(at.cell)
        if upper is None:
            there = _place(light, scenes.fixed, at, k)
        for g in range(groups):
            entry = (there * bins + k) * groups + g
            value = dr.gather(mi.Vector4f, moments, entry, active)
            if upper is not None:
                above_it = dr.gather(mi.Vector4f, upper[0], entry, active & raised)
                value = dr.lerp(value, above_it, up)
            if value.w > 0:
                towards, cosine = mean_direction(value)
                height = dr.gather(mi.Float, heights, entry)
                if upper is not None:
                    height = dr.lerp(height, dr.gather(mi.Float, upper[1], entry, raised), up)
                height = dr.maximum(height, 0) / value.w
                beam = angular_variance(axis, towards, cosine, height)
                # On the undeformed surface the mean cosine is the sum's already.
                half_width = dr.select(raised, cosine_half_width(beam, points.normal, upright), 0)
                reflected = evaluate_coating(
                    broadened_coating(at.coating, cosine),
                    points.normal,
                    towards,
                    points.towards_eye,
                    half_width,
                )
                sine = dr.dot(upright, towards)
                doubtful = sine - dr.sqrt(squared_radius(cosine)) < sky
                weight = dr.select(doubtful, mi.Float(0), 1)
                share = value.w * grey(reflected) / steps[g]
                before = dr.floor(running[g])
                running[g] += dr.select(doubtful, share, 0)
                times = dr.floor(running[g]) - before
                if times > 0:
                    state = next_random(state)
                    way = mirrored_above(sample_direction(beam, state), points.face_normal)
                    blocked = indenters.ray_test(
                        mi.Ray3f(at.start, way),
                        coherent=False,
                        active=mi.Bool(True),
                    )
                    weight = dr.select(blocked, 0.0, times / share)
                if dr.hint(light.coloured, mode="scalar"):
                    flux = dr.gather(mi.Vector4f, colours, entry)
                    if upper is not None:
                        flux = dr.lerp(flux, dr.gather(mi.Vector4f, upper[2], entry, raised), up)
                    reflected *= mi.Color3f(flux.x, flux.y, flux.z)
                else:
                    reflected *= value.w
                if dr.hint(scenes.absorption is not None and upper is None, mode="scalar"):
                    reflected *= _spared(scenes, rise, dr.dot(upright, towards))
                totals[g] += reflected * weight
        k += 1
    return totals


def _spared(scenes: ContactScenes, rise: mi.Float, sine: mi.Float) -> mi.Color3f:
    """By what factor light is stronger on an indenter, as it has come a shorter way through gel.

    Args:
        scenes: the scenes, in a gel that absorbs.
        rise: mm, height of the point above the undeformed surface; 0 and less there.
        sine: of the light's elevation above that surface.
    """
    way = dr.maximum(rise, 0) / dr.maximum(sine, MIN_SINE)
    return dr.exp(scenes.absorption * way)


@dr.syntax
def _place(light: BinnedLight, fixed: RayScene, at: ShadingPoints, k: mi.UInt32) -> mi.UInt32:
    """The cell where bin ``k`` is looked up for points.

    On an indenter it is where the line through the point along the bin's middle goes on to meet the
    undeformed surface, found on the planes of two cells in turn. On a curved surface, lines that
    graze
    these planes are followed by a ray. (The mean direction of the bin's light would not do: where a
    lamp straddles two bins, its halves would be read at places that do not belong together.)
    """
    cells, point = light.cells, at.seen.point
    middle = dr.gather(mi.Vector4f, light.centres, k)
    towards = mi.Vector3f(middle.x, middle.y, middle.z)
    there = mi.UInt32(at.cell)
    exists = at.active & at.raised
    for _ in range(2 if fixed.smooth else 1):
        normal, offset = plane_of(cells, there, exists)
        facing = dr.dot(normal, towards)
        exists &= facing > MIN_COSINE
        way = (dr.dot(normal, point) - offset) / dr.maximum(facing, MIN_COSINE)
        there, found = cell_at(cells, point - towards * way + at.shift, exists)
        exists &= found
    if dr.hint(fixed.smooth, mode="scalar"):  # noqa: SIM102 (the one is Python's, the other Dr.Jit's)
        if at.active & at.raised & ~exists:
            below = fixed.scene.ray_intersect_preliminary(
                mi.Ray3f(point, -towards), coherent=False, active=mi.Bool(True)
            )
            reached = below.is_valid()
            landing = point - towards * dr.select(reached, below.t, 0)
            there, exists = cell_at(cells, landing + at.shift, reached)
    return dr.select(exists, there, at.cell)


def shade(
    field: RadianceCache,
    scenes: ContactScenes,
    culled_beams: Beams,
    points: VisiblePoints,
    thorough: bool,
    reflected: bool,
) -> list[mi.Color3f]:
    """Radiance of visible points towards the camera, for each light group with lights of 1 mW.

    Args:
        field: the radiance cache.
        scenes: the scenes of the image.
        culled_beams: the beams of the cache that pass near indenters (`cull_beams`).
        points: the visible points.
        thorough: whether the points lie on or near indenters: each bin is then looked up along its
        own
            line, and interreflection is added.
        reflected: whether the points are seen in the reflection of an interface.
    """
    table = scenes.full.table
    active, base, raised = points.valid, points.point, mi.Bool(False)
    if thorough:
        region = surface_region(table, points.surface, points.valid)
        raised = points.valid & (region == int(Region.INDENTER))
        # Behind an indenter, along the line of sight, lies the undeformed surface that the eye
        # would have met.
        onward = scenes.fixed.intersect(Ray(points.point, -points.towards_eye, raised))
        base = dr.select(raised & onward.valid, onward.point, points.point)
    seen = active
    cell, shift, active = _interpolating_cell(field.cells, base, seen, points, points.number)
    start = leave(points.point, points.face_normal, points.face_normal)
    coating = coating_of(table, points.surface, active, field.metallic)
    at = ShadingPoints(points, coating, start, cell, shift, active, raised)
    indenters = scenes.indenters
    if thorough:
        sky = occluder_horizon(
            scenes.balls,
            dr.opaque(mi.UInt32, dr.width(scenes.balls) // 4),
            points.point,
            plane_of(field.cells, cell, active)[0],
            raised & dr.opaque(mi.Bool, scenes.convex),
        )
        shadow_rays = dr.opaque(mi.Float, CONTACT_SHADOW_RAYS)
        far = _sum_chosen(field.binned(), scenes, at, shadow_rays, sky)
        near = interreflected(field, scenes, at)
        return [one + other for one, other in zip(far, near, strict=True)]
    totals: list[mi.Color3f]
    if field.metallic or field.coloured:
        totals = sum_beams(field.beams, field.groups, at)
    else:
        totals = [mi.Color3f(0) for _ in range(field.groups)]
        for k in range(CELLS_PER_SAMPLE):
            number = points.number * CELLS_PER_SAMPLE + k
            beside, _, lit = _interpolating_cell(field.cells, base, seen, points, number)
            light = sum_diffuse(
                field.irradiance, field.groups, replace(at, cell=beside, active=lit)
            )
            totals = [
                one + each / CELLS_PER_SAMPLE for one, each in zip(totals, light, strict=True)
            ]
    if indenters is None:
        return totals
    shadow_rays = dr.opaque(mi.Float, REFLECTED_SHADOW_RAYS if reflected else SHADOW_RAYS)
    hidden = sum_hidden(culled_beams, totals, indenters.scene, at, shadow_rays)
    # Where all is hidden, the sum of the shares may be a little more than all.
    return [dr.maximum(one - other, 0) for one, other in zip(totals, hidden, strict=True)]


def _interpolating_cell(
    cells: SurfaceCells,
    base: mi.Point3f,
    active: mi.Bool,
    points: VisiblePoints,
    number: mi.UInt32,
) -> tuple[mi.UInt32, mi.Vector3f, mi.Bool]:
    """A random cell next to points, the shift that led there, and whether there is one.

    It is the same for all bins, as light that straddles two bins must not be counted twice. Over
    the
    samples of a pixel, which are spread evenly, this interpolates between cells.
    """
    home, found = cell_at(cells, base, active)
    upright, _ = plane_of(cells, home, found)
    shift = mi.Vector3f(*(in_series(points.series, number, 1 + k) for k in range(3)))
    shift = (shift - 0.5) * dr.rcp(cells.inverse_size)
    shift -= upright * dr.dot(upright, shift)
    beside, exists = cell_at(cells, base + shift, found)
    return dr.select(exists, beside, home), shift, found
