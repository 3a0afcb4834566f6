"""Sums over direction bins for points in and near contacts."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import GOLDEN_BITS, next_random, richtmyer
from optisense.optics.radiance_cache._irradiance import irradiance
from optisense.optics.radiance_cache._raised_plane import (
    below_crossing,
    raised_height,
    sampled_plane,
)
from optisense.optics.radiance_cache.angular_variance import (
    AngularVariance,
    angular_variance,
    broadened_coating,
    coating_with_broadened_tail,
    cosine_half_width,
    mean_direction,
    mirrored_above,
    occluder_horizon,
    reflected_from_discs,
    sample_direction,
    squared_radius,
)
from optisense.optics.radiance_cache.beam_sums import MIN_STEP
from optisense.optics.radiance_cache.cache import BinnedLight
from optisense.optics.radiance_cache.shading_points import ShadingPoints
from optisense.optics.scene.coating_bsdf import albedo_of, evaluate_coating, grey
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.scene.surface_cells import bin_axis, cell_at, plane_of
from optisense.optics.transport.volume_flux import layer_height

MIN_IRRADIANCE_SHARE = 0.2
"""Share of the mean irradiance that is added to the expected light when shadow rays are spaced, so
that points that face away from most of the light take fewer rays than others."""
MAX_EXTRAPOLATION = 1.5
"""Largest height, in units of half the flux layer's height, up to which the light above the surface
is extrapolated from the surface and the middle of the layer; it is constant above. With 1.5, that
is 0.75 mm, about the depth of usual contacts."""
MIN_SINE = 0.1
"""Lower bound on the sine of elevation (6 degrees) used for the length of the path from a point on
an indenter to the undeformed surface: light that is lower meets another indenter or a wall first.
"""


def sum_bins(
    light: BinnedLight, scenes: ContactScenes, at: ShadingPoints, shadow_rays: float
) -> list[mi.Color3f]:
    """Return the radiance (3, n) towards the camera due to the direction bins, for each group.

    Each bin is looked up where the line along its middle direction meets the undeformed surface.
    Shadow rays test the bins that are not wholly above the occluder horizon. They are drawn in
    proportion to the light, evenly spaced in its running sum (systematic sampling); without
    occlusion, the sum is exact to half a step.

    If the cache also holds the light in the raised plane, points on indenters look up either plane,
    at random. If it holds the light half-way up the flux layer, they interpolate between that light
    and the light on the surface below them.

    Args:
        scenes: the scenes of the image, with indenters.
        shadow_rays: number of shadow rays of each point and light group.
    """
    horizon = occluder_horizon(
        scenes.balls,
        dr.opaque(mi.UInt32, dr.width(scenes.balls) // 4),
        at.seen.point,
        plane_of(light.cells, at.cell, at.active)[0],
        at.raised & dr.opaque(mi.Bool, scenes.convex),
    )
    return _sum_bins(light, scenes, at, dr.opaque(mi.Float, shadow_rays), horizon)


@dr.syntax(recursive=True)
def _sum_bins(
    light: BinnedLight,
    scenes: ContactScenes,
    at: ShadingPoints,
    shadow_rays: mi.Float,
    horizon: mi.Float,
) -> list[mi.Color3f]:
    """Return the result of `sum_bins` for points with a horizon (n,)."""
    moments, heights, colours = light.tables
    upper, groups, bins, points = light.above, light.groups, light.bins, at.seen
    assert scenes.indenters is not None
    indenters, active, raised = scenes.indenters, at.active, at.raised
    totals = [mi.Color3f(0) for _ in range(groups)]
    steps = []
    running = []
    for g in range(groups):
        # The expected sum over the bins, divided by the number of shadow rays, is their spacing in
        # the running sum.
        falling, mean, _ = irradiance(light.irradiance, at.cell * groups + g, points.normal)
        expected = (falling + MIN_IRRADIANCE_SHARE * mean) * grey(albedo_of(at.coating))
        expected *= dr.inv_pi
        steps.append(dr.maximum(expected / shadow_rays, MIN_STEP))
        # Each sample of a pixel begins at another fraction of a step.
        running.append(richtmyer(points.series + (g + 1), points.number, 0))
    surface_normal, offset = plane_of(light.cells, at.cell, active)
    point_height = dr.dot(surface_normal, points.point) - offset
    # Share of the upper light: 0 on the surface, 1 at the middle of the flux layer.
    interpolation = dr.select(raised, point_height / (layer_height(light.cells) / 2), 0)
    interpolation = dr.clip(interpolation, 0, MAX_EXTRAPOLATION)
    axis = bin_axis(light.cells, 2)
    level, first = mi.Float(0), mi.UInt32(0)
    if dr.hint(light.planes > 1, mode="scalar"):
        above = sampled_plane(light.cells, points, point_height, raised)
        level = dr.select(above, raised_height(light.cells), 0)
        first = dr.select(above, dr.opaque(mi.UInt32, light.cells.cells), 0)

    # The loop's state holds only what it changes (see docs/architecture.md).
    def over_bins(
        k: mi.UInt32, running: list[mi.Float], totals: list[mi.Color3f]
    ) -> list[mi.Color3f]:
        while active & (k < bins):
            there = mi.UInt32(at.cell)
            if dr.hint(upper is None, mode="scalar"):
                there = _place(light, scenes.fixed, at, k, level, first)
            for g in range(groups):
                entry = (there * bins + k) * groups + g
                value = dr.gather(mi.Vector4f, moments, entry, active)
                counts = value.w != 0
                if dr.hint(upper is not None, mode="scalar"):
                    assert upper is not None
                    above_it = dr.gather(mi.Vector4f, upper[0], entry, active & raised)
                    # Extrapolation never turns positive light negative.
                    negative = dr.minimum(value.w, above_it.w) < 0
                    value = dr.lerp(value, above_it, interpolation)
                    counts = (value.w > 0) | (negative & (value.w < 0))
                if counts:
                    towards, cosine = mean_direction(value)
                    height = dr.gather(mi.Float, heights, entry)
                    if dr.hint(upper is not None, mode="scalar"):
                        assert upper is not None
                        height = dr.lerp(
                            height, dr.gather(mi.Float, upper[1], entry, raised), interpolation
                        )
                    height = dr.maximum(height / value.w, 0)
                    beam = angular_variance(axis, towards, cosine, height)
                    # On the undeformed surface the sum over bins already has the right mean cosine.
                    half_width = dr.select(
                        raised, cosine_half_width(beam, points.normal, surface_normal), 0
                    )
                    reflected = _reflected(light, at, beam, cosine, half_width)
                    sine = dr.dot(surface_normal, towards)
                    may_be_occluded = sine - dr.sqrt(squared_radius(cosine)) < horizon
                    weight = dr.select(may_be_occluded, mi.Float(0), 1)
                    share = dr.abs(value.w) * grey(reflected) / steps[g]
                    before = dr.floor(running[g])
                    running[g] += dr.select(may_be_occluded, share, 0)
                    times = dr.floor(running[g]) - before
                    if times > 0:
                        # Each bin has random bits of its own, so that a ray or a bin added or
                        # dropped by rounding does not change the others.
                        number = dr.reinterpret_array(
                            mi.UInt32, dr.gather(mi.Float, light.centres, k * 4 + 3)
                        )
                        state = next_random(points.random + (number * groups + g) * GOLDEN_BITS)
                        direction = mirrored_above(
                            sample_direction(beam, state), points.face_normal
                        )
                        blocked = indenters.occluded(at.start, direction, mi.Bool(True))
                        weight = dr.select(blocked, 0.0, times / share)
                    if dr.hint(light.coloured, mode="scalar"):
                        flux = dr.gather(mi.Vector4f, colours, entry)
                        if dr.hint(upper is not None, mode="scalar"):
                            assert upper is not None
                            flux = dr.lerp(
                                flux, dr.gather(mi.Vector4f, upper[2], entry, raised), interpolation
                            )
                        reflected *= mi.Color3f(flux.x, flux.y, flux.z)
                    else:
                        reflected *= value.w
                    if dr.hint(scenes.absorption is not None and upper is None, mode="scalar"):
                        reflected *= _shorter_path_factor(scenes, point_height, sine)
                    totals[g] += reflected * weight
            k += 1
        return totals

    return over_bins(mi.UInt32(0), running, totals)


def _reflected(
    light: BinnedLight,
    at: ShadingPoints,
    beam: AngularVariance,
    cosine: mi.Float,
    half_width: mi.Float,
) -> mi.Color3f:
    """Return the radiance that the coating reflects towards the camera of a beam of unit flux
    density.

    Args:
        cosine, half_width: middle and half-width of the distribution of the beam's cosine.
    """
    points = at.seen
    if at.coating.only_tail:
        coating = coating_with_broadened_tail(at.coating, beam, cosine)
        return evaluate_coating(
            coating, points.normal, beam.towards, points.towards_eye, half_width
        )
    if light.narrow_lobes:
        return reflected_from_discs(
            at.coating, beam, cosine, points.normal, points.towards_eye, half_width
        )
    coating = broadened_coating(at.coating, cosine)
    return evaluate_coating(coating, points.normal, beam.towards, points.towards_eye, half_width)


def _shorter_path_factor(scenes: ContactScenes, height: mi.Float, sine: mi.Float) -> mi.Color3f:
    """Return by how much light is stronger at a height (mm) above the skin, in an absorbing gel.

    Args:
        sine: sine of the light's elevation above the undeformed surface.
    """
    shortened = dr.maximum(height, 0) / dr.maximum(sine, MIN_SINE)
    return dr.exp(scenes.absorption * shortened)


@dr.syntax
def _place(
    light: BinnedLight,
    fixed: RayScene,
    at: ShadingPoints,
    k: mi.UInt32,
    level: mi.Float,
    first: mi.UInt32,
) -> mi.UInt32:
    """Return the number of the cell in which bin ``k`` is looked up for each point.

    For a point on an indenter, it is the cell where the line through the point along the bin's
    middle direction meets the undeformed surface, or the plane at the height ``level`` (mm) above
    it; the planes of two cells are intersected in turn.
    On a curved surface, lines that graze these planes are traced as rays. (The mean direction of
    the bin's light is not used: where a lamp straddles two bins, its halves would be looked up at
    places that do not match.)
    """
    cells, point = light.cells, at.seen.point
    middle = dr.gather(mi.Vector4f, light.centres, k)
    towards = mi.Vector3f(middle.x, middle.y, middle.z)
    exists = at.active & at.raised
    there, exists = below_crossing(
        cells, at.cell, point, towards, level, exists, fixed.smooth, at.shift
    )
    if dr.hint(fixed.smooth, mode="scalar"):  # noqa: SIM102 (the one is Python's, the other Dr.Jit's)
        if at.active & at.raised & ~exists:
            distance, reached = fixed.hit_distance(point, -towards)
            landing = point - towards * dr.select(reached, distance, 0)
            there, exists = cell_at(cells, landing + at.shift, reached)
            first = mi.UInt32(0)
    return first + dr.select(exists, there, at.cell)
