"""What visible points make of the light field: tilt, shadows, and light exchanged inside a contact.

A visible point sums the field over bins of directions and reflects each with its own normal. On
an indenter, which stands off the undeformed surface, a bin is looked up where the light's line
goes on to meet that surface. A shadow ray tests whether an indenter is in the way; it is drawn
within the bin's spread, so that lights of some size cast soft shadows. Directions in which a
point sees an indenter or, from an indenter, the near skin are sampled once more: the light that
comes from there is the field, shaded at that other place.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import in_series, next_random
from optisense.optics.radiance_cache.angular_variance import (
    above,
    beam,
    reach,
    skyline,
    spread,
    squared_radius,
    widened,
    within,
)
from optisense.optics.radiance_cache.beam_sums import sum_beams, sum_diffuse, sum_hidden
from optisense.optics.radiance_cache.beams import Beams
from optisense.optics.radiance_cache.cache import LEAST_COSINE, LightField
from optisense.optics.radiance_cache.interreflection import exchanged
from optisense.optics.radiance_cache.irradiance import irradiance
from optisense.optics.scene.bsdf import (
    Coating,
    albedo_of,
    coating_of,
    evaluate_coating,
    grey,
    surface_region,
)
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import leave
from optisense.optics.scene.surface_cells import SurfaceCells, bin_axis, cell_at, plane_of
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.camera_paths import VisiblePoints
from optisense.optics.transport.volume_flux import HEIGHT

LEAST_LIGHT = 0.2
"""Part of the mean irradiance below which the spacing of shadow rays does not go."""
CHOSEN_BINS = 16.0
"""Shadow rays of each light group for a camera sample near a contact."""
SHADOW_RAYS = 32.0
"""The same for a sample elsewhere, most of which pass no indenter and are not traced."""
REFLECTED_SHADOW_RAYS = 4.0
"""The same for points that are seen in a reflection, of which little reaches the eye."""
CELLS_OF_SAMPLE = 8
"""Cells that a sample of diffuse light reads, where reading one is cheap: its mean is smooth."""
MOST_UP = 1.5
"""Of half the slab's height, up to which the light is extrapolated; it stays the same above."""
LEAST_STEP = 1e-20
"""Of that spacing, where there is no light."""


@dr.syntax
def _sum_chosen(
    cells: SurfaceCells,
    tables: tuple[mi.Float, mi.Float, mi.Float],
    upper: tuple[mi.Float, mi.Float, mi.Float] | None,
    centres: mi.Float,
    table: mi.Float,
    bins: mi.UInt32,
    groups: int,
    coloured: bool,
    indenters: mi.Scene,
    fixed: mi.Scene,
    curved: bool,
    coating: Coating,
    points: VisiblePoints,
    start: mi.Point3f,
    cell: mi.UInt32,
    active: mi.Bool,
    raised: mi.Bool,
    shift: mi.Vector3f,
    random: mi.UInt32,
    chosen: mi.Float,
    sky: mi.Float,
) -> list[mi.Color3f]:
    """Every bin, looked up along its own line, and shadow rays for some of those that are not
    wholly above the skyline (``sky``, a sine).

    With ``upper`` tables, of the light half-way up the slab, raised points take what lies between
    these and those on the surface below them instead.

    These are drawn in proportion to what they bring, evenly spaced in the running sum (systematic
    sampling), so that where nothing is hidden, the sum is exact to half a step.
    """
    moments, heights, colours = tables
    totals = [mi.Color3f(0) for _ in range(groups)]
    state = mi.UInt32(random)
    steps = []
    running = []
    for g in range(groups):
        # About what the bins bring in all: how far apart the shadow rays are in the running sum.
        falling, mean, _ = irradiance(table, cell * groups + g, points.normal)
        expected = (falling + LEAST_LIGHT * mean) * grey(albedo_of(coating)) * dr.inv_pi
        steps.append(dr.maximum(expected / chosen, LEAST_STEP))
        # Of the samples of a pixel, each begins at another part of a step.
        running.append(in_series(points.series + (g + 1), points.number, 0))
    upright, offset = plane_of(cells, cell, active)
    up = dr.select(raised, (dr.dot(upright, points.point) - offset) / (HEIGHT / 2), 0)
    up = dr.clip(up, 0, MOST_UP)
    axis = bin_axis(cells, 2)
    k = mi.UInt32(0)
    while active & (k < bins):
        there = mi.UInt32(cell)
        if upper is None:
            there = _place(
                cells,
                centres,
                fixed,
                curved,
                points,
                cell,
                shift,
                raised,
                active,
                k,
            )
        for g in range(groups):
            entry = (there * bins + k) * groups + g
            value = dr.gather(mi.Vector4f, moments, entry, active)
            if upper is not None:
                above_it = dr.gather(mi.Vector4f, upper[0], entry, active & raised)
                value = dr.lerp(value, above_it, up)
            if value.w > 0:
                towards, cosine = beam(value)
                height = dr.gather(mi.Float, heights, entry)
                if upper is not None:
                    height = dr.lerp(height, dr.gather(mi.Float, upper[1], entry, raised), up)
                height = dr.maximum(height, 0) / value.w
                light = spread(axis, towards, cosine, height)
                # On the undeformed surface the mean cosine is the sum's already.
                straying = dr.select(raised, reach(light, points.normal, upright), 0)
                reflected = evaluate_coating(
                    widened(coating, cosine), points.normal, towards, points.towards_eye, straying
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
                    way = above(within(light, state), points.face_normal)
                    blocked = indenters.ray_test(
                        mi.Ray3f(start, way),
                        coherent=False,
                        active=mi.Bool(True),
                    )
                    weight = dr.select(blocked, 0.0, times / share)
                if dr.hint(coloured, mode="scalar"):
                    flux = dr.gather(mi.Vector4f, colours, entry)
                    if upper is not None:
                        flux = dr.lerp(flux, dr.gather(mi.Vector4f, upper[2], entry, raised), up)
                    reflected *= mi.Color3f(flux.x, flux.y, flux.z)
                else:
                    reflected *= value.w
                totals[g] += reflected * weight
        k += 1
    return totals


@dr.syntax
def _place(
    cells: SurfaceCells,
    centres: mi.Float,
    fixed: mi.Scene,
    curved: bool,
    points: VisiblePoints,
    cell: mi.UInt32,
    shift: mi.Vector3f,
    raised: mi.Bool,
    active: mi.Bool,
    k: mi.UInt32,
) -> mi.UInt32:
    """The cell where bin ``k`` is looked up for points.

    On an indenter that is where the line through the point along the bin's middle goes on to meet
    the undeformed surface, found on the planes of two cells in turn; on a curved surface, lines
    that graze these planes are followed by a ray. (The middle of what light the bin holds would
    not do: where a lamp straddles two bins, its halves would be read at places that do not belong
    together.)
    """
    middle = dr.gather(mi.Vector4f, centres, k)
    towards = mi.Vector3f(middle.x, middle.y, middle.z)
    there = mi.UInt32(cell)
    exists = active & raised
    for _ in range(2 if curved else 1):
        normal, offset = plane_of(cells, there, exists)
        facing = dr.dot(normal, towards)
        exists &= facing > LEAST_COSINE
        way = (dr.dot(normal, points.point) - offset) / dr.maximum(facing, LEAST_COSINE)
        there, found = cell_at(cells, points.point - towards * way + shift, exists)
        exists &= found
    if dr.hint(curved, mode="scalar"):  # noqa: SIM102 (the one is Python's, the other Dr.Jit's)
        if active & raised & ~exists:
            below = fixed.ray_intersect_preliminary(
                mi.Ray3f(points.point, -towards), coherent=False, active=mi.Bool(True)
            )
            reached = below.is_valid()
            landing = points.point - towards * dr.select(reached, below.t, 0)
            there, exists = cell_at(cells, landing + shift, reached)
    return dr.select(exists, there, cell)


def shade(
    field: LightField,
    scenes: ContactScenes,
    near_beams: Beams,
    points: VisiblePoints,
    thorough: bool,
    reflected: bool,
) -> list[mi.Color3f]:
    """Radiance of visible points towards the eye, for each light group with lights of 1 mW.

    ``near_beams`` are those of the field that pass near indenters (`beams_near`); ``reflected``
    points are seen in the reflection of an interface. ``thorough`` is for points on and near
    indenters: each bin is looked up along its own line, and light that indenters and the skin near
    them send to each other is added.
    """
    table = scenes.full.table
    active, base, raised = points.valid, points.point, mi.Bool(False)
    if thorough:
        region = surface_region(table, points.surface, points.valid)
        raised = points.valid & (region == int(Region.INDENTER))
        # Behind an indenter, along the line of sight, lies the undeformed surface that the eye
        # would have met.
        onward = scenes.fixed.intersect(points.point, -points.towards_eye, raised)
        base = dr.select(raised & onward.valid, onward.point, points.point)
    seen = active
    cell, shift, active = _interpolating_cell(field.cells, base, seen, points, points.number)
    start = leave(points.point, points.face_normal, points.face_normal)
    coating = coating_of(table, points.surface, active, field.metallic)
    tables = (field.moments, field.heights, field.colours)
    bins = dr.opaque(mi.UInt32, field.bins)
    indenters = scenes.indenters
    if thorough:
        assert indenters is not None
        far = _sum_chosen(
            field.cells,
            tables,
            field.raised,
            field.centres,
            field.irradiance,
            bins,
            field.groups,
            field.coloured,
            indenters.scene,
            scenes.fixed.scene,
            scenes.fixed.smooth,
            coating,
            points,
            start,
            cell,
            active,
            raised,
            shift,
            points.random,
            dr.opaque(mi.Float, CHOSEN_BINS),
            skyline(
                scenes.balls,
                dr.opaque(mi.UInt32, dr.width(scenes.balls) // 4),
                points.point,
                plane_of(field.cells, cell, active)[0],
                raised & dr.opaque(mi.Bool, scenes.convex),
            ),
        )
        near = exchanged(field, scenes, points, coating, cell, active, raised)
        return [one + other for one, other in zip(far, near, strict=True)]
    where = (coating, points, cell, active)
    totals: list[mi.Color3f]
    if field.metallic or field.coloured:
        totals = sum_beams(field.beams, field.groups, *where)
    else:
        totals = [mi.Color3f(0) for _ in range(field.groups)]
        for k in range(CELLS_OF_SAMPLE):
            number = points.number * CELLS_OF_SAMPLE + k
            beside, _, lit = _interpolating_cell(field.cells, base, seen, points, number)
            light = sum_diffuse(field.irradiance, field.groups, coating, points, beside, lit)
            totals = [one + each / CELLS_OF_SAMPLE for one, each in zip(totals, light, strict=True)]
    if indenters is None:
        return totals
    hidden = sum_hidden(
        near_beams,
        totals,
        indenters.scene,
        coating,
        points,
        start,
        cell,
        active,
        points.random,
        dr.opaque(mi.Float, REFLECTED_SHADOW_RAYS if reflected else SHADOW_RAYS),
    )
    # Where all is hidden, the sum of the shares may be a little more than all.
    return [dr.maximum(one - other, 0) for one, other in zip(totals, hidden, strict=True)]


def _interpolating_cell(
    cells: SurfaceCells,
    base: mi.Point3f,
    active: mi.Bool,
    points: VisiblePoints,
    number: mi.UInt32,
) -> tuple[mi.UInt32, mi.Vector3f, mi.Bool]:
    """A random cell next to points, how far these were moved, and whether there is one.

    The same for all bins, as light that straddles two bins must not be taken twice; over the
    samples of a pixel, which are spread evenly, this interpolates between cells.
    """
    home, found = cell_at(cells, base, active)
    upright, _ = plane_of(cells, home, found)
    shift = mi.Vector3f(*(in_series(points.series, number, 1 + k) for k in range(3)))
    shift = (shift - 0.5) * dr.rcp(cells.inverse_size)
    shift -= upright * dr.dot(upright, shift)
    beside, exists = cell_at(cells, base + shift, found)
    return dr.select(exists, beside, home), shift, found
