"""What a calibration may change in a design, and how its numbers become a design again.

Each quantity has a start, limits, and a plausible range: the standard deviation of a normal
distribution about the start, which the photographs outweigh where they tell anything. Quantities of
the camera's processing and the powers of the lights only change how the layers of a picture are
mixed and stored; the others need a new rendering.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign, get_value, set_value
from optisense.design.lenses.radial_shading import RadialShading
from optisense.design.responses import BlackLevel, PictureChain
from optisense.design.responses.gamma_curve import GammaCurve
from optisense.errors import CalibrationError

FloatArray = NDArray[np.float64]

POWER_RANGE = 0.7
"""Plausible range of the logarithm of a light group's power: LEDs of one type differ by a factor of
two, and what drives them is not published."""

MIX_RANGE = 0.5
"""Plausible range of an entry of the colour matrix off its diagonal; those of published camera
tunings reach 1."""

GAMMA_START, GAMMA_RANGE = 1.8, 0.4
"""Exponent of the tone curve to start from, and the plausible range of its logarithm: cameras of
sensors lie between linear (1) and sRGB (about 2.2)."""

BLACK_RANGE = 0.05
"""Plausible range of the level that is stored in the dark, a share of the sensor's range."""

FALLOFF_START, FALLOFF_RANGE = 0.2, 0.3
"""Share of the light that the lens loses in the picture's corners: start and plausible range."""

SHADING_POWER, SHADING_RANGE = 2.0, 0.4
"""Power of the distance with which the loss grows, to start from, and the plausible range of its
logarithm: lenses alone lose with the square or faster, and light guides add to it."""

FIELD_RANGE = 0.08
"""Plausible range of the logarithm of the field of view: views of one type of sensor differ by a
tenth."""

PLACE_RANGE = 0.8
"""mm, plausible range of the camera's place across its axis; it is glued in by hand."""

FAMILIES = {
    "powers": "power of each light group",
    "colours": "colour matrix of the camera",
    "tone": "exponent of the tone curve",
    "black": "level in the dark",
    "shading": "dimming of the picture's corners",
    "view": "field of view and place of the camera across its axis",
}
"""What may be fitted without being asked for by path, and in words."""

_LETTERS = "RGB"


@dataclass(frozen=True)
class FitQuantity:
    """One number that is fitted.

    Attributes:
        path: of the design; an axis after "camera.across." for the camera's place.
        words: what it is, to be read.
        unit: of the number; empty if it has none.
        start: value before the fit.
        low, high: limits.
        spread: plausible range about the start, of its logarithm if `logarithmic`.
        logarithmic: whether it varies by factors.
        renders: whether a change needs a new rendering.
    """

    path: str
    words: str
    unit: str
    start: float
    low: float
    high: float
    spread: float
    logarithmic: bool = False
    renders: bool = False

    def value(self, step: float) -> float:
        """The number at so many plausible ranges from its start."""
        if self.logarithmic:
            found = self.start * math.exp(min(max(self.spread * step, -20.0), 20.0))
        else:
            found = self.start + self.spread * step
        return min(max(found, self.low), self.high)

    def slope(self, step: float) -> float:
        """How the number changes for one plausible range."""
        return self.spread * (self.value(step) if self.logarithmic else 1.0)


def quantities_of(
    design: SensorDesign, families: Sequence[str], asked: Sequence[tuple[str, float, float]] = ()
) -> list[FitQuantity]:
    """What is fitted of a design.

    Args:
        design: to start from.
        families: of `FAMILIES`.
        asked: path, least and largest value of further numbers of the design.

    Raises:
        CalibrationError: a family is unknown, or a range does not hold the design's value.
        DesignError: a path leads to no value.
    """
    unknown = [name for name in families if name not in FAMILIES]
    if unknown:
        raise CalibrationError(
            f"there is nothing called '{unknown[0]}' to fit", hint="Use " + ", ".join(FAMILIES)
        )
    found: list[FitQuantity] = []
    for name in FAMILIES:
        if name in families:
            found += _MAKERS[name](design)
    for path, low, high in asked:
        found.append(_asked(design, path, low, high))
    paths = [each.path for each in found]
    for path in paths:
        if paths.count(path) > 1:
            raise CalibrationError(f"'{path}' is fitted twice", hint="Name it once")
    return found


def _powers(design: SensorDesign) -> list[FitQuantity]:
    return [
        FitQuantity(
            f"lights.{name}.flux", f"power of the {name} lights", "mW", group.flux,
            1e-3 * group.flux, min(1e6, 1e3 * group.flux), POWER_RANGE, True,
        )
        for name, group in design.lights.items()
        if group.flux > 0.0
    ]  # fmt: skip


def _colours(design: SensorDesign) -> list[FitQuantity]:
    matrix = np.eye(3) if design.camera.colour_matrix is None else design.camera.colour_matrix
    return [
        FitQuantity(
            f"camera.colour_matrix[{row}][{column}]",
            f"share of {_LETTERS[column]} in the picture's {_LETTERS[row]}",
            "", float(matrix[row][column]), -4.0, 4.0, MIX_RANGE,
        )
        for row in range(3)
        for column in range(3)
        if row != column
    ]  # fmt: skip


def _tone(design: SensorDesign) -> list[FitQuantity]:
    curve = design.camera.tone_curve
    start = curve.gamma if isinstance(curve, GammaCurve) else GAMMA_START
    return [
        FitQuantity(
            "camera.tone_curve.gamma", "exponent of the tone curve", "", start, 0.5, 5.0,
            GAMMA_RANGE, True,
        )
    ]  # fmt: skip


def _black(design: SensorDesign) -> list[FitQuantity]:
    black = design.camera.black_level
    start = 0.0 if black is None else black.level * (1.0 - black.subtracted)
    return [
        FitQuantity(
            "camera.black_level.level", "level in the dark", "", start, 0.0, 0.5, BLACK_RANGE
        )
    ]


def _shading(design: SensorDesign) -> list[FitQuantity]:
    shading = design.camera.shading
    start, power = FALLOFF_START, SHADING_POWER
    if isinstance(shading, RadialShading):
        start, power = shading.falloff, shading.power
    return [
        FitQuantity(
            "camera.shading.falloff", "dimming of the picture's corners", "", start, 0.0, 0.95,
            FALLOFF_RANGE,
        ),
        FitQuantity(
            "camera.shading.power", "power with which it grows outwards", "", power, 1.0, 8.0,
            SHADING_RANGE, True,
        ),
    ]  # fmt: skip


def _view(design: SensorDesign) -> list[FitQuantity]:
    fov = design.camera.fov
    most = 175.0 if design.camera.projection == "perspective" else 360.0
    across = [
        FitQuantity(
            f"camera.across.{axis}", f"place of the camera {words}", "mm", 0.0, -10.0, 10.0,
            PLACE_RANGE, renders=True,
        )
        for axis, words in (("right", "to the picture's right"), ("up", "to its top"))
    ]  # fmt: skip
    field = FitQuantity(
        "camera.fov", "field of view", "degrees", fov, 0.3 * fov, min(most, 3.0 * fov),
        FIELD_RANGE, True, True,
    )  # fmt: skip
    return [field, *across]


_MAKERS = {
    "powers": _powers,
    "colours": _colours,
    "tone": _tone,
    "black": _black,
    "shading": _shading,
    "view": _view,
}


def _asked(design: SensorDesign, path: str, low: float, high: float) -> FitQuantity:
    value = get_value(design, path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CalibrationError(
            f"'{path}' is no number", where=design.where(path), hint="Name one number of the design"
        )
    if not low <= value <= high or not low < high:
        raise CalibrationError(
            f"the range {low:g} to {high:g} of '{path}' does not hold its value, {value:g}",
            hint="Give a range about the design's value",
        )
    return FitQuantity(path, path, "", float(value), low, high, 0.25 * (high - low), renders=True)


def designed(
    design: SensorDesign, chosen: Sequence[FitQuantity], steps: FloatArray
) -> SensorDesign:
    """A design with the numbers of a fit.

    Args:
        design: that the quantities are of.
        chosen: the quantities.
        steps: plausible ranges of each from its start.

    Raises:
        DesignError: the numbers do not fit together.
    """
    values = {each.path: each.value(float(step)) for each, step in zip(chosen, steps, strict=True)}
    found = _prepared(design, values)
    right, up, _ = design.camera.axes()
    moved = np.array(design.camera.position)
    for path, value in values.items():
        if path == "camera.across.right":
            moved = moved + value * right
        elif path == "camera.across.up":
            moved = moved + value * up
        else:
            found = set_value(found, path, value)
    if any(path.startswith("camera.across.") for path in values):
        found = set_value(found, "camera.position", tuple(moved.tolist()))
    return found


def _prepared(design: SensorDesign, values: dict[str, float]) -> SensorDesign:
    """The design with the pieces of the camera whose numbers are set."""
    camera: dict[str, Any] = {}
    if any(path.startswith("camera.colour_matrix") for path in values):
        own = design.camera.colour_matrix
        camera["colour_matrix"] = np.eye(3).tolist() if own is None else own
    if "camera.tone_curve.gamma" in values:
        camera["tone_curve"] = {"kind": "gamma", "gamma": values["camera.tone_curve.gamma"]}
    if "camera.black_level.level" in values:
        level = values["camera.black_level.level"]
        camera["black_level"] = {"level": level, "subtracted": 0.0}
    if "camera.shading.falloff" in values:
        camera["shading"] = {
            "kind": "radial",
            "falloff": values["camera.shading.falloff"],
            "power": values["camera.shading.power"],
        }
    found = design
    for name, value in camera.items():
        found = set_value(found, f"camera.{name}", value)
    return found


def chain_with(
    chain: PictureChain, chosen: Sequence[FitQuantity], steps: FloatArray
) -> PictureChain:
    """The picture chain of the fitted design, without building the design."""
    matrix: FloatArray | None = None
    changed: dict[str, Any] = {}
    shading: dict[str, Any] = {}
    for each, step in zip(chosen, steps, strict=True):
        value = each.value(float(step))
        if each.path.startswith("camera.colour_matrix"):
            if matrix is None:
                matrix = np.eye(3) if chain.colour_matrix is None else np.array(chain.colour_matrix)
            matrix[int(each.path[-5]), int(each.path[-2])] = value
        elif each.path == "camera.tone_curve.gamma":
            changed["tone_curve"] = GammaCurve(gamma=value)
        elif each.path == "camera.black_level.level":
            changed["black_level"] = BlackLevel(level=value, subtracted=0.0)
        elif each.path.startswith("camera.shading."):
            shading[each.path.rpartition(".")[2]] = value
    if shading:
        changed["shading"] = RadialShading(**shading)
    if matrix is not None:
        changed["colour_matrix"] = tuple(tuple(row) for row in matrix.tolist())
    return replace(chain, **changed)


def power_factors(
    groups: Sequence[str], chosen: Sequence[FitQuantity], steps: FloatArray
) -> FloatArray:
    """(groups,) factors on the layers of the light groups as the design has them."""
    factors = np.ones(len(groups))
    for each, step in zip(chosen, steps, strict=True):
        for index, name in enumerate(groups):
            if each.path == f"lights.{name}.flux":
                factors[index] = each.value(float(step)) / each.start
    return factors
