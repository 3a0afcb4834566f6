"""Tables on the page of a study: scores, changes, trials, failures, settings."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from optisense.report.before_after import RayFigures
from optisense.search.evaluation.outcome import rank_of
from optisense.search.study.conditions import condition_results, is_worse
from optisense.search.study.failures import FAILED, causes_among, counted, incomplete
from optisense.search.study.study import Study, beside
from optisense.search.study.trial import Trial

MOST_TRIALS = 200
"""Largest number of trials in the table, the best ones; a page with thousands would load slowly."""

MOST_CHANGES = 40
"""Largest number of parameters in the list of changes, largest first, for readability."""

MOST_CAUSES = 10
"""Largest number of causes of failure in the table, by frequency; the others are counted."""

NONE = "–"
"""Text of a cell without a number."""

ONE_POINT = re.compile(r"cages\.[^.]+\.(?:points|blend)\[")
"""Pattern of parameters that are coordinates of single control points."""


class Table(NamedTuple):
    """Heads and rows of text; rows are as long as the heads."""

    heads: list[str]
    rows: list[list[str]]

    def without_empty_columns(self) -> Table:
        """Return the table without columns that have no entry in any row."""
        kept = [
            column
            for column in range(len(self.heads))
            if column == 0 or any(row[column] not in ("", NONE) for row in self.rows)
        ]
        return Table(
            [self.heads[column] for column in kept],
            [[row[column] for column in kept] for row in self.rows],
        )


def scores(study: Study, start: Trial | None, best: Trial | None) -> Table:
    """Return every objective and the numbers beside it, before and after, with the study's seed and
    with fresh ones.

    Columns without any number are left out.
    """
    rows = []
    for name in study.settings.names:
        row = [name]
        for trial in (start, best):
            row.append(NONE if trial is None else number(trial.scores.get(name, math.nan)))
        for trial in (start, best):
            row.append("" if trial is None else fresh(trial, name))
        rows.append([cell or NONE for cell in row])
    sides = [{} if trial is None else beside(study, trial) for trial in (start, best)]
    for name in dict.fromkeys([*sides[0], *sides[1]]):
        if name not in study.settings.names:
            cells = [number(side[name]) if name in side else NONE for side in sides]
            rows.append([name.replace("_", " "), *cells, NONE, NONE])
    heads = ["", "before", "after", "before, fresh seeds", "after, fresh seeds"]
    return Table(heads, rows).without_empty_columns()


def conditions(study: Study, start: Trial | None, best: Trial | None) -> Table | None:
    """Return each condition with its values before and after, and the best's margin."""
    rows = []
    for each in condition_results(study.settings.requirements, best, start):
        measured = [
            number(math.nan if value is None else value)
            for value in (each.before, each.value, each.margin)
        ]
        broken = each.margin is not None and not each.met
        rows.append([each.text, *measured[:2], "broken" if broken else measured[2]])
    return Table(["", "before", "after", "margin"], rows) if rows else None


def fresh(trial: Trial, name: str) -> str:
    """Return the mean over fresh seeds with its deviation; empty if there is none."""
    mean, spread = trial.fresh_score(name), trial.fresh_spread(name)
    if not math.isfinite(mean):
        return ""
    if spread > 0.0:
        return f"{number(mean)} ± {spread:.2g}"
    return number(mean)


def why_no_fresh(study: Study, trials: Sequence[Trial]) -> str:
    """Return the reason why no trial has a score with fresh seeds; empty if some have."""
    if any(trial.fresh for trial in trials) or not any(math.isfinite(t.score) for t in trials):
        return ""
    reasons = {
        None: "The search is not at its end, where it scores the best trials with fresh seeds",
        "interrupted": "The search was interrupted before it scored the best trials with fresh "
        "seeds",
    }
    reason = reasons.get(study.store.fact("ended"), "No trial was scored with fresh seeds")
    return f"{reason}: the best score may be partly due to chance."


def ray_figures(before: RayFigures | None, after: RayFigures | None) -> Table | None:
    """Return the measures of the chief rays of both designs, or None if they were not traced."""
    if before is None and after is None:
        return None
    rows = [
        [label, *(_figure(side, field, percent) for side in (before, after))]
        for label, field, percent, _ in _FIGURES
    ]
    return Table(["", "before", "after"], rows).without_empty_columns()


_FIGURES = (
    ("AOAP (higher is better)", "aoap", False, False),
    ("coverage: area of the skin in view", "coverage", True, False),
    ("pixels that see the skin", "seeing", True, False),
    ("upright rays: mean cosine to the skin's normal", "upright", False, False),
    ("2to3PW: evenness of the pixels (higher is better)", "evenness", False, False),
    ("stretching, median pixel (1 is undistorted)", "stretching", False, True),
    ("stretching of the worst tenth of the pixels, at least", "worst_stretching", False, True),
)
"""Label, attribute of `RayFigures`, whether it is shown in percent, and whether lower is better."""


def _figure(side: RayFigures | None, field: str, percent: bool) -> str:
    value = math.nan if side is None else float(getattr(side, field))
    if not math.isfinite(value):
        return NONE
    return f"{100 * value:.1f} %" if percent else f"{value:.4g}"


def worsened_figures(before: RayFigures | None, after: RayFigures | None) -> list[str]:
    """Return the ray measures in which the second design is worse, each with both numbers."""
    if before is None or after is None:
        return []
    found = []
    for label, field, percent, lower_is_better in _FIGURES:
        old, new = getattr(before, field), getattr(after, field)
        if is_worse(new, old, lower_is_better=lower_is_better):
            name = re.split(r"[:(]", label)[0].strip()
            scale, unit = (100.0, " %") if percent else (1.0, "")
            found.append(f"{name} ({scale * old:.3g}{unit} before, {scale * new:.3g}{unit} after)")
    return found


def changes(
    study: Study, start: Trial | None, best: Trial | None, drawn_cages: bool
) -> list[list[str]]:
    """Return parameter, values before and after, the largest change relative to its range first.

    Args:
        start, best: trials of the study.
        drawn_cages: whether the control points of cages are shown elsewhere and left out.
    """
    if best is None:
        return []
    space = study.space
    before = space.start if start is None else start.vector
    apart = np.abs(space.to_unit(best.vector) - space.to_unit(before))
    old, new = list(space.values(before).values()), list(best.values.values())
    return [
        [space.names[each], value_text(old[each]), value_text(new[each])]
        for each in np.argsort(-apart, kind="stable")
        if apart[each] > 0.0 and not (drawn_cages and ONE_POINT.match(space.names[each]))
    ]


def trials(study: Study, found: Sequence[Trial], columns: Sequence[int]) -> Table:
    """Return the best trials, with the parameters of the strongest influence."""
    scored = (trial for trial in found if math.isfinite(trial.score))
    fine = sorted(scored, key=lambda trial: rank_of(trial.outcome, study.objective), reverse=True)
    rows = []
    for trial in fine[:MOST_TRIALS]:
        values = list(trial.values.values())
        name = f"{trial.number} (start)" if trial.is_start else str(trial.number)
        row = [name, *(number(trial.scores[each]) for each in study.settings.names)]
        row.append(fresh(trial, study.objective))
        row.append("" if trial.is_feasible else "broken")
        rows.append([*row, *(value_text(values[column]) for column in columns)])
    paths = [study.space.names[column] for column in columns]
    heads = [
        "trial",
        *study.settings.names,
        f"{study.objective}, fresh seeds",
        "conditions",
        *paths,
    ]
    return Table(heads, rows).without_empty_columns()


def failures(found: Sequence[Trial]) -> list[tuple[str, Table, int]]:
    """Return a heading for each kind of trials that lack a value, the causes, the most frequent
    first, and the number of omitted ones.
    """
    tables = []
    for kind, members in incomplete(found).items():
        causes = causes_among(members)
        rows = [
            [each.text, counted(each.trials), f"trial {each.trials[0].number}: {each.example}"]
            for each in causes[:MOST_CAUSES]
        ]
        heading = "Failed trials" if kind == FAILED else f"Trials {kind}"
        table = Table(["cause", "number", "such as"], rows)
        tables.append((heading, table, max(0, len(causes) - MOST_CAUSES)))
    return tables


def settings(study: Study) -> list[tuple[str, str]]:
    """Return the settings of the search, by name and value."""
    known = study.settings
    rows = [("varied", "; ".join(f"{path}: {_plain(v)}" for path, v in known.space.items()))]
    rows += [(f"option {key}", _plain(value)) for key, value in known.options.items()]
    rows += [(f"setting {key}", _plain(value)) for key, value in known.settings.items()]
    if known.requirements:
        rows.append(("conditions", ", ".join(known.requirements)))
    if known.rules:
        rows.append(("rules", ", ".join(known.rules)))
    ended = study.store.fact("ended")
    rows += [("begun", known.begun), ("ended", str(ended or "not yet"))]
    rows += [(f"version of {name}", text) for name, text in known.versions.items()]
    return rows


def number(value: float) -> str:
    """Return a score as text."""
    return f"{value:.4g}" if math.isfinite(value) else "failed"


def value_text(value: float | int | str) -> str:
    """Return a parameter's value as text."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _plain(value: Any) -> str:
    if isinstance(value, Mapping) and "kind" in value:
        inner = {k: v for k, v in value.items() if k not in ("kind", "labels") and v is not None}
        return f"{value['kind']} " + ", ".join(f"{k} {_plain(v)}" for k, v in inner.items())
    return value if isinstance(value, str) else json.dumps(value)
