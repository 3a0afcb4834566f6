"""Light that indenters and the skin near them send to each other.

The light field holds all light that comes from afar, also after scattering. Inside a contact, a
point sees an indenter or, standing on one, the skin beside it; what comes from there is sampled by
rays. It is a few per cent of the whole, so the place that is seen is taken to be diffuse, and the
field's irradiance there is read from nine spherical-harmonic coefficients per cell and light group
(Ramamoorthi and Hanrahan 2001), with one shadow ray a group towards the mean of its light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi

from optisense.optics.cells import SurfaceCells, cell_at
from optisense.optics.ray_scene import RayScene, intersect, leave
from optisense.optics.sampling import STEPS_2D, next_random, unit_float
from optisense.optics.scattering import Coating, albedo_of, sample_coating

if TYPE_CHECKING:
    from optisense.optics.light_field import LightField
    from optisense.optics.shading import ContactScenes
    from optisense.optics.visible_points import VisiblePoints

DIRECTIONS = 8
"""Rays of a camera sample for exchanged light."""
MOST_PLACES = 8
"""That scatter exchanged light one after another, at most."""

# Clamped-cosine convolution of bands 0, 1, 2 (Ramamoorthi and Hanrahan 2001, eq. 8).
BAND_0, BAND_1, BAND_2 = 3.141593, 2.094395, 0.785398


def harmonics(n: mi.Vector3f) -> tuple[mi.Float, ...]:
    """The nine real spherical harmonics up to band 2 of unit directions."""
    x, y, z = n.x, n.y, n.z
    return (
        mi.Float(0.282095) + 0 * x,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3 * z * z - 1),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    )


@dr.syntax
def irradiance_table(moments: mi.Float, cells: int, bins: mi.UInt32, groups: int) -> mi.Float:
    """Twelve floats a cell and group: nine coefficients of irradiance over the normal, and the sum
    of the light's directions, weighted with its flux density."""
    lane = dr.arange(mi.UInt32, cells * groups)
    cell, group = lane // groups, lane % groups
    sums = [mi.Float(0) for _ in range(9)]
    mean = mi.Vector3f(0)
    k = mi.UInt32(0)
    while k < bins:
        value = dr.gather(mi.Vector4f, moments, (cell * bins + k) * groups + group)
        if value.w > 0:
            flux = mi.Vector3f(value.x, value.y, value.z)
            mean += flux
            basis = harmonics(dr.normalize(flux))
            for i in range(9):
                sums[i] += value.w * basis[i]
        k += 1
    dr.eval(sums, mean)  # together: the loop would run again for each
    band = [BAND_0, *[BAND_1] * 3, *[BAND_2] * 5]
    out = dr.empty(mi.Float, cells * groups * 12)
    for i in range(9):
        dr.scatter(out, sums[i] * band[i], lane * 12 + i)
    for i in range(3):
        dr.scatter(out, mean[i], lane * 12 + 9 + i)
    return out


def irradiance(
    table: mi.Float, entry: mi.UInt32, normal: mi.Vector3f
) -> tuple[mi.Float, mi.Float, mi.Vector3f]:
    """Irradiance (mW/mm^2) at normals, its mean over all normals, and the vector along which most
    of its light comes: light that is wholly above a normal's horizon brings its part along it."""
    a = dr.gather(mi.Vector4f, table, entry * 3)
    b = dr.gather(mi.Vector4f, table, entry * 3 + 1)
    c = dr.gather(mi.Vector4f, table, entry * 3 + 2)
    basis = harmonics(normal)
    values = (a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x)
    total = mi.Float(0)
    for value, weight in zip(values, basis, strict=True):
        total = total + value * weight
    return dr.maximum(total, 0), a.x * basis[0], mi.Vector3f(c.y, c.z, c.w)


def vector(table: mi.Float, entry: mi.UInt32) -> mi.Vector3f:
    """The last of `irradiance` alone."""
    third = dr.gather(mi.Vector4f, table, entry * 3 + 2)
    return mi.Vector3f(third.y, third.z, third.w)


@dr.syntax
def _sample(
    cells: SurfaceCells,
    table: mi.Float,
    groups: int,
    indenters: RayScene,
    fixed: RayScene,
    coating: Coating,
    normal: mi.Vector3f,
    face_normal: mi.Vector3f,
    towards_eye: mi.Vector3f,
    point: mi.Point3f,
    cell: mi.UInt32,
    active: mi.Bool,
    raised: mi.Bool,
    random: mi.UInt32,
    series: mi.UInt32,
    first: mi.UInt32,
    directions: mi.UInt32,
) -> list[mi.Color3f]:
    totals = [mi.Color3f(0) for _ in range(groups)]
    # How much of the light the places that are seen send on, if they are diffuse.
    albedo = albedo_of(coating)
    survival = dr.max(albedo)
    k = mi.UInt32(0)
    while active & (k < directions):
        # One sequence goes through all samples of a pixel.
        u = unit_float(series + (first + k) * STEPS_2D[0])
        v = unit_float(series * 277803737 + (first + k) * STEPS_2D[1])
        state = (random ^ (k * 0x9E3779B9)) * 69069
        way, weight = sample_coating(
            coating, normal, -towards_eye, unit_float(state), mi.Point2f(u, v)
        )
        weight *= albedo
        above = mi.Bool(raised)
        start = leave(point, face_normal, way)
        walking = (dr.dot(way, face_normal) > 0) & (dr.max(weight) > 0)
        places = mi.UInt32(0)
        while walking:
            pressed = intersect(
                indenters.scene, indenters.rows, indenters.corners, start, way, mi.Bool(True)
            )
            skin = intersect(fixed.scene, fixed.rows, fixed.corners, start, way, above)
            on_indenter = pressed.valid & (~skin.valid | (pressed.distance < skin.distance))
            # Light along a line that comes from the skin behind is in the field already.
            behind = fixed.scene.ray_test(mi.Ray3f(start, -way), coherent=False, active=above)
            walking = on_indenter | (skin.valid & ~behind)
            if walking:
                seen = dr.select(on_indenter, pressed.point, skin.point)
                facing = dr.select(on_indenter, pressed.shading_normal, skin.shading_normal)
                facing *= -dr.sign(dr.dot(way, facing))
                there, exists = cell_at(cells, skin.point, ~on_indenter)
                # An indenter's place is lit like its neighbourhood, which is where the point
                # stands.
                there = dr.select(exists, there, cell)
                lift = leave(seen, facing, facing)
                for g in range(groups):
                    light, _mean, towards = irradiance(table, there * groups + g, facing)
                    lit = light > 0
                    towards = dr.select(lit, dr.normalize(towards), facing)
                    hidden = indenters.scene.ray_test(
                        mi.Ray3f(lift, towards), coherent=False, active=mi.Bool(True)
                    )
                    totals[g] += dr.select(lit & ~hidden, light, 0) * dr.inv_pi * weight
                # On from there, like light that is scattered evenly.
                state = next_random(state)
                places += 1
                walking = (unit_float(state) < survival) & (places < MOST_PLACES)
                weight *= albedo / survival
                u = unit_float(state * 277803737)
                v = unit_float((state ^ 0x9E3779B9) * 69069)
                way = mi.Frame3f(facing).to_world(
                    mi.warp.square_to_cosine_hemisphere(mi.Point2f(u, v))
                )
                start = lift
                above = mi.Bool(on_indenter)
        k += 1
    return [total / mi.Float(directions) for total in totals]


def exchanged(
    field: LightField,
    scenes: ContactScenes,
    points: VisiblePoints,
    coating: Coating,
    cell: mi.UInt32,
    active: mi.Bool,
    raised: mi.Bool,
) -> list[mi.Color3f]:
    """Radiance towards the eye that points reflect of exchanged light, one colour a group.

    ``cell`` is where each point looks up the field, ``raised`` whether it is on an indenter.
    """
    assert scenes.indenters is not None
    return _sample(
        field.cells,
        field.irradiance,
        field.groups,
        scenes.indenters,
        scenes.fixed,
        coating,
        points.normal,
        points.face_normal,
        points.towards_eye,
        points.point,
        cell,
        active,
        raised,
        points.random,
        points.series,
        points.number * DIRECTIONS,
        dr.opaque(mi.UInt32, DIRECTIONS),
    )
