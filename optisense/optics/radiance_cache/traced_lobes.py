"""The light in narrow metallic lobes, traced from visible points to the lamps.

A lobe that is narrower than a lamp shows the lamp's outline, which a radiance cache only knows as
discs of the same mean direction and variance. Rays are therefore drawn from such lobes and followed
from surface to surface until they meet a lamp. Only the peak of a lobe is traced: in its tail, rays
would meet lamps rarely, while the tail is smooth, so that the cache serves it (see
`CoatingBsdf.only_tail`).
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.arrays import gathered
from optisense.optics.backend.sequences import GOLDEN_BITS, STEPS_2D, next_random, unit_float
from optisense.optics.radiance_cache._irradiance import irradiance
from optisense.optics.radiance_cache.beam_sums import sum_beams
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.shading_points import (
    ShadingPoints,
    interpolating_cell,
    may_be_cached,
)
from optisense.optics.scene.bsdf import (
    coating_density,
    coating_of,
    half_vector_cosine,
    peak_share,
    sample_coating,
    surface_kind,
    surface_region,
)
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import Ray, leave
from optisense.optics.scene.surface_cells import bin_axis, cell_at
from optisense.optics.scene.surfaces import Region, SurfaceKind
from optisense.optics.transport.camera_paths import PathEnd, VisiblePoints, follow, generator
from optisense.optics.transport.interact import RayKind

MAX_REFLECTIONS = 16
"""Largest number of coatings that a ray meets. Gel between a metal coating and glass guides light:
with four, the light in a contact of GelSight Mini of specularity 1 would be 2 % too weak."""
FEWEST_RAYS = 2
"""Number of rays below which they are dropped, as Dr.Jit compiles other kernels for arrays of one
entry."""
SPLIT_SHARE = 1 / 16
"""Share of all rays up to which those that meet an indenter first are split into several. Few rays
from the skin do, and the contact is bright: on the skin around a contact of GelSight Mini of
specularity 1, splitting reduces the noise from 17 to 10 %."""
MOST_CACHED = 40_000
"""Largest number of places on the skin whose cached light is summed at each reflection; if rays end
at more, a part of them is drawn. The sum takes as long as the ray on GelSight Mini, and ten times
as long on GelSight360 with its nine light groups."""
MOST_COPIES = 16
"""Largest number of rays into which a ray is split; with 64, the noise is the same."""


@dataclass
class LobeRays:
    """Rays from visible points, and the light that arrives along them.

    Attributes:
        owner: (n,) number of the visible point that each ray starts from.
        way: (3, n) unit directions of the rays.
        density: (n,) density (1/sr) with which each direction was drawn; 0 for rays that carry no
            light.
        whole: (n,) mask of the rays that the whole coating reflects, as the cache does not hold
            their light, which comes straight from another coating; of the others, it is the peaks
            of metallic lobes.
        light: radiance, 1/(mm^2 sr) for lights of 1 mW, that arrives along each ray: three channels
            of each light group, (3 groups n,).
        distance: (n,) length (mm) of the way to the first lamp or coating.
        segments: number of all segments of rays from coating to coating.
    """

    owner: mi.UInt32
    way: mi.Vector3f
    density: mi.Float
    whole: mi.Bool
    light: mi.Float
    distance: mi.Float
    segments: int = 0


@dataclass(frozen=True)
class LobeTracer:
    """A tracer of rays from narrow lobes.

    Attributes:
        cache: the radiance cache.
        scenes: the scenes of the image.
        lamps: the windows of the lamps.
        channel: channel of the light that the rays carry, 0 to 2; None for all channels.
    """

    cache: RadianceCache
    scenes: ContactScenes
    lamps: LampWindows
    channel: int | None

    def trace(self, points: VisiblePoints, directions: int) -> LobeRays:
        """Return a number of rays from each visible point, and their light."""
        table = self.scenes.full.table
        count = dr.width(points.pixel) * directions
        lane = dr.arange(mi.UInt32, count)
        owner = lane // directions
        first = dr.gather(VisiblePoints, points, owner)
        coating = coating_of(table, first.surface, first.valid)
        number = first.number * directions + lane % directions
        # The rays of a pixel share its lobes evenly.
        u = unit_float(first.series + number * STEPS_2D[0])
        v = unit_float(first.series * 277803737 + number * STEPS_2D[1])
        pick = unit_float(first.series * 69069 + number * GOLDEN_BITS)
        way, weight = sample_coating(
            coating, first.normal, -first.towards_eye, pick, mi.Point2f(u, v)
        )
        ray = Ray(leave(first.point, first.face_normal, way), way, first.valid)
        ray.active &= (dr.max(weight) > 0) & (coating.specularity > 0)
        ray.active &= dr.dot(way, first.face_normal) > 0
        whole = self._is_uncached(first, ray)
        cos_m = half_vector_cosine(first.normal, way, first.towards_eye)
        ray.active &= whole | (peak_share(cos_m) > 0)
        density = coating_density(coating, first.normal, way, first.towards_eye)
        found = LobeRays(
            owner,
            way,
            dr.select(ray.active, density, 0),
            whole,
            dr.zeros(mi.Float, 3 * self.cache.binned.groups * count),
            dr.zeros(mi.Float, count),
        )
        bits = next_random((first.random ^ (number * GOLDEN_BITS)) * 69069)
        dr.eval(found, ray, bits)
        self._follow(found, ray, bits)
        return found

    def _is_uncached(self, first: VisiblePoints, ray: Ray) -> mi.Bool:
        """Return a mask of the rays that meet a coating before any interface, from which no light
        arrives that the cache holds.
        """
        scenes = self.scenes
        table = scenes.full.table
        hit = scenes.full.intersect(ray)
        kind, _, _ = surface_kind(table, hit.surface, hit.valid)
        straight = hit.valid & (kind == int(SurfaceKind.OPAQUE))
        raised = surface_region(table, first.surface, first.valid) >= int(Region.INDENTER)
        skin = straight & (surface_region(table, hit.surface, straight) < int(Region.INDENTER))
        # The cache holds the light along a line that comes from the undeformed skin behind.
        cell, known = cell_at(self.cache.binned.cells, first.point, skin)
        held = skin & (~known | may_be_cached(self.cache.binned, cell, ray.direction, skin))
        held &= ~raised | scenes.fixed.occluded(ray.origin, -ray.direction, held & raised)
        return straight & ~held

    def _follow(self, found: LobeRays, ray: Ray, bits: mi.UInt32) -> None:
        """Add the light that arrives along rays to ``found``.

        Args:
            bits: random bits (n,) of each ray.
        """
        scene = self.scenes.full
        lane = dr.compress(ray.active)
        count = dr.width(lane)
        ray, bits = gathered(ray, lane), dr.gather(mi.UInt32, bits, lane)
        weight = dr.full(mi.Color3f, 1, count)
        for reflections in range(MAX_REFLECTIONS):
            if dr.width(lane) < FEWEST_RAYS:
                return
            if scene.absorbing:
                clear = self.scenes.absorption is None
                ray.absorption = mi.Color3f(0) if clear else self.scenes.absorption
            if self.channel is not None:
                ray.channel = dr.opaque(mi.UInt32, self.channel, dr.width(lane))
            found.segments += dr.width(lane)
            end, _, _ = follow(scene, ray, weight, generator(bits), RayKind.REFLECTION)
            dr.eval(end)
            if reflections == 0:
                dr.scatter(found.distance, end.distance, lane, end.valid | (end.light > 0))
            self._add_lamps(found, end, lane)
            kept = dr.compress(end.valid)
            if dr.width(kept) < FEWEST_RAYS:
                return
            end, lane = dr.gather(PathEnd, end, kept), dr.gather(mi.UInt32, lane, kept)
            bits = next_random(dr.gather(mi.UInt32, bits, kept) ^ GOLDEN_BITS)
            on_skin = self._add_cached(found, end, lane, bits)
            if reflections == 0:
                chosen, copies = _split(on_skin, count)
                if copies > 1:
                    end.weight *= dr.select(on_skin, 1, 1 / copies)
                    dr.eval(end, bits)
                    end, on_skin = (
                        dr.gather(PathEnd, end, chosen),
                        dr.gather(mi.Bool, on_skin, chosen),
                    )
                    lane = dr.gather(mi.UInt32, lane, chosen)
                    bits = dr.gather(mi.UInt32, bits, chosen)
                    bits = mi.sample_tea_32(bits, dr.arange(mi.UInt32, dr.width(chosen)))[0]
            ray, weight = _reflected(scene.table, end, on_skin, bits)
            dr.eval(ray, weight, bits)
            kept = dr.compress(ray.active)
            ray, weight = gathered(ray, kept), dr.gather(mi.Color3f, weight, kept)
            lane, bits = dr.gather(mi.UInt32, lane, kept), dr.gather(mi.UInt32, bits, kept)

    def _add_lamps(self, found: LobeRays, end: PathEnd, lane: mi.UInt32) -> None:
        """Add the light of the lamps that rays meet."""
        value, group, lit = self.lamps.radiance(end.light, end.towards_eye)
        for k in range(3):
            entry = (lane * self.cache.binned.groups + group) * 3 + k
            dr.scatter_add(found.light, end.weight[k] * value, entry, lit)

    def _add_cached(
        self, found: LobeRays, end: PathEnd, lane: mi.UInt32, bits: mi.UInt32
    ) -> mi.Bool:
        """Add the light of the cache that coatings reflect.

        The undeformed skin reflects it with its diffuse lobe and the tail of its metallic lobe;
        indenters reflect it with their diffuse lobe, and as though it fell on the skin below.

        Returns:
            A mask of the rays that end on undeformed skin.
        """
        light, table = self.cache.binned, self.scenes.full.table
        raised = surface_region(table, end.surface, end.valid) >= int(Region.INDENTER)
        below = self.scenes.fixed.intersect(Ray(end.point, -end.towards_eye, raised))
        place = dr.select(raised & below.valid, below.point, end.point)
        cell, _, known = interpolating_cell(light.cells, place, end.valid, bits, lane)
        coating = coating_of(table, end.surface, end.valid)
        weight = end.weight * coating.reflectance * ((1 - coating.specularity) * dr.inv_pi)
        diffuse = []
        for g in range(light.groups):
            falling, _, _ = irradiance(light.irradiance, cell * light.groups + g, end.normal)
            diffuse.append(weight * falling)
        self._add(found, diffuse, lane, raised & known)
        on_skin = known & ~raised
        dr.eval(cell, on_skin)
        kept = dr.compress(on_skin)
        count = dr.width(kept)
        if count < FEWEST_RAYS:
            return on_skin
        share = 1.0
        if count > MOST_CACHED:
            share = MOST_CACHED / count
            shift = unit_float(dr.gather(mi.UInt32, bits, kept[0]))
            drawn = mi.UInt32((dr.arange(mi.Float, MOST_CACHED) + shift) / share)
            kept = dr.gather(mi.UInt32, kept, dr.minimum(drawn, count - 1))
        flat, cell, lane = (
            dr.gather(PathEnd, end, kept),
            dr.gather(mi.UInt32, cell, kept),
            dr.gather(mi.UInt32, lane, kept),
        )
        coating = coating_of(table, flat.surface, flat.valid)
        coating.only_tail = True
        points = VisiblePoints(**vars(flat), pixel=lane, random=lane, series=lane, number=lane)
        at = ShadingPoints(
            points, coating, flat.point, cell, mi.Vector3f(0), mi.Bool(flat.valid), mi.Bool(False)
        )
        sums = sum_beams(self.cache.beams, light.groups, at, bin_axis(light.cells, 2))
        self._add(found, [each * flat.weight / share for each in sums], lane, flat.valid)
        return on_skin

    def _add(
        self, found: LobeRays, light: list[mi.Color3f], lane: mi.UInt32, active: mi.Bool
    ) -> None:
        """Add the light of each light group to the rays of numbers ``lane``."""
        for g, value in enumerate(light):
            for k in range(3):
                entry = (lane * len(light) + g) * 3 + k
                dr.scatter_add(found.light, value[k], entry, active)


def _split(on_skin: mi.Bool, count: int) -> tuple[mi.UInt32, int]:
    """Return numbers of rays, in which those that are not ``on_skin`` occur several times, and how
    often they do.

    Args:
        count: number of rays that were traced.
    """
    raised = dr.compress(~on_skin)
    few = int(SPLIT_SHARE * count)
    copies = min(MOST_COPIES, max(1, few // max(1, dr.width(raised))))
    every = dr.arange(mi.UInt32, dr.width(on_skin))
    if copies == 1 or dr.width(raised) == 0:
        return every, 1
    return dr.concat([every, dr.repeat(raised, copies - 1)]), copies


def _reflected(
    table: mi.Float, end: PathEnd, on_skin: mi.Bool, bits: mi.UInt32
) -> tuple[Ray, mi.Color3f]:
    """Return rays that go on in the metallic lobes of coatings, and their weights (3, n).

    Where the cache serves the tail of a lobe (``on_skin``), only its peak counts.
    """
    coating = coating_of(table, end.surface, end.valid)
    place = mi.Point2f(unit_float(bits * 277803737), unit_float((bits ^ GOLDEN_BITS) * 69069))
    way, share = sample_coating(coating, end.normal, -end.towards_eye, mi.Float(0), place)
    weight = end.weight * share * coating.specularity
    cos_m = half_vector_cosine(end.normal, way, end.towards_eye)
    weight *= dr.select(on_skin, peak_share(cos_m), 1)
    goes_on = (dr.max(weight) > 0) & (dr.dot(way, end.face_normal) > 0)
    return Ray(leave(end.point, end.face_normal, way), way, goes_on), weight
