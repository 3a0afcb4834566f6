"""The light in narrow metallic lobes, traced from visible points to the lamps.

A lobe that is narrower than a lamp shows the lamp's outline, which a radiance cache only knows as
discs of the same mean direction and variance. Rays are therefore drawn from such lobes and followed
from surface to surface until they meet a lamp, or other skin whose light the cache holds. Only the
peak of a lobe is traced: in its tail, rays would meet lamps rarely, while the tail is smooth, so
that the cache serves it (see `CoatingBsdf.only_tail`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.arrays import FEWEST_LANES, gathered
from optisense.optics.backend.sequences import (
    GOLDEN_BITS,
    STEPS_2D,
    next_random,
    richtmyer,
    unit_float,
)
from optisense.optics.radiance_cache._irradiance import irradiance
from optisense.optics.radiance_cache._lobe_branches import (
    MOST_CACHED,
    MOST_GATHERED,
    drawn,
    follow_to_coating,
    split,
)
from optisense.optics.radiance_cache._lobe_guide import LobeGuide
from optisense.optics.radiance_cache.beam_sums import sum_beams
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.shading_points import (
    ShadingPoints,
    interpolating_cell,
    may_be_cached,
)
from optisense.optics.scene.coating_bsdf import (
    coating_density,
    coating_of,
    evaluate_coating,
    evaluate_peak,
    half_vector_cosine,
    peak_share,
    sample_coating,
)
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import Ray, leave
from optisense.optics.scene.surface_cells import bin_axis, cell_at
from optisense.optics.scene.surface_table import surface_kind, surface_region
from optisense.optics.scene.surfaces import Region, SurfaceKind
from optisense.optics.transport.camera_paths import PathEnd, VisiblePoints
from optisense.optics.transport.interact import RayKind

MAX_REFLECTIONS = 16
"""Largest number of coatings that a ray meets. Gel between a metal coating and glass guides light:
with four, the light in a contact of GelSight Mini of specularity 1 would be 2 % too weak."""
BRANCHED_SEGMENTS = 2
"""Number of segments from coating to coating on which rays from contacts go through interfaces and
branch there (see `follow_to_coating`); on later ones, one way is drawn. With one segment, the noise
of the contact of the flat GelSight Mini is a tenth larger; with three, it is the same."""
GUIDED_SHARE = 0.3
"""Share of the rays from the skin that are drawn from the beams of the cache. With 0.3, the noise
of the skin of GelSight Mini of specularity 1 is 12 instead of 15 %; with 0.7, it is larger again,
as light that the beams do not describe is found by fewer rays."""


@dataclass
class LobeRays:
    """Rays from visible points, and the light that arrives along them.

    Attributes:
        owner: (n,) number of the visible point that each ray starts from.
        direction: (3, n) unit directions of the rays.
        density: (n,) density (1/sr) with which each direction was drawn; 0 for rays that carry no
            light.
        whole: (n,) mask of the rays that the whole coating reflects, as the cache does not hold
            their light, which comes straight from another coating, or from an indenter that an
            interface mirrors; of the others, it is the peaks of metallic lobes.
        light: radiance, 1/(mm^2 sr) for lights of 1 mW, that arrives along each ray: three channels
            of each light group, (3 groups n,).
    """

    owner: mi.UInt32
    direction: mi.Vector3f
    density: mi.Float
    whole: mi.Bool
    light: mi.Float


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

    def trace(self, points: VisiblePoints, directions: int, gathers: bool) -> LobeRays:
        """Return a number of rays from each visible point, and their light.

        Args:
            gathers: whether rays end on the skin that they meet, whose light is read from the cache
                (final gathering, Jensen 1996), instead of going on in the peaks of its lobes. They
                are then also drawn from the beams of the cache.
        """
        table = self.scenes.full.table
        count = dr.width(points.pixel) * directions
        lane = dr.arange(mi.UInt32, count)
        each = dr.opaque(mi.UInt32, directions)
        owner = lane // each
        first = dr.gather(VisiblePoints, points, owner)
        coating = coating_of(table, first.surface, first.valid)
        number = first.number * each + lane % each
        # The rays of a pixel share its lobes evenly.
        u = unit_float(first.series + number * STEPS_2D[0])
        v = unit_float(first.series * 277803737 + number * STEPS_2D[1])
        pick = unit_float(first.series * 69069 + number * GOLDEN_BITS)
        guide, share = None, mi.Float(0)
        if gathers:
            guide = self._guide(points)
            share = dr.select(dr.gather(mi.Bool, guide.found, owner), GUIDED_SHARE, 0)
        guided = pick < share
        pick = dr.select(guided, pick / GUIDED_SHARE, (pick - share) / (1 - share))
        spot = mi.Point2f(u, v)
        direction, _ = sample_coating(coating, first.normal, -first.towards_eye, pick, spot)
        if guide is not None:
            direction = dr.select(guided, guide.sample(owner, pick, spot), direction)
        density = (1 - share) * coating_density(coating, first.normal, direction, first.towards_eye)
        if guide is not None:
            density += share * guide.density(owner, direction)
        ray = Ray(leave(first.point, first.face_normal, direction), direction, first.valid)
        ray.active &= (coating.specularity > 0) & (density > 0)
        ray.active &= dr.dot(direction, first.face_normal) > 0
        ray.active &= dr.dot(direction, first.normal) > 0
        whole = self._is_uncached(first, ray)
        traced = None
        if gathers and self.scenes.indenters is not None:
            every = evaluate_coating(coating, first.normal, direction, first.towards_eye)
            peak = evaluate_peak(coating, first.normal, direction, first.towards_eye)
            traced = dr.select(whole, 1, dr.select(every > 0, peak / every, 0))
            whole = dr.full(mi.Bool, True, count)
        else:
            cos_m = half_vector_cosine(first.normal, direction, first.towards_eye)
            ray.active &= whole | (peak_share(cos_m) > 0)
        found = LobeRays(
            owner,
            direction,
            dr.select(ray.active, density, 0),
            whole,
            dr.zeros(mi.Float, 3 * self.cache.binned.groups * count),
        )
        bits = next_random((first.random ^ (number * GOLDEN_BITS)) * 69069)
        second = mi.Point2f(*(richtmyer(first.series, number, k) for k in (2, 3)))
        dr.eval(found, ray, bits, second, traced)
        self._follow(found, ray, bits, second, traced, gathers)
        return found

    def _guide(self, points: VisiblePoints) -> LobeGuide:
        """Return the guide of the lobes of points on the undeformed skin."""
        light, table = self.cache.binned, self.scenes.full.table
        cell, shift, known = interpolating_cell(
            light.cells, points.point, points.valid, points.series, points.number
        )
        coating = coating_of(table, points.surface, points.valid)
        at = ShadingPoints(points, coating, points.point, cell, shift, known, mi.Bool(False))
        return LobeGuide.of(self.cache.beams, light.groups, at, bin_axis(light.cells, 2))

    def _is_uncached(self, first: VisiblePoints, ray: Ray) -> mi.Bool:
        """Return a mask of rays that meet, before interfaces, coatings without cached light."""
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

    def _follow(
        self,
        found: LobeRays,
        ray: Ray,
        bits: mi.UInt32,
        second: mi.Point2f,
        traced: mi.Color3f | None,
        gathers: bool,
    ) -> None:
        """Add the light that arrives along rays to ``found``.

        Args:
            second: points (2, n) of the unit square that choose the directions from the first skin.
            traced: share (3, n) of the reflected light of each ray that the cache does not hold if
                it comes from skin or lamps; None if no light of mirrored indenters is added.
            gathers: as in `trace`. Rays whose light is read on the skin go on, in the whole lobe,
                but only the light of indenters that they meet is added, which the cache does not
                hold.
        """
        scene = self.scenes.full
        lane = dr.compress(ray.active)
        count = dr.width(lane)
        ray, bits = gathered(ray, lane), dr.gather(mi.UInt32, bits, lane)
        weight = dr.full(mi.Color3f, 1, count)
        read = dr.full(mi.Bool, False, count)
        for reflections in range(MAX_REFLECTIONS):
            if dr.width(lane) < FEWEST_LANES:
                return
            if scene.absorbing:
                clear = self.scenes.absorption is None
                ray.absorption = mi.Color3f(0) if clear else self.scenes.absorption
            if self.channel is not None:
                ray.channel = dr.opaque(mi.UInt32, self.channel, dr.width(lane))
            through = reflections < (1 if gathers else BRANCHED_SEGMENTS)
            kind = RayKind.CAMERA if through else RayKind.REFLECTION
            end, kept = follow_to_coating(scene, ray, weight, bits, kind, roulette=not gathers)
            if dr.width(kept) < FEWEST_LANES:
                return
            lane, bits, read = (dr.gather(type(each), each, kept) for each in (lane, bits, read))
            if reflections == 0 and traced is not None:
                share = dr.gather(mi.Color3f, traced, lane)
                mirrored = _on_indenter(scene.table, end)
                self._subtract_skin_behind(found, end, lane, bits, 1 - share, mirrored)
                end.weight *= dr.select(mirrored, 1, share)
                end.valid &= dr.max(end.weight) > 0
            self._add_lamps(found, end, lane, ~read)
            kept = dr.compress(end.valid)
            if dr.width(kept) < FEWEST_LANES:
                return
            end = gathered(end, kept)
            lane, bits, read = (dr.gather(type(each), each, kept) for each in (lane, bits, read))
            bits = next_random(bits ^ GOLDEN_BITS)
            on_skin, raised = self._add_cached(found, end, lane, bits, read, not gathers)
            if gathers:
                if self.scenes.indenters is None:
                    return
                read = (read | on_skin) & ~raised
            if reflections == 0:
                chosen, copies = split(on_skin, count)
                if copies > 1:
                    end.weight *= dr.select(on_skin, 1, dr.opaque(mi.Float, 1 / copies))
                    dr.eval(end, bits)
                    end = gathered(end, chosen)
                    lane, bits, read, on_skin = (
                        dr.gather(type(each), each, chosen) for each in (lane, bits, read, on_skin)
                    )
                    bits = mi.sample_tea_32(bits, dr.arange(mi.UInt32, dr.width(chosen)))[0]
            only_peak = mi.Bool(False) if gathers else on_skin
            place = mi.Point2f(
                unit_float(bits * 277803737), unit_float((bits ^ GOLDEN_BITS) * 69069)
            )
            if reflections == 0:
                place = dr.select(on_skin, dr.gather(mi.Point2f, second, lane), place)
            ray, weight = _reflected(scene.table, end, only_peak, place)
            dr.eval(ray, weight, bits, read)
            kept = dr.compress(ray.active)
            ray, weight = gathered(ray, kept), dr.gather(mi.Color3f, weight, kept)
            lane, bits, read = (dr.gather(type(each), each, kept) for each in (lane, bits, read))

    def _subtract_skin_behind(
        self,
        found: LobeRays,
        end: PathEnd,
        lane: mi.UInt32,
        bits: mi.UInt32,
        held: mi.Color3f,
        mirrored: mi.Bool,
    ) -> None:
        """Subtract the light of the skin behind indenters that interfaces mirror.

        The cache does not know of contacts: in place of the light of such an indenter, which rays
        of the whole lobe bring, it holds that of the skin behind.

        Args:
            held: share (3, n) of the reflected light of each ray that the cache holds.
            mirrored: mask of the rays that end on indenters.
        """
        kept = dr.compress(mirrored & (dr.max(held) > 0))
        if dr.width(kept) < FEWEST_LANES:
            return
        skin, weight = gathered(end, kept), dr.gather(mi.Color3f, held, kept)
        away = -skin.towards_eye
        behind = self.scenes.fixed.intersect(Ray(skin.point, away, mi.Bool(skin.valid)))
        side = -dr.sign(dr.dot(away, behind.normal))
        skin = replace(
            skin,
            valid=behind.valid,
            weight=-skin.weight * weight,
            point=behind.point,
            normal=behind.shading_normal * side,
            face_normal=behind.normal * side,
            surface=behind.surface,
        )
        lane, bits = dr.gather(mi.UInt32, lane, kept), dr.gather(mi.UInt32, bits, kept)
        dr.eval(skin, lane, bits)
        read = dr.full(mi.Bool, False, dr.width(kept))
        self._add_cached(found, skin, lane, bits, read, False)

    def _add_lamps(self, found: LobeRays, end: PathEnd, lane: mi.UInt32, counts: mi.Bool) -> None:
        """Add the light of the lamps that rays meet, of those rays that the mask ``counts``."""

        def add(value: mi.Float, group: mi.UInt32, lit: mi.Bool) -> None:
            for k in range(3):
                entry = (lane * self.cache.binned.groups + group) * 3 + k
                dr.scatter_add(found.light, end.weight[k] * value, entry, lit & counts)

        self.lamps.add_radiances(end.light, end.towards_eye, add)

    def _add_cached(
        self,
        found: LobeRays,
        end: PathEnd,
        lane: mi.UInt32,
        bits: mi.UInt32,
        read: mi.Bool,
        only_tail: bool,
    ) -> tuple[mi.Bool, mi.Bool]:
        """Add the light of the cache that coatings reflect.

        The undeformed skin reflects it with its diffuse lobe and with its metallic lobe, or the
        tail of it; indenters reflect it with their diffuse lobe, and as though it fell on the skin
        below.

        Args:
            read: mask of the rays to which the skin adds nothing.
            only_tail: whether the peaks of the metallic lobes of the skin are left out.

        Returns:
            Masks of the rays that end on undeformed skin, and of those that end on indenters.
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
        dr.eval(cell, on_skin, raised)
        most = MOST_CACHED if only_tail else MOST_GATHERED
        kept, share = drawn(on_skin & ~read, dr.max(dr.abs(end.weight)), bits, most)
        if dr.width(kept) < FEWEST_LANES:
            return on_skin, raised
        flat = gathered(end, kept)
        cell, lane = dr.gather(mi.UInt32, cell, kept), dr.gather(mi.UInt32, lane, kept)
        coating = coating_of(table, flat.surface, flat.valid)
        coating.only_tail = only_tail
        points = VisiblePoints(**vars(flat), pixel=lane, random=lane, series=lane, number=lane)
        at = ShadingPoints(
            points, coating, flat.point, cell, mi.Vector3f(0), mi.Bool(flat.valid), mi.Bool(False)
        )
        axis = bin_axis(light.cells, 2)
        sums = sum_beams(self.cache.beams, light.groups, at, axis)
        self._add(found, [each * flat.weight / share for each in sums], lane, flat.valid)
        return on_skin, raised

    def _add(
        self, found: LobeRays, light: list[mi.Color3f], lane: mi.UInt32, active: mi.Bool
    ) -> None:
        """Add the light of each light group to the rays of numbers ``lane``."""
        for g, value in enumerate(light):
            for k in range(3):
                entry = (lane * len(light) + g) * 3 + k
                dr.scatter_add(found.light, value[k], entry, active)


def _on_indenter(table: mi.Float, end: PathEnd) -> mi.Bool:
    """Return a mask (n,) of the ends on indenters; skin bent beside them counts as at rest."""
    return end.valid & (surface_region(table, end.surface, end.valid) == int(Region.INDENTER))


def _reflected(
    table: mi.Float, end: PathEnd, only_peak: mi.Bool, place: mi.Point2f
) -> tuple[Ray, mi.Color3f]:
    """Return rays of metallic lobes (of the peak where ``only_peak``), and their weights (3, n)."""
    coating = coating_of(table, end.surface, end.valid)
    direction, share = sample_coating(coating, end.normal, -end.towards_eye, mi.Float(0), place)
    weight = end.weight * share * coating.specularity
    cos_m = half_vector_cosine(end.normal, direction, end.towards_eye)
    weight *= dr.select(only_peak, peak_share(cos_m), 1)
    goes_on = (dr.max(weight) > 0) & (dr.dot(direction, end.face_normal) > 0)
    return Ray(leave(end.point, end.face_normal, direction), direction, goes_on), weight
