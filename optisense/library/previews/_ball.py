"""Ball of a material on a chequered floor, with lamps, drawn by a small ray tracer.

It follows the laws of the simulation (Fresnel, GGX facets, the blend of a coating), but draws in
about a second and without the renderer. Light that is reflected within a clear ball is ignored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design.colour import encode
from optisense.design.materials import CoatingModel, Material, Medium, Reflection
from optisense.design.materials.base import GEL_INDEX
from optisense.design.reflectance import (
    fresnel_dielectric,
    fresnel_metal,
    ggx_density,
    sample_facets,
    smith_shadowing,
)

SMOOTH = 1e-3
"""GGX alpha below which a face is drawn as a plain mirror: its lobe is 0.1 degrees wide, narrower
than a pixel."""

SHARP = 0.25
"""GGX alpha below which lamps are found by sampled rays. Above it, lobes are wider than the lamps
(17 degrees), which then count as points of their solid angle."""

SAMPLES_SMOOTH, SAMPLES_ROUGH = 6, 20
"""Numbers of rays per pixel at smooth faces, where six smooth the edges, and at rough ones, where
rays scatter and twenty leave little grain; the picture takes about a second."""

STEPS = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of a sequence that, added repeatedly modulo 1, fills the unit square evenly (the R2
sequence of Roberts 2018)."""

FLOOR = -1.0
"""Height of the chequered floor, in radii of the ball, whose middle is at 0."""
SQUARE = 0.6
"""Side of a square of the floor, in radii of the ball; about three squares are visible below it."""
DARK, BRIGHT = 0.16, 0.62
"""Reflectances of the dark and of the bright squares of the floor, which clear balls refract
visibly and without outshining the lamps."""


@dataclass(frozen=True)
class DistantLamp:
    """Round, distant lamp.

    Attributes:
        direction: unit vector (3,) towards it.
        radiance: radiance (3,) at R, G, B.
        radius: angular radius at which it has faded to half, degrees.
    """

    direction: FloatArray
    radiance: FloatArray
    radius: float

    @property
    def solid_angle(self) -> float:
        """Solid angle, steradians."""
        return float(2.0 * np.pi * (1.0 - np.cos(np.radians(self.radius))))

    def seen(self, towards: FloatArray) -> FloatArray:
        """Return the radiance (n, 3) along unit directions (n, 3)."""
        angle = np.degrees(np.arccos(np.clip(towards @ self.direction, -1.0, 1.0)))
        t = np.clip((1.15 * self.radius - angle) / (0.3 * self.radius), 0.0, 1.0)
        return np.asarray((t * t * (3.0 - 2.0 * t))[:, None] * self.radiance)


@dataclass(frozen=True)
class Studio:
    """Surroundings of the ball, which has radius 1 and is at the origin.

    Attributes:
        lamps: lamps.
        sky: radiance of the zenith; half of it on the horizon.
        floor: factor on the radiance of the floor.
        solid: darkness of the ball's shadow, 0 to 1.
    """

    lamps: list[DistantLamp]
    sky: float
    floor: float
    solid: float

    def radiance(self, start: FloatArray, towards: FloatArray, lamps: bool = True) -> FloatArray:
        """Return the radiance (n, 3) that arrives at points (n, 3) from unit directions (n, 3)."""
        height = towards[:, 2]
        light = np.repeat((self.sky * (0.5 + 0.5 * np.clip(height, 0, 1)))[:, None], 3, axis=1)
        if lamps:
            for lamp in self.lamps:
                light += lamp.seen(towards)
        down = height < -1e-6
        reach = (FLOOR - start[down, 2]) / height[down]
        place = start[down] + reach[:, None] * towards[down]
        squares = np.floor(place[:, 0] / SQUARE) + np.floor(place[:, 1] / SQUARE)
        shade = self.floor * np.where(squares % 2 == 0, DARK, BRIGHT)
        far = np.clip(reach / 30.0, 0.0, 1.0)
        hidden = np.clip(1.0 / np.linalg.norm(place, axis=1) ** 3, 0.0, 1.0)
        near = shade * (1.0 - 0.85 * self.solid * hidden)
        light[down] = ((1.0 - far) * near + far * 0.5 * self.sky)[:, None]
        return light

    def irradiance(self, normal: FloatArray) -> FloatArray:
        """Return the irradiance (n, 3) on a face for each unit normal (n, 3); lamps count as points
        of their solid angle.
        """
        up = 0.5 * (1.0 + normal[:, 2])  # the share of the sky that the face sees
        floor = 0.5 * (DARK + BRIGHT) * self.floor * (1.0 - 0.5 * self.solid)
        even = np.pi * (up * 0.8 * self.sky + (1.0 - up) * floor)
        light = np.repeat(even[:, None], 3, axis=1)
        for lamp in self.lamps:
            facing = np.maximum(normal @ lamp.direction, 0.0) * lamp.solid_angle
            light += facing[:, None] * lamp.radiance
        return light


def _lamp(
    direction: tuple[float, float, float], radiance: list[float], radius: float
) -> DistantLamp:
    vector = np.array(direction)
    return DistantLamp(vector / np.linalg.norm(vector), np.array(radiance), radius)


def white_studio(solid: float) -> Studio:
    """Return a studio with one white lamp, for materials."""
    return Studio([_lamp((-0.5, -0.6, 0.62), [3.2] * 3, 17.0)], sky=0.62, floor=1.0, solid=solid)


def coloured_studio() -> Studio:
    """Return a studio for coatings: a red, a green and a blue lamp around the view."""
    lamps = [
        _lamp((-0.86, -0.45, 0.20), [5.0, 0.1, 0.1], 19.0),
        _lamp((0.86, -0.45, 0.20), [0.1, 4.0, 0.1], 19.0),
        _lamp((0.0, -0.50, 0.86), [0.1, 0.1, 5.5], 19.0),
    ]
    return Studio(lamps, sky=0.10, floor=0.35, solid=1.0)


def picture_of_ball(material: Material | CoatingModel, size: int = 280) -> NDArray[np.uint8]:
    """Return a picture (size, size, 3) in sRGB of a ball of the material."""
    offsets = np.random.default_rng(0).random((size * size, 4))
    medium, surface = medium_of(material), material.reflection()
    studio = white_studio(1.0 if medium is None else 0.3)
    if isinstance(material, CoatingModel):
        studio, surface = coloured_studio(), surface.in_medium(GEL_INDEX)
    pixels = np.arange(size * size)
    light = np.zeros((size * size, 3))
    start, towards = _camera_rays(pixels, size, offsets)
    near_ball = _passing(start, towards) < 1.06
    beside, ball = pixels[~near_ball], pixels[near_ball]
    for number in range(4):
        place = _even(offsets[beside, :2], number)
        light[beside] += studio.radiance(*_camera_rays(beside, size, place)) / 4
    samples = _samples(medium, surface)
    for number in range(samples):
        start, towards = _camera_rays(ball, size, _even(offsets[ball, :2], number))
        passing = _passing(start, towards)
        hit = passing < 1.0
        shone = np.empty((len(ball), 3))
        shone[~hit] = studio.radiance(start[~hit], towards[~hit])
        distance = -np.einsum("ij,ij->i", start[hit], towards[hit]) - np.sqrt(1 - passing[hit])
        place = start[hit] + distance[:, None] * towards[hit]
        u = _even(offsets[ball, 2:], number)[hit]
        shone[hit] = _from_ball(place, towards[hit], medium, surface, studio, u)
        light[ball] += np.minimum(shone, 4.0) / samples
    return encode(light).reshape(size, size, 3)


def _even(offset: FloatArray, number: int) -> FloatArray:
    """Return the points (n, 2) of a sample in the unit square, by its number, shifted by offsets
    (n, 2).
    """
    return np.asarray((offset + number * STEPS) % 1.0)


def _camera_rays(
    pixels: NDArray[np.intp], size: int, within: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return starts and unit directions of a ray through each pixel, (n, 3) each, at `within`."""
    start = np.array([0.0, -6.0, 1.6])
    forward = -start / np.linalg.norm(start)
    right = np.array([1.0, 0.0, 0.0])
    up = np.cross(right, forward)
    row, column = np.divmod(pixels, size)
    x = 0.215 * (2.0 * (column + within[:, 0]) / size - 1.0)
    y = 0.215 * (1.0 - 2.0 * (row + within[:, 1]) / size) - 0.012
    towards = forward + x[:, None] * right + y[:, None] * up
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    return np.broadcast_to(start, towards.shape), towards


def _passing(start: FloatArray, towards: FloatArray) -> FloatArray:
    """Return the squared distances (n,) at which rays pass the middle of the ball."""
    along = np.einsum("ij,ij->i", start, towards)
    return np.asarray(np.einsum("ij,ij->i", start, start) - along**2)


def medium_of(material: Material | CoatingModel) -> Medium | None:
    """Return the medium inside a ball of the material; None if it is opaque."""
    return material.medium() if isinstance(material, Material) else None


def _samples(medium: Medium | None, surface: Reflection) -> int:
    """Return the number of rays per pixel: more if rays are scattered and lamps found by chance."""
    alpha = surface.roughness if medium is None else medium.roughness
    by_chance = alpha < SHARP or medium is not None
    return SAMPLES_ROUGH if alpha >= SMOOTH and by_chance else SAMPLES_SMOOTH


def _from_ball(
    place: FloatArray,
    towards: FloatArray,
    medium: Medium | None,
    surface: Reflection,
    studio: Studio,
    u: FloatArray,
) -> FloatArray:
    """Return the radiance (n, 3) that leaves the ball's surface towards the camera."""
    if medium is not None:
        return _through(place, towards, medium, studio, u)
    if surface.is_black:
        return np.zeros((len(place), 3))
    share = surface.specularity
    light = np.zeros((len(place), 3))
    if share < 1.0:
        diffuse = np.array(surface.reflectance) * (1.0 - share) / np.pi
        light += studio.irradiance(place) * diffuse
    if share > 0.0:
        eta, k = np.array(surface.eta), np.array(surface.k)
        light += share * _metal(place, towards, eta, k, surface.roughness, studio, u)
    return light


def _metal(
    place: FloatArray,
    towards: FloatArray,
    eta: FloatArray,
    k: FloatArray,
    alpha: float,
    studio: Studio,
    u: FloatArray,
) -> FloatArray:
    """Return the radiance reflected by metal facets; of rough ones that of lamps by their angle."""
    view = _to_local(-towards, place)
    facet = _facets(view, alpha, u)
    cosine = np.einsum("ij,ij->i", view, facet)
    leaving = 2.0 * cosine[:, None] * facet - view
    kept = (leaving[:, 2] > 0.0) * (smith_shadowing(leaving[:, 2], alpha) if alpha > SMOOTH else 1)
    weight = fresnel_metal(np.clip(cosine, 0.0, 1.0), eta, k) * kept[:, None]
    rough = alpha >= SHARP
    light = weight * studio.radiance(place, _to_world(leaving, place), lamps=not rough)
    for lamp in studio.lamps if rough else ():
        arriving = _to_local(np.broadcast_to(lamp.direction, place.shape), place)
        half = view + arriving
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        strength = ggx_density(half[:, 2], alpha) / (4.0 * view[:, 2])
        strength *= smith_shadowing(view[:, 2], alpha) * smith_shadowing(arriving[:, 2], alpha)
        strength *= (place @ lamp.direction > 0.0) * lamp.solid_angle
        facing = np.clip(np.einsum("ij,ij->i", view, half), 0.0, 1.0)
        light += fresnel_metal(facing, eta, k) * strength[:, None] * lamp.radiance
    return light


def _through(
    place: FloatArray, towards: FloatArray, glass: Medium, studio: Studio, u: FloatArray
) -> FloatArray:
    """Return the radiance reflected by the front of a clear ball, and refracted through it."""
    alpha = glass.roughness
    view = _to_local(-towards, place)
    facet = _facets(view, alpha, u)
    cosine = np.clip(np.einsum("ij,ij->i", view, facet), 0.0, 1.0)
    mirrored = fresnel_dielectric(cosine, glass.ior)
    away = _to_world(2.0 * cosine[:, None] * facet - view, place)
    light = mirrored[:, None] * studio.radiance(place, away)

    inward = _to_world(_refracted(view, facet, cosine, glass.ior), place)
    back = place - 2.0 * np.einsum("ij,ij->i", place, inward)[:, None] * inward
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    view = _to_local(-inward, -back)
    facet = _facets(view, alpha, (u[:, ::-1] + 0.5) % 1.0)
    cosine = np.clip(np.einsum("ij,ij->i", view, facet), 0.0, 1.0)
    passed = (1.0 - mirrored) * (1.0 - fresnel_dielectric(cosine, 1.0 / glass.ior))
    outward = _to_world(_refracted(view, facet, cosine, 1.0 / glass.ior), -back)
    return light + passed[:, None] * studio.radiance(back, outward)


def _refracted(view: FloatArray, facet: FloatArray, cosine: FloatArray, eta: float) -> FloatArray:
    """Return the directions (n, 3) behind facets by Snell's law; grazing if there is none."""
    sine2 = np.minimum((1.0 - cosine**2) / eta**2, 1.0)
    bent: FloatArray = (cosine / eta - np.sqrt(1.0 - sine2))[:, None] * facet - view / eta
    return bent / np.linalg.norm(bent, axis=1, keepdims=True)


def _facets(view: FloatArray, alpha: float, u: FloatArray) -> FloatArray:
    if alpha < SMOOTH:
        return np.broadcast_to([0.0, 0.0, 1.0], view.shape)
    return sample_facets(view, alpha, u)


def _axes(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit directions along the surface (Duff et al., JCGT 6, 2017)."""
    x, y, z = normal.T
    sign = np.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.column_stack([1.0 + sign * x * x * a, sign * b, -sign * x])
    return first, np.column_stack([b, sign + y * y * a, -y])


def _to_local(direction: FloatArray, normal: FloatArray) -> FloatArray:
    first, second = _axes(normal)
    parts = [np.einsum("ij,ij->i", direction, axis) for axis in (first, second, normal)]
    parts[2] = np.maximum(parts[2], 1e-6)
    return np.column_stack(parts)


def _to_world(local: FloatArray, normal: FloatArray) -> FloatArray:
    first, second = _axes(normal)
    return local[:, :1] * first + local[:, 1:2] * second + local[:, 2:] * normal
