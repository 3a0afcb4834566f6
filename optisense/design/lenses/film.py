"""Positions on the film of the pixels of a picture, or of a part of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray, FloatingArray


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
    """Positions on the camera's film, arrays of one shape (h, w).

    Attributes:
        across, down: coordinates, 0 to 1, from the left and the top border of the film. Those of a
            picture that shows more above and below than the film are below 0 and above 1.
        radius: distance from the middle; 1 in the corners of the film.
    """

    across: FloatingArray
    down: FloatingArray
    radius: FloatingArray


def film_coordinates(
    height: int, width: int, film: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates across (width,) and down (height,) of a picture's pixels on the film.

    A picture is as wide as the film, and of another shape it shows less or more above and below.
    `film` is the height of the film over its width; that of the picture if None.
    """
    across, down = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    if film is not None:
        down = 0.5 + (down - 0.5) * (height / width / film)
    return across, down


def film_places(height: int, width: int, film: float | None = None) -> FilmPlaces:
    """Return the centres (height, width) of the pixels of a picture; see `film_coordinates`."""
    shape = height / width if film is None else film
    across, down = np.meshgrid(*film_coordinates(height, width, film))
    x, y = 2.0 * across - 1.0, (2.0 * down - 1.0) * shape
    return FilmPlaces(across, down, np.hypot(x, y) / np.hypot(1.0, shape))
