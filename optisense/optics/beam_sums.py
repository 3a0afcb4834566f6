"""Points on the undeformed surface: light of short lists of beams, with shadows of indenters."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.beams import Beams
from optisense.optics.sampling import next_random, unit_float
from optisense.optics.scattering import Coating, evaluate_coating, grey
from optisense.optics.spread import passes_near, round_spread, squared_radius, widened, within
from optisense.optics.visible_points import VisiblePoints

SHADOW_RAYS = 4
"""Shadow rays of a beam that passes near an indenter, for points that are sampled once."""


@dr.syntax
def sum_all(
    beams: Beams,
    groups: int,
    indenters: mi.Scene,
    balls: mi.Float,
    ball_count: mi.UInt32,
    contacts: bool,
    single: bool,
    coating: Coating,
    points: VisiblePoints,
    start: mi.Point3f,
    cell: mi.UInt32,
    active: mi.Bool,
    random: mi.UInt32,
) -> list[mi.Color3f]:
    """Every beam of the field, for points on the undeformed surface."""
    totals = [mi.Color3f(0) for _ in range(groups)]
    state = mi.UInt32(random)
    j = dr.gather(mi.UInt32, beams.starts, cell * groups, active)
    end = dr.gather(mi.UInt32, beams.starts, (cell + 1) * groups, active)
    while j < end:
        towards, cosine, flux, group = beam_at(beams, j)
        reflected = evaluate_coating(
            widened(coating, cosine), points.normal, towards, points.towards_eye
        )
        seen = dr.max(reflected) > 0
        if dr.hint(contacts, mode="scalar"):
            near = _near_indenters(balls, ball_count, single, start, towards, cosine)
            if seen & near:
                light = round_spread(towards, cosine)
                open_rays = mi.Float(0)
                for _ in range(SHADOW_RAYS):
                    state = next_random(state)
                    blocked = indenters.ray_test(
                        mi.Ray3f(start, within(light, state)),
                        coherent=False,
                        active=mi.Bool(True),
                    )
                    open_rays += dr.select(blocked, 0.0, 1.0 / SHADOW_RAYS)
                reflected *= open_rays
        reflected *= flux
        for g in range(groups):
            totals[g] += dr.select(seen & (group == g), reflected, 0)
        j += 1
    return totals


@dr.syntax
def sum_roughly(
    beams: Beams,
    groups: int,
    indenters: mi.Scene,
    balls: mi.Float,
    ball_count: mi.UInt32,
    contacts: bool,
    single: bool,
    coating: Coating,
    points: VisiblePoints,
    start: mi.Point3f,
    cell: mi.UInt32,
    active: mi.Bool,
    random: mi.UInt32,
) -> list[mi.Color3f]:
    """As ``sum_all``, with one shadow ray for all beams of a group that pass near indenters, drawn
    in proportion to what they bring: for points of which little reaches the eye."""
    totals = [mi.Color3f(0) for _ in range(groups)]
    doubtful = [mi.Color3f(0) for _ in range(groups)]
    doubt = mi.Float(0)
    last = mi.UInt32(groups)
    picked = [mi.UInt32(0) for _ in range(groups)]
    state = mi.UInt32(random)
    j = dr.gather(mi.UInt32, beams.starts, cell * groups, active)
    end = dr.gather(mi.UInt32, beams.starts, (cell + 1) * groups, active)
    while j < end:
        towards, cosine, flux, group = beam_at(beams, j)
        reflected = flux * evaluate_coating(
            widened(coating, cosine), points.normal, towards, points.towards_eye
        )
        near = mi.Bool(False)
        if dr.hint(contacts, mode="scalar"):
            near = _near_indenters(balls, ball_count, single, start, towards, cosine)
            # Beams are in the order of groups: one running sum does for all of them.
            doubt = dr.select(group == last, doubt, 0)
            last = mi.UInt32(group)
            light = dr.select(near, grey(reflected), 0)
            doubt += light
            state = next_random(state)
            taken = (light > 0) & (unit_float(state * 277803737) * doubt < light)
        for g in range(groups):
            mine = group == g
            totals[g] += dr.select(mine & ~near, reflected, 0)
            if dr.hint(contacts, mode="scalar"):
                doubtful[g] += dr.select(mine & near, reflected, 0)
                picked[g] = dr.select(mine & taken, j, picked[g])
        j += 1
    if dr.hint(contacts, mode="scalar"):
        for g in range(groups):
            asked = active & (dr.max(doubtful[g]) > 0)
            towards, cosine, flux, group = beam_at(beams, picked[g])
            state = next_random(state)
            blocked = indenters.ray_test(
                mi.Ray3f(start, within(round_spread(towards, cosine), state)),
                coherent=False,
                active=asked,
            )
            totals[g] += dr.select(blocked, 0, doubtful[g])
    return totals


@dr.syntax
def _near_indenters(
    balls: mi.Float,
    ball_count: mi.UInt32,
    single: bool,
    start: mi.Point3f,
    towards: mi.Vector3f,
    cosine: mi.Float,
) -> mi.Bool:
    """Whether beams may touch one of the balls; without a loop where there is a ``single`` one."""
    near = mi.Bool(False)
    if dr.hint(single, mode="scalar"):
        ball = dr.gather(mi.Vector4f, balls, mi.UInt32(0))
        near = passes_near(ball, start, towards, squared_radius(cosine))
    else:
        n = mi.UInt32(0)
        while n < ball_count:
            ball = dr.gather(mi.Vector4f, balls, n)
            near |= passes_near(ball, start, towards, squared_radius(cosine))
            n += 1
    return near


def beam_at(beams: Beams, number: mi.UInt32) -> tuple[mi.Vector3f, mi.Float, mi.Color3f, mi.UInt32]:
    """Direction towards the light, mean cosine, flux density and light group of beams."""
    way = dr.gather(mi.Vector4f, beams.ways, number)
    flux = dr.gather(mi.Vector4f, beams.fluxes, number)
    towards = mi.Vector3f(way.x, way.y, way.z)
    colour = mi.Color3f(flux.x, flux.y, flux.z)
    return towards, way.w, colour, dr.reinterpret_array(mi.UInt32, flux.w)
