"""Advice before a search: whether it can succeed, and how long it takes."""

from __future__ import annotations

import re
from typing import Any

import bpy

from ..core import search_parameters
from ..core.engine import EngineError
from ..core.numbers import duration
from ..engine import session
from ..scene.paths import objective

BY_RAYS, BY_PICTURES = "aoap", "rgb2normal"
"""Objectives that a new search is set to: for parameters that move rays, and for those that change
brightness and colours only.
"""

BRIGHTNESS = re.compile(r"coating\.|lights\.[^.]+\.(flux|colour)|materials\.[^.]+\.reflectance")
"""Pattern of the paths that change brightness and colours only; the engine knows all such paths."""


def choose_objective(search: bpy.types.PropertyGroup) -> None:
    """Set the default objective that suits the parameters; one chosen by the user stays."""
    texts = search_parameters.texts_of(search.vary)
    if search.objective in (BY_RAYS, BY_PICTURES) and texts:
        bright = all(BRIGHTNESS.match(text) for text in texts)
        search.objective = BY_PICTURES if bright else search.objective


def advice(design: dict[str, Any], search: bpy.types.PropertyGroup, fields: dict[str, Any]) -> str:
    """Return the number of trials and the usual duration of a search, in words.

    Raises:
        EngineError: the search can't succeed, or there is no engine.
    """
    answer = session.ask_and_wait(
        "advise",
        design=design,
        vary=search_parameters.texts_of(search.vary),
        objectives=[objective(each) for each in search.objective.split(",")],
        method=search.method,
        **fields,
    )
    if answer["advice"] is not None:
        message, _, hint = answer["advice"].partition(". ")
        raise EngineError({"kind": "SearchError", "message": message, "hint": hint})
    return f"{answer['trials']} trials usually take {duration(answer['seconds'] / search.workers)}"


def is_flat(scores: list[float]) -> bool:
    """Return whether all trials of a search have the same score: the parameters have no effect."""
    return len(scores) >= LEAST and max(scores) - min(scores) <= ALIKE * max(map(abs, scores))


LEAST, ALIKE = 5, 1e-6
"""Number of trials after which equal scores are reported, and the relative difference up to which
scores are equal: the rounding error of single precision.
"""
