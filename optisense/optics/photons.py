"""The photon pass: light leaves the emitters, is refracted, reflected and scattered, and is recorded wherever
it lands on an opaque surface.

Photons carry all light, direct light included, so nothing is connected to lights from elsewhere (no next-event
estimation) and no light is counted twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from optisense.optics.emitters import EmitterTable, emit
from optisense.optics.guide import CELLS, Guide, warp
from optisense.optics.ray_scene import RayScene, intersect, leave
from optisense.optics.sampling import sequence_4d
from optisense.optics.scattering import (
    SMOOTH_ALPHA,
    coating_of,
    fresnel_metal,
    refract,
    sample_coating,
    sample_rough_interface,
    surface_kind,
)
from optisense.optics.surfaces import SurfaceKind

# Photons are dropped after so many surfaces; in GelSight-like sensors less than 0.1 % of the light gets there.
MAX_DEPTH = 32

FIRST_LANDING = 1 << 8
GROUP_MASK = FIRST_LANDING - 1
SURFACE_SHIFT = 9


@dataclass
class PhotonMap:
    """Landings of photons, all of one pass.

    ``cells`` tells for each photon emitted which cell of the guide it came from, all ones if it never landed.
    ``place`` holds x, y, z (mm) and bits (light group, whether first landing, surface); ``travel`` the unit direction
    and the cosine with the face normal; ``power`` the photon's share of a light of 1 mW, per channel.
    """

    count: int
    emitted: int
    place: mi.Float
    travel: mi.Float
    power: mi.Float
    coloured: bool
    cells: mi.UInt32


@dr.syntax
def _trace(
    scene: mi.Scene,
    rows: mi.Float,
    corners: mi.Float,
    surfaces: mi.Float,
    table: EmitterTable,
    guide: Guide,
    first: mi.UInt32,
    per_light: mi.UInt32,
    seed: mi.UInt32,
    capacity: mi.UInt32,
    counter: mi.UInt32,
    place: mi.Float,
    travel: mi.Float,
    power: mi.Float,
    photons: int,
    coloured: bool,
    max_depth: mi.UInt32,
    rough: bool,
):
    index = dr.arange(mi.UInt32, photons)
    light = index % table.count
    number = first + index // table.count
    u0, u1, u2, u3 = sequence_4d(number, light, seed)
    angle, weight, cell = warp(guide, light, mi.Point2f(u0, u1))
    origin, direction, group = emit(table, light, angle, mi.Point2f(u2, u3))
    weight /= mi.Float(per_light)
    rng = mi.PCG32(size=photons, initstate=mi.UInt64(seed), initseq=mi.UInt64(index + first))
    throughput = mi.Color3f(weight)
    active = mi.Bool(True)
    landed = mi.Bool(False)
    depth = mi.UInt32(0)
    while active:
        hit = intersect(scene, rows, corners, origin, direction, active)
        kind, eta, alpha, specularity = surface_kind(surfaces, hit.surface, hit.valid)
        active &= hit.valid & (kind != int(SurfaceKind.ABSORBER)) & (kind != int(SurfaceKind.LIGHT))
        opaque = active & (kind == int(SurfaceKind.OPAQUE))
        cosine = dr.abs(dr.dot(direction, hit.normal))
        if opaque:
            slot = dr.scatter_inc(counter, mi.UInt32(0), opaque)
            kept = opaque & (slot < capacity)
            bits = (
                group
                | dr.select(landed, mi.UInt32(0), mi.UInt32(FIRST_LANDING))
                | (hit.surface << SURFACE_SHIFT)
            )
            p = hit.point
            d = direction
            dr.scatter(
                place, mi.Vector4f(p.x, p.y, p.z, dr.reinterpret_array(mi.Float, bits)), slot, kept
            )
            dr.scatter(travel, mi.Vector4f(d.x, d.y, d.z, cosine), slot, kept)
            if dr.hint(coloured, mode="scalar"):
                t = throughput
                dr.scatter(power, mi.Vector4f(t.x, t.y, t.z, 0), slot, kept)
            else:
                dr.scatter(power, throughput.x, slot, kept)
        pick = rng.next_float32()
        sample = mi.Point2f(rng.next_float32(), rng.next_float32())
        reflectance, reflected, transmitted, relative = refract(direction, hit.shading_normal, eta)
        outgoing = dr.select(pick < reflectance, reflected, transmitted)
        if dr.hint(rough, mode="scalar"):
            is_rough = active & (kind == int(SurfaceKind.DIELECTRIC)) & (alpha > SMOOTH_ALPHA)
            if is_rough:
                scattered, rough_weight, through, relative = sample_rough_interface(
                    direction, hit.shading_normal, eta, alpha, pick, sample
                )
                outgoing = scattered
                throughput *= rough_weight
        if opaque | (active & (kind == int(SurfaceKind.MIRROR))):
            coating = coating_of(surfaces, hit.surface, active)
            facing = hit.shading_normal * -dr.sign(dr.dot(direction, hit.normal))
            spread, albedo = sample_coating(coating, facing, direction, pick * 0.999999, sample)
            mirror = kind == int(SurfaceKind.MIRROR)
            back = direction + facing * (-2 * dr.dot(direction, facing))
            metal = fresnel_metal(
                dr.abs(dr.dot(direction, facing)), coating.metal_eta, coating.metal_k
            )
            albedo = dr.select(mirror, metal, albedo)
            outgoing = dr.select(mirror, back, spread)
            survival = dr.minimum(dr.max(albedo), 0.95)
            active &= rng.next_float32() < survival
            throughput *= albedo / dr.maximum(survival, 1e-6)
        landed |= opaque
        direction = dr.normalize(outgoing)
        origin = leave(hit.point, hit.normal, direction)
        depth += 1
        active &= depth < max_depth
    return dr.select(landed, light * (CELLS * CELLS) + cell, mi.UInt32(0xFFFFFFFF))


def trace_photons(
    scene: RayScene,
    table: EmitterTable,
    guide: Guide,
    per_light: int,
    seed: int,
    *,
    first: int = 0,
    coloured: bool,
    landings: float = 1.0,
    max_depth: int = MAX_DEPTH,
) -> PhotonMap:
    """Emit ``per_light`` photons from each light and record where they land.

    ``first`` is the number of photons a light has already sent in earlier passes of the same seed; ``landings`` an upper
    bound of landings a photon, for the size of the record (more are counted but dropped, and reported as an error).
    Each light has 1 mW in all.
    """
    photons = per_light * table.count
    capacity = int(photons * landings) + 1024
    counter = mi.UInt32(0)
    dr.make_opaque(counter)
    place, travel = dr.empty(mi.Float, capacity * 4), dr.empty(mi.Float, capacity * 4)
    power = dr.empty(mi.Float, capacity * (4 if coloured else 1))
    opaque = [dr.opaque(mi.UInt32, v) for v in (first, per_light, seed, capacity, max_depth)]
    cells = _trace(
        scene.scene,
        scene.rows,
        scene.corners,
        scene.table,
        table,
        guide,
        opaque[0],
        opaque[1],
        opaque[2],
        opaque[3],
        counter,
        place,
        travel,
        power,
        photons,
        coloured,
        opaque[4],
        scene.rough,
    )
    dr.eval(cells, counter, place, travel, power)
    return PhotonMap(
        count=min(int(counter[0]), capacity),
        emitted=photons,
        place=place,
        travel=travel,
        power=power,
        coloured=coloured,
        cells=cells,
    )
