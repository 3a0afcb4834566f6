"""Requests that score a design."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from pydantic import Field

from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.rendering import DesignFields, design_of
from optisense.engine.requests import Lane, handles, listed
from optisense.engine.session import Files, Session

if TYPE_CHECKING:
    from optisense.objectives import Objective, Score

_registering = threading.Lock()


class Evaluate(DesignFields):
    """Fields of the request "evaluate"; see docs/engine.md."""

    objectives: list[str] = Field(
        default=["rgb2normal", "normdiff", "aoap", "2to3pw"], min_length=1
    )
    settings: dict[str, Any] = Field(default_factory=dict)
    figures: bool = False


@handles("objectives", Fields, Lane.QUICK)
def objectives(session: Session, fields: Fields, job: Job) -> dict[str, Any]:
    """Return the objectives that can be scored."""
    from optisense.objectives.registry import OBJECTIVES

    rows, failed = listed(OBJECTIVES, lambda name, each: _row(each))
    return {"objectives": rows, "unavailable": failed}


def _row(objective: Objective) -> dict[str, Any]:
    bounds = objective.bounds()
    return {
        "name": objective.name,
        "title": objective.title,
        "summary": objective.summary,
        "settings": objective.settings,
        "unit": objective.unit,
        "lower_is_better": objective.lower_is_better,
        "rays_only": objective.rays_only,
        "usual": objective.usual,
        "range": bounds if all(map(math.isfinite, bounds)) else None,
    }


@handles("evaluate", Evaluate, Lane.RENDER)
def evaluate(session: Session, fields: Evaluate, job: Job) -> dict[str, Any]:
    """Score a design, objective by objective."""
    from optisense.objectives import Settings
    from optisense.objectives.combined import resolve
    from optisense.objectives.run import Scoring, split_settings

    files = session.files(fields, job.id)
    with own_objectives():
        wanted = resolve(fields.objectives)
    shared, _ = split_settings(fields.settings, wanted)
    Settings(**shared)  # wrong ones are refused before any work
    design = design_of(session, fields, job)
    session.designs.require_valid(design)
    job.progress(0.0, "building the sensor")
    model = session.renderer.model(design)

    def report(done: float, title: str, step: str) -> None:
        job.progress(done, step or title)

    rows = []
    for score in Scoring(model, wanted, fields.settings, report):
        row = score.to_dict() | {"beside": score.beside, "figure": None}
        if fields.figures:
            row["figure"] = _figure(score, files)
        job.send("score", score=row)
        rows.append(row)
    return {"scores": rows}


@contextmanager
def own_objectives() -> Iterator[None]:
    """Context after which all that a user's files have registered in it is removed.

    Objectives of one name in two files must not conflict in a process that lives for days, and a
    file that was edited must be read anew.
    """
    from optisense.objectives.registry import forgetting

    with _registering, forgetting():
        yield


def _figure(score: Score, files: Files) -> str | None:
    """Draw a score; None if a user's own drawing fails."""
    from optisense.library.previews import save

    path = files.path(f"{score.file_name}.png")
    try:
        save(score.figure(), path)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        print(f"the figure of {score.objective} can't be drawn: {error}", file=sys.stderr)
        return None
    return str(path)
