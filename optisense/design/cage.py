"""The cage of a design: a lattice of control points that deforms some of its parts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from optisense.design.fields import Count, Fraction, Model, Name, Number, Vector

MAX_POINTS = 20_000
"""Largest number of control points of one cage. The weights of a mesh of 10,000 vertices take 1.6
GB with so many."""
MOST_ALONG = 64
"""Largest number of control points along an axis; no shape needs polynomials of a higher degree."""


class Point(Model):
    """Control point, mm."""

    x: Number
    y: Number
    z: Number


class Share(Model):
    """Position of each coordinate of a control point between c_min (0) and c_max (1)."""

    x: Fraction
    y: Fraction
    z: Fraction


LatticeCount = Annotated[Count, Field(ge=2, le=MOST_ALONG)]


class Cage(Model):
    """Control points over a box around some parts, which deform the parts (free-form deformation).

    Control points on the regular lattice leave the parts as they are. Point (i, j, k) has the index
    (i * ny + j) * nz + k: x is slowest, z fastest.

    The shape is given by `points`, or by `blend` (A in the OptiSense paper, section "Geometric
    shape of the components") as (1 - A) * c_min + A * c_max, with one A for all coordinates or one
    for each.
    """

    parts: Annotated[list[Name], Field(min_length=1)] = Field(description="parts that it deforms")
    resolution: tuple[LatticeCount, LatticeCount, LatticeCount] = Field(
        description="control points along x, y, z"
    )
    box: tuple[Vector, Vector] = Field(description="mm, lower and upper corner when at rest")
    points: list[Point] = Field(
        default_factory=list, description="mm, x slowest, z fastest; absent where blend is given"
    )
    c_min: list[Point] | None = Field(default=None, description="mm, one end of the search range")
    c_max: list[Point] | None = Field(default=None, description="mm, other end of the search range")
    blend: Fraction | list[Share] | None = Field(
        default=None, description="0 is c_min, 1 is c_max; one number or one x, y, z for each point"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Cage:
        nx, ny, nz = self.resolution
        count = nx * ny * nz
        if count > MAX_POINTS:
            raise ValueError(f"{count} control points are more than {MAX_POINTS}")
        if any(low >= high for low, high in zip(*self.box, strict=True)):
            raise ValueError("the upper corner of the box must lie above the lower in x, y and z")
        if self.blend is not None and (self.c_min is None or self.c_max is None):
            raise ValueError("blend needs both c_min and c_max")
        if self.blend is not None and self.points:
            raise ValueError("give points or blend, not both: each of them sets the whole shape")
        lists = {"c_min": self.c_min, "c_max": self.c_max}
        lists["points"] = None if self.blend is not None else self.points
        shares = self.blend if isinstance(self.blend, list) else None
        for name, given in [*lists.items(), ("blend", shares)]:
            if given is not None and len(given) != count:
                raise ValueError(f"{name} has {len(given)} entries, {nx} x {ny} x {nz} are needed")
        return self

    @staticmethod
    def around(
        parts: Iterable[str], box: ArrayLike, resolution: tuple[int, int, int] = (3, 3, 3)
    ) -> Cage:
        """Return a cage at rest over `box` ((2, 3), mm), which should enclose the parts."""
        from optisense.geometry.cage import cage_points

        lower, upper = np.asarray(box, dtype=float).tolist()
        points = cage_points(np.array([lower, upper]), resolution)
        return Cage(
            parts=list(parts),
            resolution=resolution,
            box=(tuple(lower), tuple(upper)),
            points=as_points(points),
        )

    def index(self, i: int, j: int, k: int) -> int:
        """Return the index in `points` of control point (i, j, k)."""
        _, ny, nz = self.resolution
        return (i * ny + j) * nz + k

    def current_points(self) -> NDArray[np.float64]:
        """Return the present control points (N, 3), mm, blended if `blend` is given."""
        if self.blend is None:
            return as_array(self.points)
        assert self.c_min is not None and self.c_max is not None  # the validator has checked it
        share = as_array(self.blend) if isinstance(self.blend, list) else self.blend
        return np.asarray((1.0 - share) * as_array(self.c_min) + share * as_array(self.c_max))

    def offsets_at_rest(self) -> NDArray[np.float64]:
        """Return the displacements (N, 3), mm, of the control points from their places at rest."""
        from optisense.geometry.cage import cage_points

        return np.asarray(self.current_points() - cage_points(self.box, self.resolution))


def as_array(points: Iterable[Point] | Iterable[Share]) -> NDArray[np.float64]:
    """Return a list of points as an array (N, 3), float64."""
    return np.array([(p.x, p.y, p.z) for p in points], dtype=np.float64).reshape(-1, 3)


def as_points(array: ArrayLike) -> list[Point]:
    """Return an array (N, 3), mm, as a list of points."""
    return [Point(x=x, y=y, z=z) for x, y, z in np.asarray(array, dtype=float).tolist()]
