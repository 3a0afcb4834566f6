"""Light that contacts reflect to metal coatings through the interfaces.

The radiance cache holds the light of the undeformed skin. A metallic coating reflects the faces of
gel and glass in front of it, and these reflect the contacts. A few rays are therefore drawn from
the lobes of each visible point and followed like paths from the camera. Where a ray ends on an
indenter, the light of that place replaces the light of the undeformed skin behind it, which is in
the cache. With narrow lobes, the place also receives the light of the skin beside it: where lamps
are low, the skin mirrors them to the flank of a contact, which is then twice as bright.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.arrays import FEWEST_LANES, joined
from optisense.optics.backend.sequences import STEPS_2D, unit_float
from optisense.optics.radiance_cache.beam_sums import sum_beams
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.glossy_interreflection import (
    SecondaryHits,
    glossy_interreflection,
    light_of,
    shading_points,
)
from optisense.optics.radiance_cache.shading_points import ShadingPoints, interpolating_cell
from optisense.optics.scene.bsdf import coating_of, sample_coating, surface_kind, surface_region
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import Ray, leave
from optisense.optics.scene.surface_cells import bin_axis
from optisense.optics.scene.surfaces import Region, SurfaceKind
from optisense.optics.transport.camera_paths import (
    PathEnd,
    VisiblePoints,
    follow,
    follow_branches,
    generator,
)
from optisense.optics.transport.interact import RayKind

MOST_LANES = 16_000
"""Largest number of places that are shaded; if rays end at more, a part of them is drawn. A ball of
1.5 mm in GelSight Mini has up to 5,000. A plate that fills the image has 160,000, which would take
ten times as long as the rest of the image."""


def mirrored_contacts(
    cache: RadianceCache, scenes: ContactScenes, points: VisiblePoints, rays: int
) -> tuple[VisiblePoints, list[mi.Color3f]] | None:
    """Return the light that indenters reflect to visible points through the interfaces.

    Args:
        cache: the radiance cache.
        scenes: the scenes of the image, with indenters.
        rays: number of rays from each point.

    Returns:
        The places on indenters where rays end, with the pixels and weights of the points that the
        rays start from; and the difference between the radiance of each place and that of the
        undeformed skin behind it, one colour per group (negative in front of brighter skin). None
        if no ray ends on an indenter.
    """
    lane = dr.arange(mi.UInt32, dr.width(points.pixel) * rays)
    each = dr.opaque(mi.UInt32, rays)
    points = dr.gather(VisiblePoints, points, lane // each)
    points.number = points.number * each + lane % each
    points.weight *= dr.opaque(mi.Float, 1 / rays)
    found = None
    for end, owner in _ends(scenes, points):
        region = surface_region(scenes.full.table, end.surface, end.valid)
        kept = dr.compress(end.valid & (region >= int(Region.INDENTER)))
        if dr.width(kept) > 0:
            some = dr.gather(PathEnd, end, kept), dr.gather(mi.UInt32, owner, kept)
            dr.eval(some)
            found = some if found is None else joined(found, some)
    if found is None:
        return None
    end, owner = found
    count = dr.width(owner)
    if count > MOST_LANES:
        # The places are in the order of their pixels, so that each pixel keeps an equal share.
        shift = unit_float(dr.gather(mi.UInt32, points.random, mi.UInt32(0)))
        step = dr.opaque(mi.Float, count / MOST_LANES)
        drawn = mi.UInt32((dr.arange(mi.Float, MOST_LANES) + shift) * step)
        drawn = dr.minimum(drawn, dr.opaque(mi.UInt32, count - 1))
        end, owner = dr.gather(PathEnd, end, drawn), dr.gather(mi.UInt32, owner, drawn)
        end.weight *= step
        dr.eval(end, owner)
    alone = count < FEWEST_LANES
    if alone:
        lanes = dr.repeat(mi.UInt32(0), FEWEST_LANES)
        end, owner = dr.gather(PathEnd, end, lanes), dr.gather(mi.UInt32, owner, lanes)
        end.valid &= dr.arange(mi.UInt32, FEWEST_LANES) == 0
    seen = replace(dr.gather(VisiblePoints, points, owner), **vars(end))
    dr.eval(seen)
    return seen, _radiance_differences(cache, scenes, seen)


def _ends(scenes: ContactScenes, points: VisiblePoints) -> Iterator[tuple[PathEnd, mi.UInt32]]:
    """Yield the ends of rays from points, and the number of the point that each ray starts from.

    The first item holds the rays that pass through interfaces, the second their reflections at
    interfaces.
    """
    scene = scenes.full
    coating = coating_of(scene.table, points.surface, points.valid)
    u = unit_float(points.series * 747796405 + points.number * STEPS_2D[0])
    v = unit_float(points.series * 2891336453 + points.number * STEPS_2D[1])
    bits = (points.random ^ (points.number * 0x9E3779B9)) * 277803737
    way, weight = sample_coating(
        coating, points.normal, -points.towards_eye, unit_float(bits), mi.Point2f(u, v)
    )
    weight *= points.weight
    looks = points.valid & (dr.dot(way, points.face_normal) > 0) & (dr.max(weight) > 0)
    ray = Ray(leave(points.point, points.face_normal, way), way, looks)
    # Rays that meet an indenter before any interface belong to interreflection.
    first = scene.intersect(ray)
    kind, _, _ = surface_kind(scene.table, first.surface, first.valid)
    ray.active &= first.valid & (kind == int(SurfaceKind.DIELECTRIC))
    if scene.absorbing:
        ray.absorption = mi.Color3f(0) if scenes.absorption is None else scenes.absorption
    paths = follow(scene, ray, weight, generator(bits), RayKind.CAMERA)
    number = dr.arange(mi.UInt32, dr.width(points.pixel))
    dr.eval(paths, number, bits)
    yield paths.end, number
    lanes = dr.compress(paths.branch.active)
    if dr.width(lanes) == 0:
        return
    again = follow_branches(scene, paths, lanes, dr.gather(mi.UInt32, bits, lanes) * 69069)
    dr.eval(again)
    yield again, lanes


def _radiance_differences(
    cache: RadianceCache, scenes: ContactScenes, seen: VisiblePoints
) -> list[mi.Color3f]:
    """Return the radiance of places on indenters minus that of the undeformed skin behind them."""
    away = -seen.towards_eye
    behind = scenes.fixed.intersect(Ray(seen.point, away, seen.valid))
    base = dr.select(behind.valid, behind.point, seen.point)
    cell, shift, found = interpolating_cell(
        cache.binned.cells, base, seen.valid, seen.series, seen.number
    )
    side = -dr.sign(dr.dot(away, behind.normal))
    skin = replace(
        seen,
        point=base,
        normal=behind.shading_normal * side,
        face_normal=behind.normal * side,
        surface=behind.surface,
    )
    coating = coating_of(scenes.full.table, behind.surface, behind.valid)
    flat = ShadingPoints(skin, coating, base, cell, shift, found & behind.valid, mi.Bool(False))
    axis = bin_axis(cache.binned.cells, 2)
    without = sum_beams(cache.beams, cache.binned.groups, flat, axis)
    places = shading_points(cache, scenes, SecondaryHits(seen, mi.Bool(seen.valid), cell))
    lit = light_of(cache, scenes, places)
    if cache.binned.narrow_lobes:
        dr.eval(places, lit)
        between = glossy_interreflection(cache, scenes, places, directions=1)
        lit = [one + other for one, other in zip(lit, between, strict=True)]
    return [one - other for one, other in zip(lit, without, strict=True)]
