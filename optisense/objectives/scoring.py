"""Scoring a sensor by one objective; an error is recorded in the score."""

from __future__ import annotations

import inspect
import math
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from optisense.errors import ObjectiveError, OptiSenseError, SetupError, UnknownPartError
from optisense.json_values import json_ready
from optisense.objectives.evaluation import Evaluation
from optisense.objectives.registry import Objective
from optisense.objectives.score import Score
from optisense.own_code import error_of_own_code, place_of

RETURNS = "a number, a number and a dict of its parts, or a Score"

RETURNED = "the objective returned"
"""First words of the failure of an objective whose function returns no valid score."""


def run_objective(
    objective: Objective, evaluation: Evaluation, settings: Mapping[str, Any] | None = None
) -> Score:
    """Score a sensor by one objective; any failure of it becomes the score's `failure`.

    Raises:
        SetupError: the renderer can't run on this machine.
        UnknownPartError: the objective is an expression with a part that does not exist.
    """

    def call() -> Any:
        if isinstance(evaluation, Evaluation):  # others share its camera
            evaluation.check_possible()
        return objective(evaluation, **(settings or {}))

    return score_of(objective, call, settings)


def score_of(
    objective: Objective, call: Callable[[], Any], settings: Mapping[str, Any] | None = None
) -> Score:
    """Return the score of an objective from the result of `call`; see `run_objective`.

    Args:
        call: function that calls the objective's function.
        settings: settings on which the objective's range depends.
    """
    began = time.perf_counter()

    def failed(reason: str) -> Score:
        seconds = time.perf_counter() - began
        return Score(
            objective=objective.name,
            value=math.nan,
            failure=reason,
            seconds=seconds,
            title=objective.title,
            unit=objective.unit,
            lower_is_better=objective.lower_is_better,
        )

    try:
        value, parts, arrays, draw = _read(call())
        low, high = objective.bounds(settings)
        parts = json_ready(parts)
    except (SetupError, UnknownPartError):
        raise
    except OptiSenseError as error:
        return failed(str(error))
    except Exception as error:
        return failed(f"{type(error).__name__}: {error} ({_place(error, objective)})")
    if not math.isfinite(value):
        return failed(f"{RETURNED} {value}, which is not a finite number")
    if not low <= value <= high:
        return failed(f"{RETURNED} {value:g}, which is outside its range from {low:g} to {high:g}")
    return Score(
        objective=objective.name,
        value=value,
        parts=parts,
        seconds=time.perf_counter() - began,
        title=objective.title,
        arrays=arrays,
        draw=draw or objective.draw,
        shown=objective.beside,
        unit=objective.unit,
        lower_is_better=objective.lower_is_better,
    )


def _place(error: Exception, objective: Objective) -> str | None:
    """Return the ``file:line`` of an error: the deepest one in a user's code, such as that of a
    kind, or else in the file of the objective's function.
    """
    own = error_of_own_code(error)
    if own is not None:
        return own.where
    code = getattr(inspect.unwrap(objective.function), "__code__", None)
    return place_of(error, getattr(code, "co_filename", None))


def _read(result: Any) -> tuple[float, Mapping[str, Any], Mapping[str, Any], Any]:
    """Return value, parts, figure data and drawing from the result of an objective."""
    if isinstance(result, Score):
        if result.failure is not None:
            raise ObjectiveError(result.failure)
        return _number(result.value), result.parts, result.arrays, result.draw
    if isinstance(result, tuple) and len(result) in (2, 3):
        value, *rest = result
        if all(isinstance(each, Mapping) for each in rest):
            return _number(value), rest[0], rest[1] if len(rest) == 2 else {}, None
    return _number(result), {}, {}, None


def _number(value: Any) -> float:
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        return float(value) + 0.0  # zero without a sign, as tables show it
    raise ObjectiveError(f"{RETURNED} a {type(value).__name__}", hint=f"Return {RETURNS}")
