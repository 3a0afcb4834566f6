"""Quantities that a calibration fits, and the design for their values.

Each quantity has a start, limits, and a plausible range: the standard deviation of a normal
distribution about the start, which the photographs outweigh if they are informative. Quantities of
the camera's processing and the powers of the lights only change how the layers of a picture are
mixed and stored; the others need a new rendering.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from optisense.array_types import FloatArray
from optisense.calibration.families import EXPOSURE, FAMILIES
from optisense.calibration.quantity import FitQuantity
from optisense.design import SensorDesign, get_value, set_value
from optisense.design.lenses.shading import RadialShading
from optisense.design.responses import PictureChain
from optisense.design.responses.tone_curve import GammaCurve
from optisense.errors import CalibrationError

STARTS: dict[str, Any] = {
    "colour_matrix": np.eye(3).tolist(),
    "tone_curve": {"kind": "gamma"},
    "stray_light": (0.0, 0.0, 0.0),
    "shading": {"kind": "radial"},
}
"""Components that a camera without them gets before its numbers are set; these have no effect, or
their numbers are all set."""


def quantities_of(
    design: SensorDesign, families: Sequence[str], asked: Sequence[tuple[str, float, float]] = ()
) -> list[FitQuantity]:
    """Return the quantities of a design that are fitted: those of families of `FAMILIES`, and
    further numbers that are asked for by path, smallest and largest value.

    A family that is unknown, and a range that does not contain the design's value, raise
    CalibrationError; a path that names no value raises DesignError.
    """
    unknown = [name for name in families if name not in FAMILIES]
    if unknown:
        raise CalibrationError(
            f"there is nothing called '{unknown[0]}' that can be fitted",
            hint="Use " + ", ".join(FAMILIES),
        )
    found: list[FitQuantity] = []
    for name in FAMILIES:
        if name in families:
            found += FAMILIES[name].of(design)
    for path, low, high in asked:
        found.append(_asked(design, path, low, high))
    paths = [each.path for each in found]
    for path in paths:
        if paths.count(path) > 1:
            raise CalibrationError(f"'{path}' is fitted twice", hint="Name it once")
    return found


def _asked(design: SensorDesign, path: str, low: float, high: float) -> FitQuantity:
    value = get_value(design, path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CalibrationError(
            f"'{path}' is no number", where=design.where(path), hint="Name one number of the design"
        )
    if not low <= value <= high or not low < high:
        raise CalibrationError(
            f"the range {low:g} to {high:g} of '{path}' does not contain its value, {value:g}",
            hint="Give a range about the design's value",
        )
    if re.fullmatch(r"lights\.[^.]+\.flux", path):
        return _asked_power(design, path, low, high)
    return FitQuantity(path, path, "", float(value), low, high, 0.25 * (high - low), renders=True)


def _asked_power(design: SensorDesign, path: str, low: float, high: float) -> FitQuantity:
    """Return the power of a light group, which changes pictures without a rendering."""
    for each in FAMILIES["powers"].of(design):
        if each.path == path:
            return replace(each, low=low, high=high)
    raise CalibrationError(
        f"the power '{path}' is 0, and is fitted by factors",
        where=design.where(path),
        hint="Give the lights a power above 0",
    )


def fits_all_powers(design: SensorDesign, chosen: Sequence[FitQuantity]) -> bool:
    """Return whether the powers of all light groups that shine are among the fitted numbers: the
    exposure then follows from them, as photographs do not distinguish it from their sum.
    """
    fitted = {each.path for each in chosen}
    return all(each.path in fitted for each in FAMILIES["powers"].of(design))


def designed(
    design: SensorDesign, chosen: Sequence[FitQuantity], steps: FloatArray
) -> SensorDesign:
    """Return a design with the numbers of a fit, each at its step (n,) from its start in plausible
    ranges; numbers that do not fit together raise DesignError.
    """
    values = {each.path: each.value(float(step)) for each, step in zip(chosen, steps, strict=True)}
    found = _prepared(design, [each.path for each in chosen])
    for each in chosen:
        value = values[each.path]
        change = each.change
        found = set_value(found, each.path, value) if change is None else change(found, value)
    return found


def _prepared(design: SensorDesign, paths: Sequence[str]) -> SensorDesign:
    """Return the design with the components of the camera that numbers at these paths belong to.

    Those that the design has stay as they are, with all of their other numbers.
    """
    found = design
    for name, start in STARTS.items():
        belongs = any(path.startswith((f"camera.{name}.", f"camera.{name}[")) for path in paths)
        if belongs and getattr(design.camera, name) is None:
            found = set_value(found, f"camera.{name}", start)
    return found


def chain_with(
    chain: PictureChain, chosen: Sequence[FitQuantity], steps: FloatArray
) -> PictureChain:
    """Return the picture chain of the fitted design, without building the design, from that of the
    design and the steps (n,) of the quantities.
    """
    matrix: FloatArray | None = None
    changed: dict[str, Any] = {}
    shading: dict[str, Any] = {}
    stray: dict[int, float] = {}
    for each, step in zip(chosen, steps, strict=True):
        value = each.value(float(step))
        if each.path.startswith("camera.colour_matrix"):
            if matrix is None:
                matrix = np.eye(3) if chain.colour_matrix is None else np.array(chain.colour_matrix)
            matrix[int(each.path[-5]), int(each.path[-2])] = value
        elif each.path == "camera.tone_curve.gamma":
            changed["tone_curve"] = GammaCurve(gamma=value)
        elif each.path.startswith("camera.stray_light"):
            stray[int(each.path[-2])] = value
        elif each.path.startswith("camera.shading."):
            shading[each.path.rpartition(".")[2]] = value
    if shading:
        changed["shading"] = (chain.shading or RadialShading()).model_copy(update=shading)
    if stray:
        own = chain.stray_light or (0.0, 0.0, 0.0)
        changed["stray_light"] = tuple(stray.get(channel, own[channel]) for channel in range(3))
    if matrix is not None:
        changed["colour_matrix"] = tuple(tuple(row) for row in matrix.tolist())
    return replace(chain, **changed)


def power_factors(
    groups: Sequence[str], chosen: Sequence[FitQuantity], steps: FloatArray
) -> FloatArray:
    """Return the factors (groups,) on the layers of the light groups relative to the design, and
    to the first guess of the exposure.
    """
    factors = np.ones(len(groups))
    for each, step in zip(chosen, steps, strict=True):
        for index, name in enumerate(groups):
            if each.path in (f"lights.{name}.flux", EXPOSURE.path):
                factors[index] *= each.value(float(step)) / each.start
    return factors
