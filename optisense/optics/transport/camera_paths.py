"""The camera pass: paths from the pixels to the points of the coating that they see.

The main path of a pixel sample always goes through interfaces (weighted with the transmittance), so
the image has no noise of randomly drawn Fresnel reflections. The reflections at interfaces are
followed by one further path per sample, whose branch is drawn in proportion to its weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.arrays import FEWEST_LANES, gathered
from optisense.optics.backend.sequences import folded_lattice, sequence_2d
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.coating_bsdf import grey
from optisense.optics.scene.ray_scene import Ray, RayScene, leave
from optisense.optics.scene.surface_table import surface_light
from optisense.optics.transport.interact import LobeSample, RayKind, interact


@dataclass
class PathEnd:
    """End points of paths from the camera.

    Attributes:
        valid: mask of the paths that end on an opaque surface.
        weight: factor on the radiance that leaves the point along ``towards_eye``.
        point: the end point, mm.
        normal: the shading normal, on the path's side.
        face_normal: the normal of the triangle, on the path's side.
        towards_eye: unit vector back along the path.
        surface: the surface's number.
        light: the number + 1 of the light whose emitting face the path ends on, else 0.
        scattered: mask of the paths that meet a rough interface.
    """

    valid: mi.Bool
    weight: mi.Color3f
    point: mi.Point3f
    normal: mi.Vector3f
    face_normal: mi.Vector3f
    towards_eye: mi.Vector3f
    surface: mi.UInt32
    light: mi.UInt32
    scattered: mi.Bool


@dataclass
class VisiblePoints(PathEnd):
    """Points of opaque surfaces that the camera sees, one entry per path.

    Attributes:
        pixel: the path's pixel.
        random: random bits of the path.
        series: random bits of its pixel. The numbers that the samples of a pixel draw from one
            series are spread evenly.
        number: number of the sample in its pixel.
    """

    pixel: mi.UInt32
    random: mi.UInt32
    series: mi.UInt32
    number: mi.UInt32


@dataclass
class Paths:
    """Paths that `follow` has followed.

    Attributes:
        end: their ends.
        branch: for each path from the camera one of its reflections at interfaces, drawn in
            proportion to its weight; of other paths, inactive rays.
        branch_weight: sum (3, n) of the weights of its reflections.
        branch_scattered: mask of the branches that have met a rough interface.
        stopped: the rays that meet a rough interface before which the paths stop; of other paths,
            inactive rays.
        stopped_weight: factor (3, n) on the radiance at the origins of these rays.
    """

    end: PathEnd
    branch: Ray
    branch_weight: mi.Color3f
    branch_scattered: mi.Bool
    stopped: Ray
    stopped_weight: mi.Color3f


@dr.syntax
def follow(
    scene: RayScene,
    ray: Ray,
    weight: mi.Color3f,
    rng: mi.PCG32,
    ray_kind: RayKind,
    until_rough: bool = False,
    first: LobeSample | None = None,
) -> Paths:
    """Follow paths to their ends.

    Args:
        ray: the rays that the paths begin with.
        weight: factor (3, n) on the radiance at the paths' beginnings.
        rng: a random generator for each path.
        ray_kind: the kind of the rays, `RayKind.CAMERA` or `RayKind.REFLECTION`.
        until_rough: whether paths stop before rough interfaces.
        first: random numbers of each path's first interaction, in place of those of ``rng``.
    """
    opening = LobeSample() if first is None else first
    begins = mi.Bool(True)
    found = mi.Bool(False)
    light = mi.UInt32(0)
    scattered = mi.Bool(False)
    point = mi.Point3f(0)
    normal = mi.Vector3f(0, 0, 1)
    face_normal = mi.Vector3f(0, 0, 1)
    towards_eye = mi.Vector3f(0, 0, 1)
    surface = mi.UInt32(0)
    total = mi.Color3f(0)
    branch_origin = mi.Point3f(0)
    branch_direction = mi.Vector3f(0, 0, 1)
    branch_absorption = ray.absorption
    branch_scattered = mi.Bool(False)
    stopped_origin = mi.Point3f(0)
    stopped_direction = mi.Vector3f(0, 0, 1)
    stopped_weight = mi.Color3f(0)
    stopped_absorption = ray.absorption
    while dr.hint(ray.active, exclude=[scene, ray_kind, until_rough, first, opening]):
        sample = None
        if dr.hint(ray_kind.draws or scene.rough, mode="scalar"):
            sample = LobeSample(rng.next_float32())
            if dr.hint(scene.rough, mode="scalar"):
                sample.place = mi.Point2f(rng.next_float32(), rng.next_float32())
            if dr.hint(first is not None, mode="scalar"):
                sample.pick = dr.select(begins, opening.pick, sample.pick)
                sample.place = dr.select(begins, opening.place, sample.place)
                begins = mi.Bool(False)
        step = interact(scene, ray, ray_kind, sample)
        hit = step.hit
        seen = step.opaque
        ends = seen | step.light
        lit = step.light & (step.side > 0)
        light = dr.select(lit, surface_light(scene.table, hit.surface, lit) + 1, light)
        point = dr.select(seen, hit.point, point)
        normal = dr.select(seen, hit.shading_normal * step.side, normal)
        face_normal = dr.select(ends, hit.normal * step.side, face_normal)
        towards_eye = dr.select(ends, -ray.direction, towards_eye)
        surface = dr.select(seen, hit.surface, surface)
        found |= seen
        if dr.hint(scene.rough, mode="scalar"):
            scattered |= step.rough
        if dr.hint(until_rough, mode="scalar"):
            stopped_origin = dr.select(step.rough, ray.origin, stopped_origin)
            stopped_direction = dr.select(step.rough, ray.direction, stopped_direction)
            stopped_weight = dr.select(step.rough, weight, stopped_weight)
            if dr.hint(scene.absorbing, mode="scalar"):
                stopped_absorption = dr.select(step.rough, ray.absorption, stopped_absorption)
            step.ray.active &= ~step.rough
        weight *= step.transmittance
        if dr.hint(ray_kind is RayKind.CAMERA, mode="scalar"):
            branch = weight * step.reflection.weight
            if dr.hint(until_rough, mode="scalar"):
                branch = dr.select(step.rough, 0, branch)
            total += branch
            chosen = dr.max(branch) > 0
            chosen &= rng.next_float32() * grey(total) < grey(branch)
            away = step.reflection.direction
            branch_origin = dr.select(chosen, leave(hit.point, hit.normal, away), branch_origin)
            branch_direction = dr.select(chosen, away, branch_direction)
            branch_scattered = dr.select(chosen, scattered, branch_scattered)
            if dr.hint(scene.absorbing, mode="scalar"):
                branch_absorption = dr.select(chosen, step.absorption, branch_absorption)
        weight = dr.select(step.goes_on, weight * step.lobe.weight, weight)
        ray = step.ray
    end = PathEnd(found, weight, point, normal, face_normal, towards_eye, surface, light, scattered)
    branched = Ray(branch_origin, branch_direction, dr.max(total) > 1e-5)
    branched.absorption, branched.channel = branch_absorption, ray.channel
    stopped = Ray(stopped_origin, stopped_direction, dr.max(stopped_weight) > 0)
    stopped.absorption, stopped.channel = stopped_absorption, ray.channel
    return Paths(end, branched, total, branch_scattered, stopped, stopped_weight)


def follow_branches(scene: RayScene, paths: Paths, lanes: mi.UInt32, bits: mi.UInt32) -> PathEnd:
    """Follow the reflections that `follow` has drawn of some paths from the camera to their ends.

    Args:
        lanes: numbers (k,) of the paths whose reflections are followed.
        bits: random bits (k,) of each of these.
    """
    ray, weight = gathered(paths.branch, lanes), dr.gather(mi.Color3f, paths.branch_weight, lanes)
    end = follow(scene, ray, weight, generator(bits), RayKind.REFLECTION).end
    end.scattered |= dr.gather(mi.Bool, paths.branch_scattered, lanes)
    return end


MAX_PIXEL_SAMPLES = 64
"""Largest number of camera samples that are spread over a pixel together: more than the samples of
any pixel in practice, and few enough that the table of lattices is built at once."""


def film_samples(
    pixel: mi.UInt32,
    width: int,
    sample: mi.UInt32,
    seed: int,
    count: mi.UInt32 | None = None,
) -> mi.Point2f:
    """Return film positions of samples of pixels: sample 0 lies in the pixel's middle, and the
    others are spread over the pixel.

    Args:
        pixel: numbers of the pixels.
        width: number of pixels in a row.
        sample: number of each sample in its pixel.
        count: number of samples in each pixel, up to `MAX_PIXEL_SAMPLES`, numbered from 1; None if
            it is not known. The mean over a pixel of a known number of samples is more accurate.
            In a contact of GelSight Mini of specularity 1, twelve samples have a noise of 2.5 % of
            the mean, and 18 % otherwise.
    """
    bits = dr.opaque(mi.UInt32, seed)
    if count is None:
        jitter = sequence_2d(sample, pixel, bits)
    else:
        jitter = folded_lattice(sample, count, MAX_PIXEL_SAMPLES, pixel, bits)
    middle = sample == 0
    row = dr.opaque(mi.UInt32, width)
    x = mi.Float(pixel % row) + dr.select(middle, 0.5, jitter.x)
    y = mi.Float(pixel // row) + dr.select(middle, 0.5, jitter.y)
    return mi.Point2f(x, y)


def find_visible_points(
    scene: RayScene,
    camera: RayCamera,
    pixel: mi.UInt32,
    number: mi.UInt32,
    film: mi.Point2f,
    seed: int,
    only_main: bool = False,
    channel: int | None = None,
) -> tuple[VisiblePoints, VisiblePoints | None]:
    """Return the main and the reflected visible points of film positions.

    Random numbers depend on pixel, number of the sample and seed alone, so that a path does not
    depend on the others that are traced with it.

    Args:
        pixel: number (n,) of the pixel of each sample.
        number: number (n,) of each sample in its pixel.
        film: film positions (2, n), pixels.
        only_main: whether the reflected points are left out.
        channel: channel of the light that the paths carry, 0 to 2; None for all channels.

    Returns:
        The main points (n,); and the reflected points, fewer than n, or None if there are none.
    """
    dr.make_opaque(number)  # one kernel for all numbers
    stream = mi.sample_tea_32(number, dr.opaque(mi.UInt32, seed))[0]
    own, other = mi.sample_tea_32(pixel, stream)
    series = mi.sample_tea_32(pixel, dr.opaque(mi.UInt32, seed))[1]
    start = Ray(*camera.rays(film.x, film.y), dr.full(mi.Bool, True, dr.width(film)))
    weight = mi.Color3f(1)
    if scene.absorbing:
        start.absorption = mi.Color3f(0)  # a camera stands in air
    if channel is not None:
        start.channel = dr.opaque(mi.UInt32, channel, dr.width(film))
        weight = mi.Color3f(*(dr.select(start.channel == k, mi.Float(1), 0) for k in range(3)))
    paths = follow(scene, start, weight, generator(own), RayKind.CAMERA)
    dr.eval(paths, own, other, series)
    main = VisiblePoints(**vars(paths.end), pixel=pixel, random=own, series=series, number=number)
    if only_main:
        return main, None
    lanes = dr.compress(paths.branch.active)
    if dr.width(lanes) == 0:
        return main, None
    other, series, number = (dr.gather(mi.UInt32, each, lanes) for each in (other, series, number))
    end = follow_branches(scene, paths, lanes, other)
    dr.eval(end, other, series, number)
    kept = dr.compress(end.valid | (end.light > 0))
    if dr.width(kept) == 0:
        return main, None
    alone = dr.width(kept) < FEWEST_LANES
    if alone:  # an entry without weight is appended
        kept = dr.repeat(kept, FEWEST_LANES)
    pixel = dr.gather(mi.UInt32, pixel, lanes)
    found = VisiblePoints(**vars(end), pixel=pixel, random=other, series=series, number=number)
    reflected = dr.gather(VisiblePoints, found, kept)
    if alone:
        first = dr.arange(mi.UInt32, FEWEST_LANES) == 0
        reflected.valid &= first
        reflected.light = dr.select(first, reflected.light, 0)
    dr.eval(reflected)
    return main, reflected


def generator(bits: mi.UInt32) -> mi.PCG32:
    """Return random generators (n,) that depend on given bits (n,) and on nothing else."""
    random = mi.PCG32()
    random.seed(mi.UInt64(bits), mi.UInt64(bits))
    return random
