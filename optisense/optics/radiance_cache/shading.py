"""Shading of visible points from the radiance cache: tilt, shadows and interreflection.

For a visible point, the cache is summed over direction bins, each reflected with the point's own
normal. On an indenter, which stands off the undeformed surface, a bin is looked up where the line
of its light meets that surface. A shadow ray tests whether an indenter occludes the light; it is
drawn within the angular variance of the bin, so that extended lights cast soft shadows.
`interreflection` adds the light that indenters and the skin beside them reflect to each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from optisense.optics.radiance_cache.beam_sums import sum_beams, sum_diffuse, sum_hidden
from optisense.optics.radiance_cache.beams import Beams
from optisense.optics.radiance_cache.bin_sums import sum_bins
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.glossy_interreflection import glossy_interreflection
from optisense.optics.radiance_cache.interreflection import interreflected
from optisense.optics.radiance_cache.shading_points import (
    ShadingPoints,
    foot_of,
    interpolating_cell,
)
from optisense.optics.scene.coating_bsdf import coating_of
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.ray_scene import Ray, leave
from optisense.optics.scene.surface_cells import SurfaceCells, bin_axis, cell_at
from optisense.optics.scene.surface_table import surface_region
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.camera_paths import VisiblePoints


@dataclass(frozen=True)
class ShadingEffort:
    """The numbers of shadow rays and cells of a camera sample.

    Attributes:
        contact_shadow_rays: number of shadow rays per light group in and near contacts.
        shadow_rays: number of shadow rays per light group elsewhere, for all the light; only the
            rays of beams that pass near an indenter are traced.
        cells: number of cells that are averaged where coatings are diffuse and reading a cell is
            cheap.
    """

    contact_shadow_rays: float
    shadow_rays: float
    cells: int


FULL_EFFORT = ShadingEffort(16.0, 32.0, 8)
"""The effort for a picture. A pixel in and near contacts has twelve samples or more, so that a
shadow is known to half a per cent of the light; elsewhere a pixel has fewer samples, and each has
twice as many rays. With 1 cell, the error beside contacts is up to 9 % larger
(benchmarks/ablation.md)."""
DRAG_EFFORT = ShadingEffort(4.0, 6.0, 2)
"""The effort for drafts while something moves, which take an eighth less time. On GelSight Mini,
their error grows by 0.6 % of the mean light while a light is dragged and by 1.7 % for a cage point,
nearly all of it because fewer cells are averaged."""
REFLECTED_SHADOW_RAYS = 4.0
"""Number of shadow rays for points seen in the reflection of an interface; few suffice, as little
of their light reaches the camera."""


def shade_in_contacts(
    cache: RadianceCache,
    scenes: ContactScenes,
    points: VisiblePoints,
    effort: ShadingEffort,
    interreflection: bool = True,
) -> tuple[list[mi.Color3f], list[mi.Color3f] | None]:
    """Return the radiance of visible points on and near indenters towards the camera.

    Each direction bin is looked up along its own line.

    Args:
        cache: the radiance cache.
        scenes: the scenes of the image, with indenters.
        interreflection: whether interreflection is computed.

    Returns:
        The radiance (3, n) due to the light of the cache, and that due to interreflection (None
        without it); for each light group, with lights of 1 mW.
    """
    region = surface_region(scenes.full.table, points.surface, points.valid)
    raised = points.valid & (region >= int(Region.INDENTER))
    base = _place_below(cache.binned.cells, scenes, points, raised)
    at = _shading_points(cache, scenes, points, base, raised)
    far = sum_bins(cache.binned, scenes, at, effort.contact_shadow_rays)
    if not interreflection:
        return far, None
    between = glossy_interreflection if cache.metallic else interreflected
    return far, between(cache, scenes, at)


def _shading_points(
    cache: RadianceCache,
    scenes: ContactScenes,
    points: VisiblePoints,
    base: mi.Point3f,
    raised: mi.Bool,
) -> ShadingPoints:
    """Return the shading points of visible points, which read the cache about ``base``."""
    cell, shift, active = interpolating_cell(
        cache.binned.cells, base, points.valid, points.series, points.number
    )
    coating = coating_of(scenes.full.table, points.surface, active, cache.metallic)
    coating.only_tail = cache.traced_lobes
    start = leave(points.point, points.face_normal, points.face_normal)
    return ShadingPoints(points, coating, start, cell, shift, active, raised)


def _place_below(
    cells: SurfaceCells, scenes: ContactScenes, points: VisiblePoints, raised: mi.Bool
) -> mi.Point3f:
    """Return the place (3, n), mm, on the undeformed surface below each of the ``raised`` points,
    and the other points unchanged.

    It is the foot of the perpendicular, as the light above a place does not depend on the eye.
    Beyond an edge of the surface, it is the place where the line of sight, continued behind the
    indenter, meets the surface.
    """
    onward = scenes.fixed.intersect(Ray(points.point, -points.towards_eye, raised))
    behind = dr.select(raised & onward.valid, onward.point, points.point)
    cell, found = cell_at(cells, behind, raised)
    foot = foot_of(cells, cell, points.point, found)
    _, exists = cell_at(cells, foot, found)
    return dr.select(exists, foot, behind)


def shade(
    cache: RadianceCache,
    scenes: ContactScenes,
    culled_beams: Beams,
    points: VisiblePoints,
    effort: ShadingEffort,
    reflected: bool,
) -> list[mi.Color3f]:
    """Return the radiance (3, n) of visible points on the undeformed surface towards the camera,
    for each light group with lights of 1 mW.

    Args:
        cache: the radiance cache.
        culled_beams: the beams of the cache that pass near indenters (`cull_beams`).
        effort: the numbers of shadow rays and cells.
        reflected: whether the points are seen in the reflection of an interface.
    """
    base, seen = points.point, points.valid
    at = _shading_points(cache, scenes, points, base, mi.Bool(False))
    indenters = scenes.indenters
    axis = bin_axis(cache.binned.cells, 2)
    totals: list[mi.Color3f]
    if cache.metallic or cache.binned.coloured:
        totals = sum_beams(cache.beams, cache.binned.groups, at, axis)
    else:
        totals = [mi.Color3f(0) for _ in range(cache.binned.groups)]
        for k in range(effort.cells):
            number = points.number * effort.cells + k
            beside, _, lit = interpolating_cell(
                cache.binned.cells, base, seen, points.series, number
            )
            light = sum_diffuse(
                cache.binned.irradiance, cache.binned.groups, replace(at, cell=beside, active=lit)
            )
            totals = [one + each / effort.cells for one, each in zip(totals, light, strict=True)]
    if indenters is None:
        return totals
    rays = REFLECTED_SHADOW_RAYS if reflected else effort.shadow_rays
    shadow_rays = dr.opaque(mi.Float, rays)
    hidden = sum_hidden(culled_beams, totals, indenters, at, axis, shadow_rays)
    # Where all light is occluded, rounding may make the sum of the shares exceed the total.
    return [dr.maximum(one - other, 0) for one, other in zip(totals, hidden, strict=True)]


def beside_contacts(
    cache: RadianceCache, scenes: ContactScenes, points: VisiblePoints, directions: int
) -> list[mi.Color3f]:
    """Return the radiance of points on the undeformed skin due to light from indenters.

    Args:
        cache: the radiance cache.
        scenes: the scenes of the image, with indenters.
        directions: number of rays from each point; metallic coatings use a number of their own.

    Returns:
        The radiance (3, n) towards the camera, for each light group.
    """
    at = _shading_points(cache, scenes, points, points.point, mi.Bool(False))
    if cache.metallic:
        at.raised = dr.full(mi.Bool, False, dr.width(points.pixel))
        return glossy_interreflection(cache, scenes, at)
    return interreflected(cache, scenes, at, directions)
