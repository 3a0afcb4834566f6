"""Page of a study: the course of the search, its result, and every trial."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.design.section import along_rows
from optisense.design.section_drawing import section_svg
from optisense.errors import OptiSenseError
from optisense.report import _study_figures as study_figures
from optisense.report import _study_tables as tables
from optisense.report._cage_changes import CageChange, cage_changes, cage_figure
from optisense.report._files import as_json, page, script
from optisense.report._pictures import MOST_STRETCHED, data_uri, figure_uri, stretching_colours
from optisense.report._trial_marks import Marks, TrialFigure, page_data, selectable
from optisense.report.before_after import DesignView
from optisense.report.tolerance import shown_size
from optisense.report.trial_pictures import count_in_words, marks_svg
from optisense.search.methods import find
from optisense.search.study.best import best_of, front_among, nearest, newer_note
from optisense.search.study.conditions import condition_note, worsened_note
from optisense.search.study.failures import counted, incomplete, incomplete_note
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial
from optisense.writing import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_COLUMNS = 8
"""Largest number of parameters in the table of trials: those most associated with the score."""

FEW_CHANGES = 8
"""Number of rows of a table of changes that are shown at first; the others are folded away."""


def write_study_report(
    path: str | Path,
    study: Study,
    views: Mapping[str, DesignView] | None = None,
    *,
    pictures: Mapping[int, NDArray[np.uint8]] | None = None,
    named: str | None = None,
) -> Path:
    """Write a study as one self-contained HTML page.

    Args:
        path: path of the file, which is written whole or not at all.
        study: study, finished or not.
        views: views of the designs "before" and "after", if they were rendered.
        pictures: pictures (h, w, 3) of some trials, by number (`TrialPictures`), shown on a click.
        named: the study's folder as the user names it, for the commands on the page.

    Returns:
        The path.

    Raises:
        OutputError: the file can't be written.
    """
    write_text(Path(path), render_study(study, views, pictures=pictures, named=named))
    return Path(path)


def render_study(
    study: Study,
    views: Mapping[str, DesignView] | None = None,
    *,
    pictures: Mapping[int, NDArray[np.uint8]] | None = None,
    named: str | None = None,
    live: str | None = None,
) -> str:
    """Return the page of `write_study_report` as text.

    Args:
        live: version of the page, if a `LiveServer` serves it: the page then refreshes itself, and
            requests the pictures of trials from the server.
    """
    trials = study.trials
    names = study.settings.names
    best, start = best_of(trials), study.start
    scored = [t for t in trials if not t.is_start and math.isfinite(t.score)]
    several = len(names) > 1
    front = front_among([t for t in trials if not t.is_start], names) if several else []
    strongest = [each.number for each in study_figures.influences(trials, names[0])]
    weighed = names if find(study.settings.method).multi_objective else names[:1]
    known = selectable(trials)
    figures_of = _Figures({trial.number for trial in known})
    if scored:
        figures_of.draw("convergence", partial(study_figures.convergence, trials, names))
    drawn = {}
    for number, name in enumerate(weighed):
        top = _best_by(trials, name) if number else best
        label = f"parameters {name}"
        if figures_of.draw(label, partial(study_figures.parameters, trials, name, top)):
            drawn[name] = label
    if front:
        figures_of.draw("front", partial(study_figures.front, trials, front, names, best))
    views = views or {}
    figures = [views.get(label, DesignView()).figures for label in ("before", "after")]
    after = _design(best)
    cages = [] if after is None else cage_changes(study.space.design, after)
    changes = tables.changes(study, start, best, bool(cages))
    return page(
        "study",
        title=study.space.design.name,
        description=study.space.design.description,
        goal=" and ".join(weighed),
        headline=_headline(study, trials, best),
        unfinished=_unfinished(study, trials),
        robust=_robust(study),
        convergence=figures_of.uri("convergence"),
        parameters=[(name, label, figures_of.uri(label)) for name, label in drawn.items()],
        shown_parameters=min(len(strongest), study_figures.MOST_PANELS),
        all_parameters=study.space.size,
        front=figures_of.uri("front"),
        front_rows=[_front_row(trial, names) for trial in front[: tables.MOST_TRIALS]],
        names=names,
        sides=_sides(study, best, views),
        overlay=_overlay(study, best),
        scores=tables.scores(study, start, best),
        coarse=study.settings.coarse_first,
        conditions=tables.conditions(study, start, best or nearest(trials)),
        warnings=[
            note
            for note in (
                newer_note(trials),
                incomplete_note(best),
                condition_note(trials),
                worsened_note(best, start),
            )
            if note is not None
        ],
        no_fresh=tables.why_no_fresh(study, trials),
        rays=tables.ray_figures(*figures) if moves_rays(study) else None,
        worse=tables.worsened_figures(*figures),
        stretching=[
            (label, data_uri(stretching_colours(each.map)))
            for label, each in zip(("before", "after"), figures, strict=True)
            if each is not None
        ],
        most_stretched=f"{MOST_STRETCHED:g}",
        cages=[_cage(each) for each in cages],
        changes=changes[:FEW_CHANGES],
        more_changes=changes[FEW_CHANGES : tables.MOST_CHANGES],
        all_changes=len(changes),
        trials=tables.trials(study, trials, strongest[:MOST_COLUMNS]),
        finished=len(trials),
        tried=counted(trials),
        failures=tables.failures(trials),
        settings=tables.settings(study),
        live=live,
        data=as_json(
            {
                **page_data(study, known, strongest, pictures or {}, named),
                "figures": {name: each.places for name, each in figures_of.found.items()},
                "live": live,
            }
        ),
        script=script("study.js"),
    )


class _Figures:
    """Figures of a page with positions of trials.

    Attributes:
        found: figures by name.
    """

    def __init__(self, known: set[int]) -> None:
        """Store `known`, the numbers of the trials on the page."""
        self.found: dict[str, TrialFigure] = {}
        self._known = known

    def draw(self, name: str, make: Callable[..., Figure | None]) -> bool:
        """Draw a figure, and return whether there was something to draw."""
        marks = Marks()
        figure = make(marks=marks)
        if figure is not None:
            self.found[name] = TrialFigure.of(figure, marks, self._known)
        return figure is not None

    def uri(self, name: str) -> str:
        """Return the picture of a figure; empty if it was not drawn."""
        return self.found[name].uri if name in self.found else ""


def moves_rays(study: Study) -> bool:
    """Return whether a parameter of a study may change the paths of chief rays."""
    return study.space.reshapes or any(
        name.startswith(("camera.", "materials.", "parts.")) for name in study.space.names
    )


def _best_by(trials: Sequence[Trial], name: str) -> Trial | None:
    fine = [
        trial
        for trial in trials
        if trial.is_feasible and math.isfinite(trial.scores.get(name, math.nan))
    ]
    return max(fine, key=lambda trial: trial.scores[name], default=None)


def _headline(study: Study, trials: Sequence[Trial], best: Trial | None) -> list[tuple[str, str]]:
    settings = study.settings
    facts = [("method", settings.method), ("objectives", ", ".join(settings.names))]
    count = sum(not trial.is_start for trial in trials)
    facts.append(("trials", f"{count:,} of {study.budget:,}"))
    facts += [(kind, counted(members)) for kind, members in incomplete(trials).items()]
    broken = [each for each in trials if math.isfinite(each.score) and not each.is_feasible]
    if broken:
        facts.append(("break a condition", counted(broken)))
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
    return "This search was interrupted: it can be resumed." if ended == "interrupted" else ""


def _robust(study: Study) -> str:
    settings = study.settings
    if settings.errors is None:
        return ""
    paths = ", ".join(
        f"{path} {shown_size(path, size)}" for path, (_, size) in settings.errors.items()
    )
    return (
        f"Scores are what nine of ten manufactured sensors reach (P10 over {settings.samples} of "
        f"them), with manufacturing errors: {paths}."
    )


def _front_row(trial: Trial, names: Sequence[str]) -> list[str]:
    return [str(trial.number), *(tables.number(trial.scores[name]) for name in names)]


def _sides(
    study: Study, best: Trial | None, views: Mapping[str, DesignView]
) -> list[dict[str, Any]]:
    """Return the views before and after: the picture with its balls, the section with rays."""
    found = []
    for label in ("before", "after"):
        design = _design(best) if label == "after" else study.space.design
        if design is None:
            continue
        is_start = label == "before" or best is None or best.is_start
        seen = views.get(label, DesignView())
        rays = seen.rays.in_section(along_rows(design)) if seen.rays is not None else ()
        found.append(
            {
                "label": label,
                "what": "the start" if is_start or best is None else f"trial {best.number}",
                "failure": seen.failure or "",
                "section": Markup(section_svg(design, rays)),
                **_picture(seen),
            }
        )
    return found


def _picture(seen: DesignView) -> dict[str, Any]:
    """Return the picture, the marks over it, and a sentence about it."""
    if seen.picture is None:
        return {"picture": "", "marks": "", "caption": ""}
    height, width = seen.picture.shape[:2]
    balls = ""
    if seen.pressed is not None:
        radius, depth = seen.pressed
        balls = f"balls of radius {radius:g} mm, pressed in {depth:g} mm and outlined"
    return {
        "picture": data_uri(seen.picture),
        "marks": marks_svg(seen.balls, width, height),
        "caption": f"The picture shows {len(seen.balls)} {balls}. {count_in_words(seen.balls)}"
        if seen.balls
        else "",
    }


def _cage(change: CageChange) -> dict[str, Any]:
    rows = change.rows()
    return {
        "name": change.name,
        "summary": change.summary(),
        "figure": figure_uri(cage_figure(change)),
        "heads": ["point", "before, mm", "x", "y", "z", "length, mm"],
        "rows": rows[:FEW_CHANGES],
        "more": rows[FEW_CHANGES:],
    }


def _overlay(study: Study, best: Trial | None) -> str:
    """Return both outlines in one drawing, if a shape or a position has changed."""
    after = _design(best)
    if best is None or best.is_start or after is None:
        return ""
    moved = study.space.reshapes or any(
        name.startswith(("lights.", "camera."))
        and not name.endswith((".colour", ".flux", ".model"))
        for name in study.space.names
    )
    return figure_uri(study_figures.sections(study.space.design, after)) if moved else ""


def _design(trial: Trial | None) -> SensorDesign | None:
    if trial is None:
        return None
    try:
        return trial.design
    except OptiSenseError:
        return None
