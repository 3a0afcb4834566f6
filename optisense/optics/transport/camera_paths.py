"""The camera pass: which points of the coating every pixel sees, and through what.

The main path of a pixel sample always goes through smooth interfaces (weighted with the
transmittance), so the image carries no noise of Fresnel reflections drawn at random. What
interfaces reflect is followed by one more path a sample, its branch drawn in proportion to its
weight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import sequence_2d
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.bsdf import (
    SMOOTH_ALPHA,
    coating_of,
    fresnel_metal,
    grey,
    refract,
    sample_rough_interface,
    surface_kind,
    surface_light,
)
from optisense.optics.scene.ray_scene import RayScene, intersect, leave
from optisense.optics.scene.surfaces import SurfaceKind

MAX_DEPTH = 24
"""Largest number of surfaces that a path from the camera meets."""


@dataclass
class VisiblePoints:
    """Points of opaque surfaces that the camera sees; one entry a path.

    ``weight`` multiplies the radiance that leaves the point along ``towards_eye``; ``light`` is
    the number + 1 of a light that the path ends on instead (its emission is seen), else 0.
    ``random`` are random bits of the path's own, ``series`` those of its pixel, and ``number`` that
    of the sample there: what the samples of a pixel draw from one series is spread evenly.
    """

    pixel: mi.UInt32
    valid: mi.Bool
    weight: mi.Color3f
    point: mi.Point3f
    normal: mi.Vector3f
    face_normal: mi.Vector3f
    towards_eye: mi.Vector3f
    surface: mi.UInt32
    light: mi.UInt32
    random: mi.UInt32
    series: mi.UInt32
    number: mi.UInt32


@dr.syntax
def _follow(
    scene: mi.Scene,
    rows: mi.Float,
    corners: mi.Float,
    surfaces: mi.Float,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    weight: mi.Color3f,
    start: mi.Bool,
    rng: mi.PCG32,
    split: bool,
    coherent: bool,
    rough: bool,
    max_depth: mi.UInt32,
) -> tuple[Any, ...]:
    active = mi.Bool(start)
    depth = mi.UInt32(0)
    found = mi.Bool(False)
    light = mi.UInt32(0)
    point = mi.Point3f(0)
    normal = mi.Vector3f(0, 0, 1)
    face_normal = mi.Vector3f(0, 0, 1)
    towards_eye = mi.Vector3f(0, 0, 1)
    surface = mi.UInt32(0)
    branch_total = mi.Color3f(0)
    branch_origin = mi.Point3f(0)
    branch_direction = mi.Vector3f(0, 0, 1)
    while active:
        hit = intersect(scene, rows, corners, origin, direction, active, coherent)
        kind, eta, alpha = surface_kind(surfaces, hit.surface, hit.valid)
        active &= hit.valid & (kind != int(SurfaceKind.ABSORBER))
        is_light = active & (kind == int(SurfaceKind.LIGHT))
        seen = active & (kind == int(SurfaceKind.OPAQUE))
        lit = is_light & (dr.dot(direction, hit.normal) < 0)
        light = dr.select(lit, surface_light(surfaces, hit.surface, lit) + 1, light)
        side = -dr.sign(dr.dot(direction, hit.normal))
        point = dr.select(seen, hit.point, point)
        normal = dr.select(seen, hit.shading_normal * side, normal)
        face_normal = dr.select(seen | is_light, hit.normal * side, face_normal)
        towards_eye = dr.select(seen | is_light, -direction, towards_eye)
        surface = dr.select(seen, hit.surface, surface)
        found |= seen
        active &= ~seen & ~is_light

        reflectance, reflected, transmitted, relative = refract(direction, hit.shading_normal, eta)
        interface = active & (kind == int(SurfaceKind.DIELECTRIC))
        if dr.hint(split, mode="scalar"):
            through = reflectance < 1
            branch = (
                dr.select(interface & through & (alpha <= SMOOTH_ALPHA), 1.0, 0.0) * reflectance
            )
            branch_weight = weight * branch
            branch_total += branch_weight
            chosen = (branch > 0) & (rng.next_float32() * grey(branch_total) < grey(branch_weight))
            branch_origin = dr.select(
                chosen, leave(hit.point, hit.normal, reflected), branch_origin
            )
            branch_direction = dr.select(chosen, reflected, branch_direction)
            passed = dr.select(through, 1 - reflectance, 1.0)
        else:
            through = rng.next_float32() >= reflectance
            passed = mi.Float(1.0)
        outgoing = dr.select(through, transmitted, reflected)
        factor = mi.Color3f(dr.select(through, passed / (relative * relative), passed))
        if dr.hint(rough, mode="scalar"):
            pick = rng.next_float32()
            sample = mi.Point2f(rng.next_float32(), rng.next_float32())
            if interface & (alpha > SMOOTH_ALPHA):
                scattered, rough_weight, _through, rough_relative = sample_rough_interface(
                    direction, hit.shading_normal, eta, alpha, pick, sample
                )
                outgoing = scattered
                factor = mi.Color3f(rough_weight / (rough_relative * rough_relative))
        mirror = active & (kind == int(SurfaceKind.MIRROR))
        if mirror:
            coating = coating_of(surfaces, hit.surface, mirror)
            facing = hit.shading_normal * side
            cosine = -dr.dot(direction, facing)
            outgoing = direction + facing * (2 * cosine)
            factor = fresnel_metal(dr.abs(cosine), coating.metal_eta, coating.metal_k)
        weight = dr.select(active, weight * factor, weight)
        direction = dr.select(active, dr.normalize(outgoing), direction)
        origin = dr.select(active, leave(hit.point, hit.normal, direction), origin)
        depth += 1
        active &= depth < max_depth
    return (
        found,
        weight,
        point,
        normal,
        face_normal,
        towards_eye,
        surface,
        light,
        branch_total,
        branch_origin,
        branch_direction,
    )


def film_samples(pixel: mi.UInt32, width: int, sample: mi.UInt32, seed: int) -> mi.Point2f:
    """Film positions of samples of pixels; sample 0 is the pixel's middle, the others are
    spread over it.
    """
    jitter = sequence_2d(sample, pixel, dr.opaque(mi.UInt32, seed))
    middle = sample == 0
    x = mi.Float(pixel % width) + dr.select(middle, 0.5, jitter.x)
    y = mi.Float(pixel // width) + dr.select(middle, 0.5, jitter.y)
    return mi.Point2f(x, y)


def find_visible_points(
    scene: RayScene,
    camera: RayCamera,
    pixel: mi.UInt32,
    number: mi.UInt32,
    film: mi.Point2f,
    seed: int,
    only_main: bool = False,
) -> tuple[VisiblePoints, VisiblePoints | None]:
    """Main and reflected visible points of film positions (the second are fewer, or none, as they
    are with ``only_main``).

    What is drawn at random follows from pixel, ``number`` of the sample and seed alone, so that
    each path is the same whichever others are traced with it.
    """
    dr.make_opaque(number)  # one kernel for all numbers
    origin, direction = camera.rays(film.x, film.y)
    stream = mi.sample_tea_32(number, dr.opaque(mi.UInt32, seed))[0]
    own, other = mi.sample_tea_32(pixel, stream)
    series = mi.sample_tea_32(pixel, dr.opaque(mi.UInt32, seed))[1]
    depth = dr.opaque(mi.UInt32, MAX_DEPTH)
    tables = (scene.scene, scene.rows, scene.corners, scene.table)
    start = dr.full(mi.Bool, True, dr.width(film))
    out = _follow(
        *tables,
        origin,
        direction,
        mi.Color3f(1),
        start,
        _generator(own),
        True,
        True,
        scene.rough,
        depth,
    )
    dr.eval(out, own, other, series)
    main = VisiblePoints(*(pixel, *out[:8], own, series, number))
    total, branch_origin, branch_direction = out[8:]
    if only_main:
        return main, None
    lanes = dr.compress(dr.max(total) > 1e-5)
    if dr.width(lanes) == 0:
        return main, None
    other, series, number = (dr.gather(mi.UInt32, each, lanes) for each in (other, series, number))
    branch = _follow(
        *tables,
        dr.gather(mi.Point3f, branch_origin, lanes),
        dr.gather(mi.Vector3f, branch_direction, lanes),
        dr.gather(mi.Color3f, total, lanes),
        dr.full(mi.Bool, True, dr.width(lanes)),
        _generator(other),
        False,
        False,
        scene.rough,
        depth,
    )
    dr.eval(branch, other, series, number)
    kept = dr.compress(branch[0] | (branch[7] > 0))
    if dr.width(kept) == 0:
        return main, None
    alone = dr.width(kept) == 1
    if (
        alone
    ):  # Dr.Jit compiles other kernels for arrays of one entry: add one that counts for nothing
        kept = dr.repeat(kept, 2)
    picked: list[Any] = [
        dr.gather(type(value), value, kept) for value in (*branch[:8], other, series, number)
    ]
    pixels = dr.gather(mi.UInt32, pixel, dr.gather(mi.UInt32, lanes, kept))
    reflected = VisiblePoints(pixels, *picked)
    if alone:
        first = dr.arange(mi.UInt32, 2) == 0
        reflected.valid &= first
        reflected.light = dr.select(first, reflected.light, 0)
    dr.eval(reflected)
    return main, reflected


def _generator(bits: mi.UInt32) -> mi.PCG32:
    """Random numbers that follow from these bits and not from the place in an array."""
    random = mi.PCG32()
    random.seed(mi.UInt64(bits), mi.UInt64(bits))
    return random
