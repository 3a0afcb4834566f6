"""The page of a study: how the search went, what it found, and every trial."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup

from optisense import __version__
from optisense.design import SensorDesign
from optisense.design.section_drawing import section_svg
from optisense.errors import OptiSenseError
from optisense.report import study_figures
from optisense.report.before_after import Look
from optisense.report.drawing import figure_uri
from optisense.report.files import template
from optisense.report.pictures import data_uri
from optisense.search.methods import find
from optisense.search.study import Study, beside, best_of, front_among
from optisense.search.trial import Trial
from optisense.writing import write_text

MOST_TRIALS = 200
"""Trials in the table: the best ones."""

MOST_COLUMNS = 8
"""Parameters in the table: those that go most with the score."""

MOST_CHANGES = 40
"""Parameters in the list of changes, the largest change first."""

MOST_FAILURES = 10


def write_study_report(
    path: str | Path, study: Study, looks: Mapping[str, Look] | None = None
) -> Path:
    """Write a study as one self-contained HTML page.

    Args:
        path: the file to write; it is written whole or not at all.
        study: finished or not.
        looks: of the designs "before" and "after", where they were rendered.

    Returns:
        The path.

    Raises:
        OutputError: the file can't be written.
    """
    write_text(Path(path), render_study(study, looks))
    return Path(path)


def render_study(study: Study, looks: Mapping[str, Look] | None = None) -> str:
    """The page of `write_study_report` as text."""
    trials = study.trials
    names = study.settings.names
    best, start = best_of(trials), study.start
    scored = [t for t in trials if not t.is_start and math.isfinite(t.score)]
    several = len(names) > 1
    front = front_among([t for t in trials if not t.is_start], names) if several else []
    strongest = [each.number for each in study_figures.influences(trials, names[0])]
    weighed = names if find(study.settings.method).several else names[:1]
    drawn = {
        name: study_figures.parameters(trials, name, _best_by(trials, name) if number else best)
        for number, name in enumerate(weighed)
    }
    environment = Environment(
        loader=DictLoader({"study": template("study.html.j2")}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("study").render(
        title=study.space.design.name,
        description=study.space.design.description,
        goal=" and ".join(weighed),
        headline=_headline(study, trials, best),
        unfinished=_unfinished(study, trials),
        robust=_robust(study),
        convergence=figure_uri(study_figures.convergence(trials, names)) if scored else "",
        parameters=[(name, figure_uri(each)) for name, each in drawn.items() if each is not None],
        shown_parameters=min(len(strongest), study_figures.MOST_PANELS),
        all_parameters=study.space.size,
        front=figure_uri(study_figures.front(trials, front, names, best)) if front else "",
        front_rows=[_front_row(trial, names) for trial in front[:MOST_TRIALS]],
        names=names,
        sides=_sides(study, start, best, looks or {}),
        overlay=_overlay(study, best),
        scores=_scores(study, start, best),
        changes=_changes(study, start, best)[:MOST_CHANGES],
        all_changes=len(_changes(study, start, best)),
        trials=_table(study, trials, strongest[:MOST_COLUMNS]),
        finished=len(trials),
        failures=_failures(trials),
        settings=_settings(study),
        version=__version__,
        css=Markup(template("report.css")),
    )


def _best_by(trials: Sequence[Trial], name: str) -> Trial | None:
    fine = [trial for trial in trials if math.isfinite(trial.scores.get(name, math.nan))]
    return max(fine, key=lambda trial: trial.scores[name], default=None)


def _headline(study: Study, trials: Sequence[Trial], best: Trial | None) -> list[tuple[str, str]]:
    settings = study.settings
    facts = [("method", settings.method), ("objectives", ", ".join(settings.names))]
    count = sum(not trial.is_start for trial in trials)
    facts.append(("trials", f"{count:,} of {settings.budget:,}"))
    failed = sum(trial.failure is not None for trial in trials)
    if failed:
        facts.append(("failed", f"{failed:,}"))
    facts += [("parameters", f"{study.space.size:,}"), ("seed", str(settings.seed))]
    spent = sum(trial.outcome.seconds for trial in trials)
    facts.append(("computing time", f"{spent:,.0f} s" if spent >= 10 else f"{spent:.2g} s"))
    if best is not None:
        by = f" by {study.objective}" if len(settings.names) > 1 else ""
        facts.append((f"best{by}", f"trial {best.number}"))
    return facts


def _unfinished(study: Study, trials: Sequence[Trial]) -> str:
    ended = study.store.fact("ended")
    if not any(math.isfinite(trial.score) for trial in trials):
        return "No trial has a score yet."
    if ended is None:
        return "This search is not finished: the page shows the trials so far."
    return "This search was interrupted: it can go on." if ended == "interrupted" else ""


def _robust(study: Study) -> str:
    settings = study.settings
    if settings.errors is None:
        return ""
    paths = ", ".join(f"{path} {size:g}" for path, (_, size) in settings.errors.items())
    return (
        f"Scores are what nine of ten manufactured sensors reach (P10 over {settings.samples} of "
        f"them), with errors of making: {paths}."
    )


def _front_row(trial: Trial, names: Sequence[str]) -> list[str]:
    return [str(trial.number), *(_number(trial.scores[name]) for name in names)]


def _sides(
    study: Study, start: Trial | None, best: Trial | None, looks: Mapping[str, Look]
) -> list[dict[str, Any]]:
    """Before and after: the picture, the section, and what the camera covers."""
    found = []
    for label, trial in (("before", start), ("after", best)):
        design = _design(study, trial) if label == "after" else study.space.design
        if design is None:
            continue
        seen = looks.get(label, Look())
        facts = [] if seen.coverage is None else [("coverage", f"{100 * seen.coverage:.1f} %")]
        facts += [(name, _number(value)) for name, value in seen.facts.items()]
        found.append(
            {
                "label": label,
                "what": "the start" if trial is None or trial.is_start else f"trial {trial.number}",
                "picture": "" if seen.picture is None else data_uri(seen.picture),
                "failure": seen.failure or "",
                "facts": facts,
                "section": Markup(section_svg(design)),
            }
        )
    return found


def _overlay(study: Study, best: Trial | None) -> str:
    """Both outlines in one drawing, where a shape or a place has changed."""
    after = _design(study, best)
    if best is None or best.is_start or after is None:
        return ""
    moved = study.space.reshapes or any(
        name.startswith(("lights.", "camera."))
        and not name.endswith((".colour", ".flux", ".model"))
        for name in study.space.names
    )
    return figure_uri(study_figures.sections(study.space.design, after)) if moved else ""


def _design(study: Study, trial: Trial | None) -> SensorDesign | None:
    if trial is None:
        return None
    try:
        return trial.design
    except OptiSenseError:
        return None


def _scores(study: Study, start: Trial | None, best: Trial | None) -> list[list[str]]:
    """Name, before, after, and both with fresh seeds, of every objective and what stands beside."""
    rows = []
    for name in study.settings.names:
        row = [name]
        for trial in (start, best):
            row.append("" if trial is None else _number(trial.scores.get(name, math.nan)))
        for trial in (start, best):
            row.append("" if trial is None else _fresh(trial, name))
        rows.append(row)
    sides = [{} if trial is None else beside(study, trial) for trial in (start, best)]
    for name in dict.fromkeys([*sides[0], *sides[1]]):
        if name not in study.settings.names:
            cells = [_number(side[name]) if name in side else "" for side in sides]
            rows.append([name.replace("_", " "), *cells, "", ""])
    return rows


def _fresh(trial: Trial, name: str) -> str:
    mean, spread = trial.fresh_score(name), trial.fresh_spread(name)
    if not math.isfinite(mean):
        return ""
    return f"{_number(mean)} ± {spread:.2g}" if math.isfinite(spread) else _number(mean)


def _changes(study: Study, start: Trial | None, best: Trial | None) -> list[list[str]]:
    """Parameter, before and after, the largest change relative to its range first."""
    if best is None:
        return []
    space = study.space
    before = space.start if start is None else start.vector
    apart = np.abs(space.to_unit(best.vector) - space.to_unit(before))
    old, new = space.values(before), best.values
    return [
        [space.names[number], _text(list(old.values())[number]), _text(list(new.values())[number])]
        for number in np.argsort(-apart, kind="stable")
        if apart[number] > 0.0
    ]


def _table(study: Study, trials: Sequence[Trial], columns: Sequence[int]) -> dict[str, Any]:
    """The best trials, with the parameters that matter most."""
    fine = sorted(
        (trial for trial in trials if math.isfinite(trial.score)), key=lambda trial: -trial.score
    )
    paths = [study.space.names[number] for number in columns]
    rows = []
    for trial in fine[:MOST_TRIALS]:
        values = list(trial.values.values())
        number = f"{trial.number} (start)" if trial.is_start else str(trial.number)
        scores = [_number(trial.scores[name]) for name in study.settings.names]
        fresh = [_fresh(trial, study.objective)]
        rows.append([number, *scores, *fresh, *(_text(values[column]) for column in columns)])
    heads = ["trial", *study.settings.names, "fresh seeds", *paths]
    return {"heads": heads, "rows": rows}


def _failures(trials: Sequence[Trial]) -> list[tuple[str, int, str]]:
    """Reasons with how often, and the first trials that have each."""
    found: dict[str, list[int]] = {}
    for trial in trials:
        if trial.failure is not None:
            found.setdefault(trial.failure, []).append(trial.number)
    ranked = sorted(found.items(), key=lambda item: -len(item[1]))
    return [
        (reason, len(numbers), ", ".join(map(str, numbers[:5])))
        for reason, numbers in ranked[:MOST_FAILURES]
    ]


def _settings(study: Study) -> list[tuple[str, str]]:
    settings = study.settings
    rows = [("varied", "; ".join(f"{path}: {_plain(v)}" for path, v in settings.space.items()))]
    rows += [(f"option {key}", _plain(value)) for key, value in settings.options.items()]
    rows += [(f"setting {key}", _plain(value)) for key, value in settings.settings.items()]
    if settings.rules:
        rows.append(("rules", ", ".join(settings.rules)))
    ended = study.store.fact("ended")
    rows += [("begun", settings.begun), ("ended", str(ended or "not yet"))]
    rows += [(f"version of {name}", text) for name, text in settings.versions.items()]
    return rows


def _plain(value: Any) -> str:
    if isinstance(value, Mapping) and "kind" in value:
        inner = {k: v for k, v in value.items() if k not in ("kind", "labels") and v is not None}
        return f"{value['kind']} " + ", ".join(f"{k} {_plain(v)}" for k, v in inner.items())
    return value if isinstance(value, str) else json.dumps(value)


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "failed"


def _text(value: float | int | str) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
