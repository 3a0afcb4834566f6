"""What visible points make of the light field: tilt, shadows, and light exchanged inside a contact.

A visible point sums the field over bins of directions and reflects each with its own normal. On
an indenter, which stands off the undeformed surface, a bin is looked up where the light's line
goes on to meet that surface. A shadow ray tests whether an indenter is in the way; it is drawn
within the bin's spread, so that lights of some size cast soft shadows. Directions in which a
point sees an indenter or, from an indenter, the near skin are sampled once more: the light that
comes from there is the field, shaded at that other place.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from optisense.optics.cells import SurfaceCells, cell_at
from optisense.optics.light_field import LightField
from optisense.optics.ray_scene import RayScene, leave
from optisense.optics.sampling import unit_float
from optisense.optics.scattering import (
    Coating,
    coating_of,
    evaluate_coating,
    sample_coating,
    surface_region,
)
from optisense.optics.surfaces import Region
from optisense.optics.visible_points import VisiblePoints

CHOSEN_BINS = 24.0
"""Bins of each light group that a camera sample near a contact follows with rays."""


@dataclass
class ContactScenes:
    """Ray scenes of one image: ``full`` has everything, ``fixed`` the opaque surfaces without
    indenters, ``indenters`` these alone (None without contacts); ``indenter_surface`` is their
    surface number; ``balls`` holds centre and radius of a ball around each, four floats a
    ball."""

    full: RayScene
    fixed: RayScene
    indenters: RayScene | None
    indenter_surface: int
    balls: mi.Float


@dr.syntax
def _sum_all(
    field: LightField,
    tables: tuple[mi.Float, mi.Float],
    bins: mi.UInt32,
    groups: int,
    coloured: bool,
    indenters: mi.Scene,
    balls: mi.Float,
    ball_count: int,
    coating: Coating,
    points: VisiblePoints,
    start: mi.Point3f,
    cell: mi.UInt32,
    active: mi.Bool,
    random: mi.UInt32,
) -> list[mi.Color3f]:
    """Every bin of the field, for points on the undeformed surface."""
    moments, colours = tables
    totals = [mi.Color3f(0) for _ in range(groups)]
    state = mi.UInt32(random)
    k = mi.UInt32(0)
    while active & (k < bins):
        for g in range(groups):
            entry = (cell * bins + k) * groups + g
            value = dr.gather(mi.Vector4f, moments, entry, active)
            if value.w > 0:
                towards, spread2 = beam(value)
                reflected = evaluate_coating(
                    widened(coating, spread2), points.normal, towards, points.towards_eye
                )
                seen = dr.max(reflected) > 0
                if dr.hint(ball_count > 0, mode="scalar"):
                    near = mi.Bool(False)
                    for n in range(ball_count):
                        ball = dr.gather(mi.Vector4f, balls, n)
                        offset = mi.Point3f(ball.x, ball.y, ball.z) - start
                        along = dr.dot(offset, towards)
                        # The margin covers the spread of the beam over the way to the ball.
                        reach = ball.w + along * dr.sqrt(spread2)
                        gap2 = dr.squared_norm(offset) - along * along
                        near |= (along > -ball.w) & (gap2 < reach * reach)
                    if seen & near:
                        state = next_random(state)
                        blocked = indenters.ray_test(
                            mi.Ray3f(start, within(towards, spread2, state)),
                            coherent=False,
                            active=mi.Bool(True),
                        )
                        seen &= ~blocked
                if dr.hint(coloured, mode="scalar"):
                    flux = dr.gather(mi.Vector4f, colours, entry)
                    reflected *= mi.Color3f(flux.x, flux.y, flux.z)
                else:
                    reflected *= value.w
                totals[g] += dr.select(seen, reflected, 0)
        k += 1
    return totals


@dr.syntax
def _sum_chosen(
    cells: SurfaceCells,
    tables: tuple[mi.Float, mi.Float],
    centres: mi.Float,
    bins: mi.UInt32,
    groups: int,
    coloured: bool,
    indenters: mi.Scene,
    fixed: mi.Scene,
    coating: Coating,
    points: VisiblePoints,
    start: mi.Point3f,
    cell: mi.UInt32,
    active: mi.Bool,
    raised: mi.Bool,
    shift: mi.Vector3f,
    random: mi.UInt32,
    chosen: mi.Float,
) -> list[mi.Color3f]:
    """Bins drawn in proportion to what they bring, evenly spaced in their running sum.

    This is systematic sampling; each bin drawn is looked up along its line and tested with rays.
    """
    moments, colours = tables
    totals = [mi.Color3f(0) for _ in range(groups)]
    state = mi.UInt32(random)
    for g in range(groups):
        expected = mi.Float(0)
        k = mi.UInt32(0)
        while active & (k < bins):
            value = dr.gather(mi.Vector4f, moments, (cell * bins + k) * groups + g, active)
            if value.w > 0:
                towards, spread2 = beam(value)
                reflected = evaluate_coating(
                    widened(coating, spread2), points.normal, towards, points.towards_eye
                )
                expected += value.w * dr.mean(reflected)
            k += 1
        step = expected / chosen
        state = next_random(state)
        running = unit_float(state)
        k = mi.UInt32(0)
        while active & (expected > 0) & (k < bins):
            entry = (cell * bins + k) * groups + g
            value = dr.gather(mi.Vector4f, moments, entry, active)
            known = value.w > 0
            middle = dr.gather(mi.Vector4f, centres, k)
            value = dr.select(known, value, mi.Vector4f(middle.x, middle.y, middle.z, 1))
            towards, spread2 = beam(value)
            reflected = evaluate_coating(
                widened(coating, spread2), points.normal, towards, points.towards_eye
            )
            bright = dr.mean(reflected)
            # A bin that is dark here may be lit where an indenter's point looks it up: keep a
            # small chance.
            share = dr.select(known, value.w * bright / step, dr.select(raised, 0.05, 0))
            share = dr.select(bright > 0, share, 0)
            before = dr.floor(running)
            running += share
            times = dr.floor(running) - before
            if times > 0:
                usable = mi.Bool(known)
                if raised:
                    # Follow the light's line on to the undeformed surface and look there.
                    below = fixed.ray_intersect_preliminary(
                        mi.Ray3f(points.point, -towards), coherent=False, active=mi.Bool(True)
                    )
                    reached = below.is_valid()
                    landing = points.point - towards * dr.select(reached, below.t, 0)
                    there, exists = cell_at(cells, landing + shift, reached)
                    if exists:
                        entry = (there * bins + k) * groups + g
                        value = dr.gather(mi.Vector4f, moments, entry)
                        usable = value.w > 0
                        towards, spread2 = beam(
                            dr.select(usable, value, mi.Vector4f(middle.x, middle.y, middle.z, 1))
                        )
                        reflected = evaluate_coating(
                            widened(coating, spread2), points.normal, towards, points.towards_eye
                        )
                if usable:
                    state = next_random(state)
                    blocked = indenters.ray_test(
                        mi.Ray3f(start, within(towards, spread2, state)),
                        coherent=False,
                        active=mi.Bool(True),
                    )
                    weight = dr.select(blocked, 0.0, times / share)
                    if dr.hint(coloured, mode="scalar"):
                        flux = dr.gather(mi.Vector4f, colours, entry)
                        reflected *= mi.Color3f(flux.x, flux.y, flux.z)
                    else:
                        reflected *= value.w
                    totals[g] += reflected * weight
            k += 1
    return totals


def beam(value: mi.Vector4f) -> tuple[mi.Vector3f, mi.Float]:
    """Mean direction of an entry of the field, and the squared angular radius of a disc that
    has its mean cosine.
    """
    mean = mi.Vector3f(value.x, value.y, value.z)
    length = dr.norm(mean)
    # The mean cosine over a disc of radius R is 1 - R^2 / 4.
    return mean / length, 4 * dr.clip(1 - length / value.w, 0.0, 0.1)


def widened(coating: Coating, spread2: mi.Float) -> Coating:
    """A coating whose metallic lobe is blurred as if by light from a disc.

    The half vector moves half as far as the light, which adds R^2 / 8 to alpha^2.
    """
    alpha = dr.sqrt(coating.alpha * coating.alpha + spread2 * 0.125)
    return Coating(
        coating.reflectance, coating.metal_eta, coating.metal_k, coating.specularity, alpha
    )


def next_random(state: mi.UInt32) -> mi.UInt32:
    """The next state of a small generator (the step of PCG)."""
    return state * 747796405 + 2891336453


def within(towards: mi.Vector3f, spread2: mi.Float, state: mi.UInt32) -> mi.Vector3f:
    """A direction drawn evenly from the disc about ``towards``."""
    radius = dr.sqrt(spread2 * unit_float((state ^ 0x9E3779B9) * 69069))
    sin_a, cos_a = dr.sincos(unit_float(state * 277803737) * dr.two_pi)
    frame = mi.Frame3f(towards)
    return dr.normalize(towards + frame.s * (radius * cos_a) + frame.t * (radius * sin_a))


def _shade_field(
    field: LightField, scenes: ContactScenes, points: VisiblePoints, seed: int, thorough: bool
) -> list[mi.Color3f]:
    """The field's own light at points, one colour a group; ``thorough`` points may be on
    indenters.
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
    random = mi.sample_tea_32(
        dr.arange(mi.UInt32, dr.width(points.point)), dr.opaque(mi.UInt32, seed)
    )[0]
    cell, shift, active = _interpolating_cell(field.cells, base, active, random)
    start = leave(points.point, points.face_normal, points.face_normal)
    coating = coating_of(table, points.surface, active)
    tables = (field.moments, field.colours)
    bins = dr.opaque(mi.UInt32, field.bins)
    indenters = scenes.indenters
    if thorough:
        assert indenters is not None
        return _sum_chosen(
            field.cells,
            tables,
            field.centres,
            bins,
            field.groups,
            field.coloured,
            indenters.scene,
            scenes.fixed.scene,
            coating,
            points,
            start,
            cell,
            active,
            raised,
            shift,
            random,
            dr.opaque(mi.Float, CHOSEN_BINS),
        )
    return _sum_all(
        field,
        tables,
        bins,
        field.groups,
        field.coloured,
        scenes.fixed.scene if indenters is None else indenters.scene,
        # A loop takes no empty array.
        scenes.balls if dr.width(scenes.balls) else dr.zeros(mi.Float, 4),
        dr.width(scenes.balls) // 4,
        coating,
        points,
        start,
        cell,
        active,
        random,
    )


def _interpolating_cell(
    cells: SurfaceCells, base: mi.Point3f, active: mi.Bool, random: mi.UInt32
) -> tuple[mi.UInt32, mi.Vector3f, mi.Bool]:
    """A random cell next to points, how far it was moved, and whether there is one.

    The same for all bins, as light that straddles two bins must not be taken twice; over the
    samples of a pixel this interpolates between cells.
    """
    home, found = cell_at(cells, base, active)
    upright = dr.gather(mi.Vector4f, cells.normals, home, found)
    upright = mi.Vector3f(upright.x, upright.y, upright.z)
    shift = mi.Vector3f(
        unit_float(random),
        unit_float(random * 277803737),
        unit_float((random ^ 0x9E3779B9) * 69069),
    )
    shift = (shift - 0.5) * dr.rcp(cells.inverse_size)
    shift -= upright * dr.dot(upright, shift)
    beside, exists = cell_at(cells, base + shift, found)
    return dr.select(exists, beside, home), shift, found


def _exchanged(
    field: LightField, scenes: ContactScenes, points: VisiblePoints, seed: int
) -> list[mi.Color3f] | None:
    """Light that reaches points by way of an indenter, or indenters by way of the near skin
    (one sample each).
    """
    assert scenes.indenters is not None
    table = scenes.full.table
    count = dr.width(points.point)
    rng = mi.PCG32(size=count, initstate=dr.opaque(mi.UInt64, seed))
    coating = coating_of(table, points.surface, points.valid)
    sample = mi.Point2f(rng.next_float32(), rng.next_float32())
    way, albedo = sample_coating(
        coating, points.normal, -points.towards_eye, rng.next_float32(), sample
    )
    usable = points.valid & (dr.dot(way, points.face_normal) > 0) & (dr.max(albedo) > 0)
    start = leave(points.point, points.face_normal, way)
    pressed = scenes.indenters.intersect(start, way, usable)
    raised = surface_region(table, points.surface, usable) == int(Region.INDENTER)
    skin = scenes.fixed.intersect(start, way, usable & raised)
    behind = scenes.fixed.occluded(start, -way, mi.Float(1e6), usable & raised)
    on_indenter = pressed.valid & (~skin.valid | (pressed.distance < skin.distance))
    on_skin = skin.valid & ~on_indenter & ~behind
    hit_surface = dr.select(on_indenter, scenes.indenter_surface, skin.surface)
    lanes = dr.compress(on_indenter | on_skin)
    if dr.width(lanes) == 0:
        return None
    facing = dr.select(on_indenter, pressed.normal, skin.normal)
    side = -dr.sign(dr.dot(way, facing))
    shading = dr.select(on_indenter, pressed.shading_normal, skin.shading_normal)
    met = VisiblePoints(
        pixel=dr.gather(mi.UInt32, dr.arange(mi.UInt32, count), lanes),
        valid=dr.full(mi.Bool, True, dr.width(lanes)),
        weight=dr.gather(mi.Color3f, albedo, lanes),
        point=dr.gather(
            mi.Point3f, mi.Point3f(dr.select(on_indenter, pressed.point, skin.point)), lanes
        ),
        normal=dr.gather(mi.Vector3f, mi.Vector3f(shading * side), lanes),
        face_normal=dr.gather(mi.Vector3f, mi.Vector3f(facing * side), lanes),
        towards_eye=dr.gather(mi.Vector3f, mi.Vector3f(-way), lanes),
        surface=dr.gather(mi.UInt32, hit_surface, lanes),
        light=dr.zeros(mi.UInt32, dr.width(lanes)),
    )
    out = []
    for light in _shade_field(field, scenes, met, seed + 1, True):
        channels = [dr.zeros(mi.Float, count) for _ in range(3)]
        for k in range(3):
            dr.scatter(channels[k], light[k] * met.weight[k], met.pixel)
        out.append(mi.Color3f(*channels))
    return out


def shade(
    field: LightField, scenes: ContactScenes, points: VisiblePoints, seed: int, thorough: bool
) -> list[mi.Color3f]:
    """Radiance of visible points towards the eye, for each light group with lights of 1 mW.

    ``thorough`` is for points on and near indenters: each bin is looked up along its own line,
    and light that indenters and the skin near them send to each other is added.
    """
    totals = _shade_field(field, scenes, points, seed, thorough)
    dr.eval(totals)
    if thorough:
        more = _exchanged(field, scenes, points, seed + 7)
        if more is not None:
            totals = [a + b for a, b in zip(totals, more, strict=True)]
    return totals
