"""What visible points make of the light field: tilt, shadows, and light exchanged inside a contact.

A visible point sums the field over bins of directions and reflects each with its own normal. On an indenter, which
stands off the undeformed surface, a bin is looked up where the light's line goes on to meet that surface. A shadow ray
tests whether an indenter is in the way; it is drawn within the bin's spread, so that lights of some size cast soft shadows.
Directions in which a point sees an indenter or, from an indenter, the near skin are sampled
once more: the light that comes from there is the field, shaded at that other place.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from optisense.optics.light_field import FieldCells, LightField, cell_at
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


@dataclass
class ContactScenes:
    """Ray scenes of one image: ``full`` has everything, ``fixed`` the opaque surfaces without indenters,
    ``indenters`` these alone (None without contacts); ``indenter_surface`` is their surface number."""

    full: RayScene
    fixed: RayScene
    indenters: RayScene | None
    indenter_surface: int


@dr.syntax
def _sum_bins(
    cells: FieldCells,
    moments: mi.Float,
    colours: mi.Float,
    centres: mi.Float,
    bins: mi.UInt32,
    groups: int,
    coloured: bool,
    contacts: bool,
    indenters: mi.Scene,
    fixed: mi.Scene,
    coating: Coating,
    point: mi.Point3f,
    normal: mi.Vector3f,
    start: mi.Point3f,
    towards_eye: mi.Vector3f,
    active: mi.Bool,
    base: mi.Point3f,
    raised: mi.Bool,
    random: mi.UInt32,
):
    totals = [mi.Color3f(0) for _ in range(groups)]
    size = dr.rcp(cells.inverse_size)
    home, at_home = cell_at(cells, base, active)
    upright = dr.gather(mi.Vector4f, cells.normals, home, at_home)
    upright = mi.Vector3f(upright.x, upright.y, upright.z)
    # One random neighbouring cell a point, the same for all bins (light that straddles two bins must not be
    # taken twice): over the samples of a pixel this interpolates between cells.
    state = mi.UInt32(random)
    shift = mi.Vector3f(
        unit_float(state), unit_float(state * 277803737), unit_float((state ^ 0x9E3779B9) * 69069)
    )
    shift = (shift - 0.5) * size
    shift -= upright * dr.dot(upright, shift)
    cell, moved = cell_at(cells, base + shift, at_home)
    cell = dr.select(moved, cell, home)
    k = mi.UInt32(0)
    while at_home & (k < bins):
        for g in range(groups):
            entry = (cell * bins + k) * groups + g
            value = dr.gather(mi.Vector4f, moments, entry, at_home)
            if dr.hint(contacts, mode="scalar"):
                if raised:
                    # Follow the light's line on to the undeformed surface and look there.
                    middle = dr.gather(mi.Vector4f, centres, k)
                    known = value.w > 0
                    towards = dr.normalize(
                        mi.Vector3f(
                            dr.select(known, value.x, middle.x),
                            dr.select(known, value.y, middle.y),
                            dr.select(known, value.z, middle.z),
                        )
                    )
                    below = fixed.ray_intersect_preliminary(
                        mi.Ray3f(point, -towards), coherent=False, active=mi.Bool(True)
                    )
                    reached = below.is_valid()
                    landing = point - towards * dr.select(reached, below.t, 0)
                    there, exists = cell_at(cells, landing + shift, reached)
                    entry = dr.select(exists, (there * bins + k) * groups + g, entry)
                    value = dr.gather(mi.Vector4f, moments, entry)
            if value.w > 0:
                mean = mi.Vector3f(value.x, value.y, value.z)
                length = dr.norm(mean)
                towards = mean / length
                # A disc of this angular radius has the bin's mean cosine, 1 - R^2 / 4.
                spread2 = 4 * dr.clip(1 - length / value.w, 0.0, 0.1)
                wider = Coating(
                    coating.reflectance,
                    coating.metal_eta,
                    coating.metal_k,
                    coating.specularity,
                    # The half vector moves half as far as the light: its slopes add R^2 / 8 to alpha^2.
                    dr.sqrt(coating.alpha * coating.alpha + spread2 * 0.125),
                )
                reflected = evaluate_coating(wider, normal, towards, towards_eye)
                seen = dr.max(reflected) > 0
                if dr.hint(contacts, mode="scalar"):
                    if seen:
                        state = state * 747796405 + 2891336453
                        angle = unit_float(state * 277803737) * dr.two_pi
                        radius = dr.sqrt(spread2 * unit_float((state ^ 0x9E3779B9) * 69069))
                        sin_a, cos_a = dr.sincos(angle)
                        frame = mi.Frame3f(towards)
                        way = dr.normalize(
                            towards + frame.s * (radius * cos_a) + frame.t * (radius * sin_a)
                        )
                        blocked = indenters.ray_test(
                            mi.Ray3f(start, way), coherent=False, active=mi.Bool(True)
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


def _shade_field(
    field: LightField, scenes: ContactScenes, points: VisiblePoints, seed: int
) -> list[mi.Color3f]:
    """The field's own light at points, one colour a group."""
    table = scenes.full.table
    region = surface_region(table, points.surface, points.valid)
    raised = points.valid & (region == int(Region.INDENTER))
    # Behind an indenter, along the line of sight, lies the undeformed surface that the eye would have met.
    onward = scenes.fixed.intersect(points.point, -points.towards_eye, raised)
    base = dr.select(raised & onward.valid, onward.point, points.point)
    contacts = scenes.indenters is not None
    random = mi.sample_tea_32(
        dr.arange(mi.UInt32, dr.width(points.point)), dr.opaque(mi.UInt32, seed)
    )[0]
    return _sum_bins(
        field.cells,
        field.moments,
        field.colours,
        field.centres,
        dr.opaque(mi.UInt32, field.bins),
        field.groups,
        field.coloured,
        contacts,
        scenes.indenters.scene if scenes.indenters is not None else scenes.fixed.scene,
        scenes.fixed.scene,
        coating_of(table, points.surface, points.valid),
        points.point,
        points.normal,
        leave(points.point, points.face_normal, points.face_normal),
        points.towards_eye,
        points.valid,
        base,
        raised,
        random,
    )


def _exchanged(
    field: LightField, scenes: ContactScenes, points: VisiblePoints, seed: int
) -> list[mi.Color3f] | None:
    """Light that reaches points by way of an indenter, or indenters by way of the near skin (one sample each)."""
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
    for light in _shade_field(field, scenes, met, seed + 1):
        channels = [dr.zeros(mi.Float, count) for _ in range(3)]
        for k in range(3):
            dr.scatter(channels[k], light[k] * met.weight[k], met.pixel)
        out.append(mi.Color3f(*channels))
    return out


def shade(
    field: LightField, scenes: ContactScenes, points: VisiblePoints, seed: int, exchange: bool
) -> list[mi.Color3f]:
    """Radiance of visible points towards the eye, for each light group with lights of 1 mW.

    ``exchange`` adds the light that indenters and the skin near them send to each other.
    """
    totals = _shade_field(field, scenes, points, seed)
    dr.eval(totals)
    if exchange and scenes.indenters is not None:
        more = _exchanged(field, scenes, points, seed + 7)
        if more is not None:
            totals = [a + b for a, b in zip(totals, more, strict=True)]
    return totals
