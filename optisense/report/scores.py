"""Page of a sensor's scores: a table, its section, and the figure and parts of each score."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from optisense.design.section import along_rows
from optisense.design.section_drawing import DrawnRay, section_svg
from optisense.errors import OptiSenseError
from optisense.objectives.registry import Objective
from optisense.objectives.score import Score, Scored, shown_number
from optisense.report._files import page
from optisense.report._pictures import figure_uri
from optisense.report.camera_rays import CameraRays
from optisense.writing import write_text

SHARES = frozenset({"pixels_that_see_the_surface"})
"""Parts of scores that are shares, 0 to 1, but have a name like that of a count."""

Table = tuple[list[str], list[list[str]]]
"""Column heads and rows."""


def write_score_report(path: str | Path, scored: Scored, objectives: list[Objective]) -> Path:
    """Write scores as one self-contained HTML page.

    Args:
        path: path of the file, which is written whole or not at all.
        scored: scores.
        objectives: objectives of the scores.

    Returns:
        The path.

    Raises:
        OutputError: the file can't be written.
    """
    write_text(Path(path), render_scores(scored, objectives))
    return Path(path)


def render_scores(scored: Scored, objectives: list[Objective]) -> str:
    """Return the page of `write_score_report` as text."""
    summaries = {each.name: each.summary for each in objectives}
    return page(
        "scores",
        title=scored.design.name,
        description=scored.design.description,
        headline=_headline(scored),
        section=Markup(section_svg(scored.design, _rays(scored))),
        rows=[_row(scored, name, score) for name, score in scored.scores.items()],
        seeds=len(scored.runs),
        scores=[
            _score(scored, name, score, summaries.get(name, ""))
            for name, score in scored.scores.items()
        ],
        settings=[
            (key.replace("_", " "), _text(value))
            for key, value in scored.to_dict().get("settings", {}).items()
        ],
    )


def _headline(scored: Scored) -> list[tuple[str, str]]:
    if not scored.runs:
        return []
    first = scored.runs[0].evaluation
    facts = [
        ("images", "{} × {}".format(*first.resolution)),
        ("rays", "{} × {}".format(*first.ray_resolution)),
        ("seeds", str(len(scored.runs))),
    ]
    return facts


def _rays(scored: Scored) -> Sequence[DrawnRay]:
    """Return chief rays for the section; none without scores or if the camera can't be traced."""
    if not scored.runs:
        return ()
    try:
        rays = CameraRays.of(scored.runs[0].evaluation.model)
    except OptiSenseError:
        return ()
    return rays.in_section(along_rows(scored.design))


def _row(scored: Scored, name: str, score: Score) -> dict[str, str]:
    spread = scored.spread(name)
    failed = score.failure is not None
    return {
        "name": score.name,
        "value": "failed" if failed else f"{scored.mean(name):.4g}",
        "spread": "" if spread is None else f"± {spread:.2g}",
        "seconds": f"{score.seconds:.2f} s",
        "note": score.failure or scored.beside(name),
    }


def _score(scored: Scored, name: str, score: Score, summary: str) -> dict[str, Any]:
    """Return an objective's section. Its heading is the value of the table; figure and parts are
    those of the first seed, whose own value is shown beside them.
    """
    row = _row(scored, name, score)
    numbers = [
        (key.replace("_", " "), _percent(value) if key in SHARES else _text(value))
        for key, value in score.parts.items()
        if not isinstance(value, list | Mapping)
    ]
    tables = []
    for key, value in score.parts.items():
        table = _table(value)
        if table is not None:
            tables.append({"name": key.replace("_", " "), "heads": table[0], "rows": table[1]})
    return {
        "name": score.name,
        "value": row["value"],
        "spread": row["spread"],
        "first": f"{score.value:.4g}",
        "first_seed": scored.runs[0].evaluation.settings.seed,
        "failure": score.failure,
        "summary": summary,
        "figure": "" if score.failure is not None else _figure(score),
        "numbers": numbers,
        "tables": tables,
    }


def _figure(score: Score) -> str:
    """Return the score's figure as the address of an ``<img>``; empty if a user's drawing fails."""
    try:
        return figure_uri(score.figure())
    except Exception:  # the figure of a user's objective is a user's code; the score is kept
        return ""


def _table(value: Any) -> Table | None:
    """Return lists of dicts as tables, dicts of single values as rows, without deeper nesting."""
    if isinstance(value, Mapping):
        flat = {k: v for k, v in value.items() if not isinstance(v, list | Mapping)}
        return ([str(k) for k in flat], [[_text(v) for v in flat.values()]]) if flat else None
    if not isinstance(value, list) or not value or not isinstance(value[0], Mapping):
        return None
    heads = list(value[0])
    rows = [[_text(row.get(head)) for head in heads] for row in value]
    return [head.replace("_", " ") for head in heads], rows


def _percent(value: Any) -> str:
    """Return a share as text; a user's part of that name may be anything."""
    return f"{100.0 * value:.4g} %" if isinstance(value, float) else _text(value)


def _text(value: Any) -> str:
    """Return a value on one line."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key}: {_text(inner)}" for key, inner in value.items())
    if isinstance(value, list):
        return ", ".join(_text(inner) for inner in value)
    if value is None:
        return "default"
    return shown_number(value) if isinstance(value, int | float) else str(value)
