"""Positions on the film of the pixels of a picture, or of a part of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatingArray


@dataclass(frozen=True)
class PictureWindow:
    """Part of a picture, in pixels.

    Attributes:
        width, height: size of the whole picture.
        rows, columns: slices of the part.
    """

    width: int
    height: int
    rows: slice
    columns: slice

    @classmethod
    def whole(cls, height: int, width: int) -> PictureWindow:
        """Return the window of a whole picture."""
        return cls(width, height, slice(0, height), slice(0, width))

    @classmethod
    def part(cls, shape: tuple[int, ...], box: tuple[slice, slice]) -> PictureWindow:
        """Return the window of a box (rows, columns) in a picture of a shape (height, width)."""
        return cls(shape[1], shape[0], *box)

    @property
    def box(self) -> tuple[slice, slice]:
        """Slices of rows and columns."""
        return self.rows, self.columns


@dataclass(frozen=True)
class FilmPlaces:
    """Positions on the film, arrays of one shape (h, w).

    Attributes:
        across, down: coordinates, 0 to 1, from the left and the top border of the picture.
        radius: distance from the middle; 1 in the corners.
    """

    across: FloatingArray
    down: FloatingArray
    radius: FloatingArray


def film_places(height: int, width: int) -> FilmPlaces:
    """Return the centres (height, width) of the pixels of a picture."""
    across, down = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    x, y = 2.0 * across - 1.0, (2.0 * down - 1.0) * height / width
    return FilmPlaces(across, down, np.hypot(x, y) / np.hypot(1.0, height / width))
