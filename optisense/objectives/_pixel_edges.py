"""The edges between the points of the sensing surface that neighbouring pixels see."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

JUMP = 4.0
"""Ratio of the length of an edge to those before and after it in its row or column above which the
edge crosses a fold or a gap. On a smooth surface neighbouring edges differ by at most a factor of
2.4, which occurs where the surface is seen edge-on."""


class PixelEdges(NamedTuple):
    """The edges along the rows and along the columns of a picture.

    Attributes:
        right: x, y and z (h, w-1) of the edges to the next pixel of the row, mm.
        down: x, y and z (h-1, w) of the edges to the next pixel of the column, mm.
        leaps_right: (h, w-1) mask of the edges in ``right`` that cross a fold or a gap.
        leaps_down: (h-1, w) mask of those in ``down``.
    """

    right: list[NDArray[np.float32]]
    down: list[NDArray[np.float32]]
    leaps_right: NDArray[np.bool_]
    leaps_down: NDArray[np.bool_]


def pixel_edges(
    points: NDArray[np.float32],
    hit: NDArray[np.bool_],
    reflections: NDArray[np.uint32] | None = None,
    jump: float = JUMP,
) -> PixelEdges:
    """Return the edges between the points that neighbouring pixels see.

    An edge crosses a fold or a gap if other surfaces reflect the ray of its one pixel than that of
    the other, or if it is much longer than the edges before and after it.

    Args:
        points: (h, w, 3) points that the pixels see, mm.
        hit: (h, w) mask of the pixels that see the surface.
        reflections: (h, w) codes of the reflections of each pixel's ray (see `ChiefRays`); None for
            rays that nothing reflects.
        jump: see `JUMP`.
    """
    x, y, z = (np.ascontiguousarray(points[..., axis]) for axis in range(3))
    right = [c[:, 1:] - c[:, :-1] for c in (x, y, z)]
    down = [c[1:] - c[:-1] for c in (x, y, z)]
    there_right, there_down = hit[:, 1:] & hit[:, :-1], hit[1:] & hit[:-1]
    leaps_right = discontinuous_edges(right, there_right, 1, jump)
    leaps_down = discontinuous_edges(down, there_down, 0, jump)
    if reflections is not None:
        leaps_right |= there_right & (reflections[:, 1:] != reflections[:, :-1])
        leaps_down |= there_down & (reflections[1:] != reflections[:-1])
    return PixelEdges(right, down, leaps_right, leaps_down)


def discontinuous_edges(
    edges: list[NDArray[np.float32]], there: NDArray[np.bool_], axis: int, jump: float
) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the edges that are much longer than both their neighbours along an
    axis.

    Args:
        edges: x, y and z (h, w) of the edges, mm.
        there: (h, w) mask of the edges with both ends on the surface.
        axis: axis of the pixels along which the edges run.
        jump: see `JUMP`.
    """
    square = edges[0] ** 2 + edges[1] ** 2 + edges[2] ** 2
    square[~there] = np.nan
    lines = np.moveaxis(square, axis, 0)
    longest = np.full_like(lines, np.nan)
    longest[1:] = lines[:-1]
    longest[:-1] = np.fmax(longest[:-1], lines[1:])
    leaps: NDArray[np.bool_] = np.moveaxis(lines > jump**2 * longest, 0, axis)
    return leaps
