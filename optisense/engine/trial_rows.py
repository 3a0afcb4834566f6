"""Trials of a search as rows of answers and events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from optisense.search import Study, Trial


def curve_row(trial: Trial) -> dict[str, Any]:
    """Return a point of the curve of scores."""
    return {
        "number": trial.number,
        "start": trial.is_start,
        "scores": trial.scores,
        "failure": trial.failure,
        "feasible": trial.failure is None and trial.is_feasible,
    }


def trial_row(study: Study, trial: Trial) -> dict[str, Any]:
    """Return a trial without its design."""
    from optisense.search.study.conditions import margins
    from optisense.search.study.study import beside

    return {
        **curve_row(trial),
        "values": trial.values,
        "vector": trial.vector,
        "beside": beside(study, trial),
        "conditions": [
            {"condition": text, "value": value, "margin": margin}
            for text, value, margin in margins(trial)
        ],
    }
