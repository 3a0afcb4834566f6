"""The photon pass: light leaves the emitters, is refracted, reflected and scattered, and is
recorded wherever it lands on an opaque surface.

Photons carry all light, direct light included, so nothing is connected to lights from elsewhere
(no next-event estimation) and no light is counted twice.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.backend.arrays import indices
from optisense.optics.backend.sequences import seed_of, sequence_4d, unit_float
from optisense.optics.scene.bsdf import (
    SMOOTH_ALPHA,
    coating_of,
    fresnel_metal,
    refract,
    sample_coating,
    sample_rough_interface,
    surface_kind,
)
from optisense.optics.scene.emitters import EmitterTable, emit
from optisense.optics.scene.ray_scene import RayScene, intersect, leave
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at
from optisense.optics.scene.surfaces import SurfaceKind
from optisense.optics.transport.emission_guide import GUIDE_CELLS, EmissionGuide, warp
from optisense.optics.transport.volume_flux import SAMPLES_PER_SEGMENT, FluxLayer, sample_segment

MAX_DEPTH = 64
"""Largest number of surfaces that a photon meets. In GelSight-like sensors less than 0.1 % of the
light gets so far."""

GROUP_MASK = 0xFF
"""Bits of a photon's record that hold its light group."""
HALF_SHIFT = 8
"""Position of the bit that tells photons of odd number from those of even number. The difference
between the two halves gives the noise."""
SURFACE_SHIFT = 9
"""Position of the first bit of the number of the surface that a photon landed on."""


@dataclass
class PhotonMap:
    """The landings of one photon pass.

    Attributes:
        count: number of landings.
        emitted: photons of all lights, including those that are not lit in this pass.
        place: four floats per landing: x, y, z (mm) and bits (light group, half, surface).
        travel: four floats per landing: the unit direction and the cosine of incidence.
        power: the photon's share of a light of 1 mW, per channel if ``coloured``.
        coloured: whether powers differ between the channels.
        passing: the photons that crossed the flux layer, if one was given. The layer's height over
        the
            length of path that each stands for takes the place of the cosine.
    """

    count: int
    emitted: int
    place: mi.Float
    travel: mi.Float
    power: mi.Float
    coloured: bool
    passing: PhotonMap | None = None


STAGES = (4, 4, 6)
"""Numbers of surfaces after which the surviving photons are gathered into a dense array. Photons
with long paths would leave most lanes of a vector idle."""
LANDINGS_PER_PHOTON = 1.5
"""Landings per photon that memory is reserved for at first. A pass with more is traced again with
more room."""
MIN_GATHERED_PHOTONS = 100_000
"""Photons of a pass below which gathering the survivors costs more than it saves."""


@dataclass
class _Flight:
    """Photons under way; ``number`` is a photon's place in the pass, ``group`` its light group and
    half.
    """

    origin: mi.Point3f
    direction: mi.Vector3f
    throughput: mi.Color3f
    group: mi.UInt32
    landed: mi.Bool
    active: mi.Bool
    scattered: mi.Bool
    number: mi.UInt32


@dataclass
class TargetCells:
    """Surface cells that photons should reach: ``flags`` is 1 in those in or near the camera's
    view.
    """

    cells: SurfaceCells
    flags: mi.UInt32


@dataclass
class _Record:
    """Where landings are written."""

    capacity: mi.UInt32
    counter: mi.UInt32
    place: mi.Float
    travel: mi.Float
    power: mi.Float


def _launch(
    table: EmitterTable,
    guide: EmissionGuide,
    lights: mi.UInt32,
    first: mi.UInt32,
    per_light: mi.UInt32,
    seed: mi.UInt32,
    photons: int,
) -> tuple[_Flight, mi.UInt32]:
    index = dr.arange(mi.UInt32, photons)
    count = dr.opaque(mi.UInt32, dr.width(lights))
    light = dr.gather(mi.UInt32, lights, index % count)
    place = index // count
    number = first + place
    u0, u1, u2, u3 = sequence_4d(number, light, seed)
    angle, weight, cell = warp(guide, light, mi.Point2f(u0, u1))
    origin, direction, group = emit(table, light, angle, mi.Point2f(u2, u3))
    flight = _Flight(
        origin=origin,
        direction=direction,
        throughput=mi.Color3f(weight / mi.Float(per_light)),
        group=group | ((number & 1) << HALF_SHIFT),
        landed=dr.full(mi.Bool, False, photons),
        active=dr.full(mi.Bool, True, photons),
        scattered=dr.full(mi.Bool, False, photons),
        number=place * table.count + light,
    )
    return flight, light * (GUIDE_CELLS * GUIDE_CELLS) + cell


@dr.syntax
def _fly(
    scene: mi.Scene,
    rows: mi.Float,
    corners: mi.Float,
    surfaces: mi.Float,
    flight: _Flight,
    record: _Record,
    target: TargetCells | None,
    flux_layer: FluxLayer | None,
    passing: _Record,
    coloured: bool,
    rough: bool,
    limit: mi.UInt32,
    seed: mi.UInt64,
) -> _Flight:
    origin = mi.Point3f(flight.origin)
    direction = mi.Vector3f(flight.direction)
    throughput = mi.Color3f(flight.throughput)
    group = flight.group
    landed = mi.Bool(flight.landed)
    active = mi.Bool(flight.active)
    scattered = mi.Bool(flight.scattered)
    # By the photon's number alone: with `size` its lane would count too, and after a stage all
    # photons behind one that ended elsewhere would go other ways. So a small change of the design
    # changes little but what it touches.
    rng = mi.PCG32(initstate=seed, initseq=mi.UInt64(flight.number))
    depth = mi.UInt32(0)
    while active & (depth < limit):
        hit = intersect(scene, rows, corners, origin, direction, active)
        kind, eta, alpha = surface_kind(surfaces, hit.surface, hit.valid)
        flying = mi.Bool(active)
        active &= hit.valid & (kind != int(SurfaceKind.ABSORBER)) & (kind != int(SurfaceKind.LIGHT))
        opaque = active & (kind == int(SurfaceKind.OPAQUE))
        if flux_layer is not None:
            # What has left an opaque surface and meets none is exchange.py's part.
            passes = flying & (opaque | ~scattered)
            bits = mi.UInt32(seed) ^ (flight.number * 747796405) ^ (depth * 0x9E3779B9)
            # Hashed: neighbouring photons have neighbouring bits.
            chance = unit_float(mi.sample_tea_32(bits, mi.UInt32(0))[0])
            piece = mi.UInt32(0)
            while passes & (piece < SAMPLES_PER_SEGMENT):
                spot, share, crosses = sample_segment(
                    flux_layer, hit, origin, direction, chance, piece, opaque
                )
                if crosses:
                    slot = dr.scatter_inc(passing.counter, mi.UInt32(0), crosses)
                    kept = crosses & (slot < passing.capacity)
                    _write(passing, slot, kept, spot, group, direction, share, throughput, coloured)
                piece += 1
            scattered = opaque
        if opaque:
            slot = dr.scatter_inc(record.counter, mi.UInt32(0), opaque)
            kept = opaque & (slot < record.capacity)
            bits = group | (hit.surface << SURFACE_SHIFT)
            cosine = dr.abs(dr.dot(direction, hit.normal))
            _write(record, slot, kept, hit.point, bits, direction, cosine, throughput, coloured)
        if target is not None:
            cell, found = cell_at(target.cells, hit.point, opaque)
            landed |= found & (dr.gather(mi.UInt32, target.flags, cell, found) != 0)
        pick = rng.next_float32()
        sample = mi.Point2f(rng.next_float32(), rng.next_float32())
        reflectance, reflected, transmitted, _relative = refract(direction, hit.shading_normal, eta)
        outgoing = dr.select(pick < reflectance, reflected, transmitted)
        if dr.hint(rough, mode="scalar"):
            is_rough = active & (kind == int(SurfaceKind.DIELECTRIC)) & (alpha > SMOOTH_ALPHA)
            if is_rough:
                outgoing, rough_weight, _through, _relative = sample_rough_interface(
                    direction, hit.shading_normal, eta, alpha, pick, sample
                )
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
        direction = dr.normalize(outgoing)
        origin = leave(hit.point, hit.normal, direction)
        depth += 1
    return _Flight(origin, direction, throughput, group, landed, active, scattered, flight.number)


def _write(
    record: _Record,
    slot: mi.UInt32,
    kept: mi.Bool,
    point: mi.Point3f,
    bits: mi.UInt32,
    direction: mi.Vector3f,
    share: mi.Float,
    throughput: mi.Color3f,
    coloured: bool,
) -> None:
    """Record a landing; ``share`` is the cosine of incidence or its counterpart in a layer."""
    p, d, t = point, direction, throughput
    where = mi.Vector4f(p.x, p.y, p.z, dr.reinterpret_array(mi.Float, bits))
    dr.scatter(record.place, where, slot, kept)
    dr.scatter(record.travel, mi.Vector4f(d.x, d.y, d.z, share), slot, kept)
    if coloured:
        dr.scatter(record.power, mi.Vector4f(t.x, t.y, t.z, 0), slot, kept)
    else:
        dr.scatter(record.power, t.x, slot, kept)


def _gathered(flight: _Flight, lanes: mi.UInt32) -> _Flight:
    values = [getattr(flight, field.name) for field in fields(_Flight)]
    return _Flight(*(dr.gather(type(value), value, lanes) for value in values))


def _trace(
    scene: RayScene,
    table: EmitterTable,
    guide: EmissionGuide,
    per_light: int,
    seed: int,
    first: int,
    record: _Record,
    target: TargetCells | None,
    flux_layer: FluxLayer | None,
    passing: _Record,
    coloured: bool,
    lights: mi.UInt32,
) -> mi.UInt32:
    """Trace a pass stage by stage.

    Returns:
        The guide's cell of each photon, or all ones if it never landed.
    """
    photons = per_light * dr.width(lights)
    a, b, c = (dr.opaque(mi.UInt32, value) for value in (first, per_light, seed))
    flight, cell = _launch(table, guide, lights, a, b, c, photons)
    arrived = dr.zeros(mi.UInt32, photons)
    travelled = 0
    stages = STAGES if photons > MIN_GATHERED_PHOTONS else ()
    for stage in range(len(stages) + 1):
        steps = stages[stage] if stage < len(stages) else MAX_DEPTH - travelled
        travelled += steps
        flight = _fly(
            scene.scene,
            scene.rows,
            scene.corners,
            scene.table,
            flight,
            record,
            target,
            flux_layer,
            passing,
            coloured,
            scene.rough,
            dr.opaque(mi.UInt32, steps),
            dr.opaque(mi.UInt64, seed_of(seed, first, stage)),
        )
        if target is not None:
            dr.scatter(arrived, mi.UInt32(1), flight.number, flight.landed)
        dr.eval(flight, arrived, cell, record, passing)
        lanes = dr.compress(flight.active)
        if dr.width(lanes) == 0 or travelled >= MAX_DEPTH:
            break
        flight = _gathered(flight, lanes)
    return dr.select(arrived != 0, cell, mi.UInt32(0xFFFFFFFF))


def trace_pilot(
    scene: RayScene,
    table: EmitterTable,
    guide: EmissionGuide,
    per_light: int,
    seed: int,
    target: TargetCells,
    coloured: bool,
) -> tuple[mi.UInt32, PhotonMap]:
    """Trace the pilot pass.

    Returns:
        For each photon the cell of the guide that it came from, or all ones if it missed the
        target;
        and the photon map.
    """
    lights = dr.arange(mi.UInt32, table.count)
    return _traced(scene, table, guide, per_light, seed, 0, target, None, coloured, lights)


def trace_photons(
    scene: RayScene,
    table: EmitterTable,
    guide: EmissionGuide,
    per_light: int,
    seed: int,
    *,
    first: int = 0,
    coloured: bool,
    groups: Collection[int] | None = None,
    flux_layer: FluxLayer | None = None,
) -> PhotonMap:
    """Emit ``per_light`` photons from each light and record where they land.

    Args:
        scene: the surfaces.
        table: the lights; each emits 1 mW.
        guide: the sampling density of emission.
        per_light: photons of each light.
        seed: of the pass.
        first: photons that each light has already sent in earlier passes of the same seed.
        coloured: whether surfaces are coloured.
        groups: the light groups that are lit; all if None. Their photons are the same in both
        cases.
        flux_layer: photons that cross this layer are recorded, too.
    """
    chosen = [
        k for k, emitter in enumerate(table.emitters) if groups is None or emitter.group in groups
    ]
    lights = indices(np.array(chosen))
    return _traced(scene, table, guide, per_light, seed, first, None, flux_layer, coloured, lights)[
        1
    ]


def _traced(
    scene: RayScene,
    table: EmitterTable,
    guide: EmissionGuide,
    per_light: int,
    seed: int,
    first: int,
    target: TargetCells | None,
    flux_layer: FluxLayer | None,
    coloured: bool,
    lights: mi.UInt32,
) -> tuple[mi.UInt32, PhotonMap]:
    """Trace a pass and collect its landings; one with more landings than room is repeated."""
    photons = per_light * dr.width(lights)
    room, room_passing = (
        int(photons * each) + 1024 for each in (LANDINGS_PER_PHOTON, SAMPLES_PER_SEGMENT)
    )
    while True:
        record = _room(room, coloured)
        passing = _room(0 if flux_layer is None else room_passing, coloured)
        flown = (scene, table, guide, per_light, seed, first, record, target, flux_layer, passing)
        cells = _trace(*flown, coloured, lights)
        landed, passed = int(record.counter[0]), int(passing.counter[0])
        if landed <= room and passed <= room_passing:
            break
        room, room_passing = (max(int(1.2 * n), 1024) for n in (landed, passed))
    emitted = per_light * table.count
    met = None if flux_layer is None else _photon_map(passing, passed, emitted, coloured)
    return cells, _photon_map(record, landed, emitted, coloured, met)


def _room(capacity: int, coloured: bool) -> _Record:
    """Empty records for this number of landings."""
    size = max(capacity, 1)
    return _Record(
        capacity=dr.opaque(mi.UInt32, capacity),
        counter=dr.zeros(mi.UInt32, 1),
        place=dr.empty(mi.Float, size * 4),
        travel=dr.empty(mi.Float, size * 4),
        power=dr.empty(mi.Float, size * (4 if coloured else 1)),
    )


def _photon_map(
    record: _Record, count: int, emitted: int, coloured: bool, passing: PhotonMap | None = None
) -> PhotonMap:
    place, travel, power = record.place, record.travel, record.power
    if count == 0:
        # The renderer takes no empty arrays: one photon without power stands for none.
        count = 1
        place, travel, power = (dr.zeros(mi.Float, 4) for _ in range(3))
    return PhotonMap(count, emitted, place, travel, power, coloured, passing)
