"""Noise, black level and colour matrix of a camera's sensor and processor.

Levels are shares of the largest that a pixel can hold: 1 is full.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from optisense.array_types import FloatingArray
from optisense.design.fields import Fraction, Model, NonNegative, Number, Positive

Row = tuple[Number, Number, Number]

NoiseSeed = int | tuple[int, ...]
"""Seed of a noise sequence: one or several integers from 0 up."""


def _invertible(matrix: tuple[Row, Row, Row]) -> tuple[Row, Row, Row]:
    if abs(np.linalg.det(np.array(matrix))) < 1e-6:
        raise ValueError("the matrix mixes the channels so that they can't be told apart")
    return matrix


ChannelMatrix = Annotated[tuple[Row, Row, Row], AfterValidator(_invertible)]
"""Rows of the new R, G and B: each has the shares of the old R, G and B in it."""


class BlackLevel(Model):
    """Level that a sensor adds to all its readings, and the share that is subtracted again."""

    level: Annotated[Number, Field(ge=0.0, lt=0.9)] = Field(
        description="level that the sensor reads in the dark, a share of its range"
    )
    subtracted: Fraction = Field(
        default=1.0, description="share of it that the processor subtracts first"
    )

    def read(self, level: FloatingArray) -> FloatingArray:
        """Return the converter's output (...), 0 to 1, for levels (...) relative to black."""
        return np.clip(self.level + (1.0 - self.level) * level, 0.0, 1.0)

    def scale(self) -> float:
        """Return the factor on levels relative to black by reading and subtraction."""
        return (1.0 - self.level) / (1.0 - self.subtracted * self.level)

    def subtract(self, read: FloatingArray) -> FloatingArray:
        """Return the levels (...) above the assumed black of the converter's output (...), 0 to 1,
        scaled so that a full pixel stays at 1.
        """
        off = self.subtracted * self.level
        return (read - off) / (1.0 - off)


class SensorNoise(Model):
    """Shot noise of the light and read noise of the sensor (as in the EMVA standard 1288).

    A full pixel holds `full_well` / `gain` electrons. The number of electrons varies by its square
    root from picture to picture (shot noise; a normal distribution stands for Poisson's), and
    reading adds `read_noise` electrons.
    """

    full_well: Positive = Field(
        description="electrons of a pixel that is full at a gain of 1", examples=[4562.0]
    )
    read_noise: NonNegative = Field(
        default=0.0, description="electrons, standard deviation in the dark"
    )
    gain: Annotated[Positive, Field(le=1000.0)] = Field(
        default=1.0, description="analogue gain; 1 is the sensor's lowest"
    )
    binning: Annotated[Number, Field(ge=1.0)] = Field(
        default=1.0, description="pixels of the sensor whose mean is one pixel of the picture"
    )

    def deviation(self, level: FloatingArray) -> FloatingArray:
        """Return the standard deviation (...) of levels (...), as a share of a full pixel."""
        per_electron = self.gain / self.full_well
        shot = np.maximum(level, 0.0) * per_electron
        return np.sqrt((shot + (self.read_noise * per_electron) ** 2) / self.binning)

    def add(self, level: FloatingArray, normal: FloatingArray) -> FloatingArray:
        """Return levels (...) with noise from numbers (...) of the standard normal distribution."""
        return level + self.deviation(level) * normal


def normal_numbers(seed: NoiseSeed | Sequence[int], height: int, width: int) -> FloatingArray:
    """Return numbers (h, w, 3) of the standard normal distribution for all pixels of a picture.

    The same seed and size give the same array, which must not be changed.
    """
    return _normal_numbers(seed if isinstance(seed, int) else tuple(seed), height, width)


@lru_cache(maxsize=2)
def _normal_numbers(seed: NoiseSeed, height: int, width: int) -> FloatingArray:
    numbers = np.random.default_rng(seed).standard_normal((height, width, 3), dtype=np.float32)
    numbers.setflags(write=False)
    return numbers


def mixed(levels: FloatingArray, matrix: ChannelMatrix) -> FloatingArray:
    """Return levels (..., 3) with their channels mixed by a matrix."""
    mix: FloatingArray = levels @ np.array(matrix, dtype=np.float32).T
    return mix
