"""The windows of lights in the scene, their places off faces, and the media in front of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.design.lights import frame_of
from optisense.optics.scene._solids import AROUND, PROBE, Solid, solid_at
from optisense.optics.scene.emitters import (
    DISC_CORNERS,
    DISC_REACH,
    FACE_CELLS,
    Emitter,
    EmitterShape,
    StartMedium,
)
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surfaces import CLEAR, RAY_OFFSET, Surface, SurfaceKind

OFF_FACE = 3 * RAY_OFFSET
"""Distance (mm) by which the window of a light on a face is shifted: beyond any face that is up to
two `RAY_OFFSET` in front of it, by at least one, so that rays that leave the face meet it."""
ROUNDING = 1e-5
"""Distance (mm) behind a window at which a face counts as flush with it: five times the rounding of
30 mm in single precision."""
SIGNS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
"""Corners (4, 2) of a window, or of the square around a round one, in half widths and heights."""
ASIDE = np.array([0.004, 0.003])
"""Distances (mm), along the width and the height of a light, by which the medium in front of it is
looked up off the place itself if that is in no solid: it may lie in the gap between the faces of
two that touch. Each is longer than the 0.002 mm below which faces touch, and they differ, as such a
face may also run along a diagonal of the light."""


def with_media(emitters: Sequence[Emitter], solids: Sequence[Solid]) -> list[Emitter]:
    """Return lights with the media that their photons start in: one for each light if it is the
    same in all cells of its window, else one for each cell.

    Where no solid absorbs, the lights are unchanged, as their media make no difference.
    """
    lights = list(emitters)
    if all(solid.absorption == CLEAR for solid in solids):
        return lights
    around = [*solids, AROUND]
    result = []
    for lamp, found in zip(lights, _solids_before(lights, solids), strict=True):
        numbers = found[:1] if (found == found[0]).all() else found
        media = tuple(StartMedium(k, around[k].absorption) for k in numbers.tolist())
        result.append(replace(lamp, media=media))
    return result


def _solids_before(lights: Sequence[Emitter], solids: Sequence[Solid]) -> list[NDArray[np.int64]]:
    """Return the solids (k,) before the `_looked_up` places of n lights; -1 for air."""
    points, aside = [], []
    for lamp in lights:
        s, t, direction = lamp.frame
        flat = _looked_up(lamp.shape) * np.array(lamp.size) / 2
        place = flat @ np.array([s, t]) + np.array(lamp.position) + PROBE * direction
        points.append(place)
        aside.append(place + ASIDE @ np.array([s, t]))
    ends = np.cumsum([len(each) for each in points])[:-1]
    found = solid_at(np.concatenate(points), solids)
    air = found < 0
    found[air] = solid_at(np.concatenate(aside)[air], solids)
    return np.split(found, ends)


@lru_cache
def _looked_up(shape: EmitterShape) -> FloatingArray:
    """Return the places (k, 2) on a window, in half widths and heights, at which its media are
    looked up: the middles of its cells, on a disc moved inward.
    """
    if shape is EmitterShape.POINT:
        return np.zeros((1, 2))
    middle = (2 * np.arange(FACE_CELLS) + 1) / FACE_CELLS - 1
    places = np.stack([np.tile(middle, FACE_CELLS), np.repeat(middle, FACE_CELLS)], axis=1)
    if shape is EmitterShape.DISC:
        places *= np.minimum(1.0, middle[-1] / np.linalg.norm(places, axis=1, keepdims=True))
    return places


def off_faces(emitters: Sequence[Emitter], pieces: Sequence[Piece]) -> list[Emitter]:
    """Return lights of which no window lies on a face of the pieces.

    Photons start `RAY_OFFSET` in front of a window: beyond a face with which it is flush, as though
    the light were cast into the solid behind. Traced rays would meet the face first and go on
    behind the window. Such a window is therefore shifted by `OFF_FACE` along its direction.
    """
    lights = list(emitters)
    numbers = [i for i, e in enumerate(lights) if e.shape is not EmitterShape.POINT]
    if not numbers:
        return lights
    axes = np.array([lights[i].frame for i in numbers])
    across = np.array([lights[i].size for i in numbers])[:, :, None] / 2 * axes[:, :2]
    corners = np.array([lights[i].position for i in numbers])[:, None] + SIGNS @ across
    low = (corners.min(axis=1) - OFF_FACE).T.astype(np.float32)
    high = (corners.max(axis=1) + OFF_FACE).T.astype(np.float32)
    shifted: set[int] = set()
    for piece in pieces:
        lowest, highest = piece.boxes
        face = np.flatnonzero(_meet(lowest, highest, low.min(axis=1), high.max(axis=1)))
        if len(face) == 0:
            continue
        lowest, highest = lowest[:, face], highest[:, face]
        light, place = np.nonzero(_meet(lowest, highest, low[:, :, None], high[:, :, None]))
        face = face[place]
        normals = piece.rows[face, :3].astype(float)
        normals *= np.where(np.einsum("pi,pi->p", normals, axes[light, 2]) < 0, -1, 1)[:, None]
        away = piece.vertices[piece.faces[face, 0]][:, None] - corners[light]
        ahead = np.einsum("pci,pi->pc", away, normals)
        flush = (ahead > -ROUNDING).all(axis=1) & (ahead < 2 * RAY_OFFSET).all(axis=1)
        shifted.update(light[flush].tolist())
    for i in shifted:
        lamp = lights[numbers[i]]
        x, y, z = (np.array(lamp.position) + OFF_FACE * lamp.frame[2]).tolist()
        lights[numbers[i]] = replace(lamp, position=(x, y, z))
    return lights


def _meet(
    lowest: FloatingArray, highest: FloatingArray, low: FloatingArray, high: FloatingArray
) -> NDArray[np.bool_]:
    """Return whether boxes (3, m) meet a box (3,) or boxes (3, n, 1): (m,) or (n, m)."""
    met = (lowest[0] <= high[0]) & (highest[0] >= low[0])
    for k in (1, 2):
        met &= (lowest[k] <= high[k]) & (highest[k] >= low[k])
    return np.asarray(met)


def window(number: int, emitter: Emitter) -> Piece:
    """Return the emitting face of a light along its direction; equal lights share an object."""
    return _window_of(
        number, emitter.shape, emitter.size, emitter.position, emitter.direction, emitter.up
    )


@lru_cache(maxsize=1024)
def _window_of(
    number: int,
    shape: EmitterShape,
    size: tuple[float, float],
    position: tuple[float, float, float],
    direction: tuple[float, float, float],
    up: tuple[float, float, float] | None,
) -> Piece:
    s, t, _ = frame_of(direction, up)
    half = np.array(size) / 2
    if shape is EmitterShape.DISC:
        turn = np.arange(DISC_CORNERS) * 2 * np.pi / DISC_CORNERS
        outline = np.stack([np.cos(turn), np.sin(turn)], axis=1) * half * DISC_REACH
    else:
        outline = SIGNS * half
    points = np.asarray(position) + outline[:, :1] * s + outline[:, 1:] * t
    count = len(points)
    faces = np.array([[0, k, k + 1] for k in range(1, count - 1)])
    return Piece(f"light {number}", points, faces, Surface(SurfaceKind.LIGHT, light=number))
