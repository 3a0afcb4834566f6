"""Results of a search as text and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optisense.cli.console import output, print_notes, table_of
from optisense.text import argument

if TYPE_CHECKING:
    from optisense.search import SearchResult, Study, Trial

MOST_CAUSES = 4
"""Largest number of causes of failure that are printed, so that the result fits on a screen; the
report lists more.
"""

CERTAINTY = 2.0
"""Number of standard errors up to which a gain counts as noise: of designs that are no better, one
in forty exceeds it."""

MOST_VALUES = 12
"""Largest number of parameters of the best trial that are printed, so that the result fits on a
screen; all are in the study.
"""


def summary(result: SearchResult) -> dict[str, Any]:
    """Return the result, ready for JSON."""
    trials = [trial for trial in result.trials if not trial.is_start]
    best = result.study.best
    start = result.study.start
    scored = [trial for trial in trials if math.isfinite(trial.score)]
    return {
        "study": str(result.study.folder),
        "trials": len(trials),
        "failed": len(trials) - len(scored),
        "interrupted": result.interrupted,
        "ended": result.ended,
        "broken": sum(not trial.is_feasible for trial in scored),
        "notes": list(result.notes),
        "start": None if start is None else _plain(start),
        "best": None if best is None else _plain(best),
        "front": [trial.number for trial in result.front] if _several(result) else None,
    }


def _plain(trial: Trial) -> dict[str, Any]:
    from optisense.json_values import json_ready

    return {
        "number": trial.number,
        "scores": json_ready(trial.scores),
        "fresh_scores": json_ready({name: trial.fresh_score(name) for name in trial.scores}),
        "conditions": dict(trial.conditions),
        "values": trial.values,
    }


def _several(result: SearchResult) -> bool:
    return len(result.study.settings.names) > 1


def print_result(result: SearchResult, out: Path) -> None:
    """Print the best trial, the numbers beside its score, and the next commands."""
    from optisense.search.study.conditions import condition_lines
    from optisense.search.study.failures import incomplete

    study = result.study
    print_notes(result.notes)
    if not result.interrupted:
        output.print(_end(result))
    best, start = study.best, study.start
    for kind, members in incomplete(result.trials).items():
        output.print(_failures(kind, members))
    if best is None:
        _print_nearest(result.trials)
        return
    name = study.objective
    said = "best so far" if result.interrupted else "best"
    output.print(f"{said}: trial {best.number}, {name} {headline(best, start)}")
    if best.unbiased_score != best.score:
        by = "its coarse score" if study.settings.coarse_first else "the search's own seed"
        output.print(f"  {best.score:.4g} by {by}, which selected it")
    for line in [
        *_beside(study, best, start),
        *(f"  {each}" for each in condition_lines(best, start)),
    ]:
        output.print(line)
    values = list(best.values.items())
    for path, value in values[:MOST_VALUES]:
        shown = f"{value:.6g}" if isinstance(value, float) else str(value)
        output.print(f"  {path} = {shown}")
    if len(values) > MOST_VALUES:
        output.print(f"  and {len(values) - MOST_VALUES} more")
    if _several(result) and result.front:
        _print_front(result)
    if best.is_start:
        by = f" by {name}, the first objective" if _several(result) else ""
        output.print(f"no trial is better than the start{by}")
    elif not result.interrupted:
        named = argument(out)
        output.print(f"Apply it:   optisense apply {named} --trial best --out better", style="dim")
        output.print(f"Verify it:  optisense verify {named}", style="dim")


def _end(result: SearchResult) -> str:
    """Return the number of trials, of the limit of this run if they are fewer, and why the search
    has ended.
    """
    count = sum(not trial.is_start for trial in result.trials)
    of = f" of {result.limit:,}" if count < result.limit else ""
    return f"{count:,}{of} {'trial' if max(count, result.limit) == 1 else 'trials'}: {result.ended}"


def _print_nearest(trials: Sequence[Trial]) -> None:
    """Print the trial that comes nearest to the conditions, if no trial is the best."""
    from optisense.search.study.best import nearest
    from optisense.search.study.conditions import condition_lines

    close = nearest(trials)
    if close is None:
        output.print("no trial has a score yet")
        return
    output.print(f"no trial meets the conditions; nearest: trial {close.number}")
    for line in condition_lines(close, None):
        output.print(f"  {line}")


def headline(best: Trial, start: Trial | None) -> str:
    """Return the best score and the start's, by fresh seeds if they were scored."""
    text = f"{best.unbiased_score:.4g}{_spread(best)}"
    if best.unbiased_score != best.score:
        text += " with fresh seeds"
    if start is not None and math.isfinite(start.unbiased_score):
        text += f" (start {start.unbiased_score:.4g}{_spread(start)})"
        if not best.is_start and _is_noise(best, start):
            text += "; the gain is within the noise"
    return text


def _spread(trial: Trial) -> str:
    """Return the standard deviation of the score over fresh seeds; empty if it is unknown."""
    spread = trial.fresh_spread()
    return f" ± {spread:.2g}" if math.isfinite(spread) else ""


def _is_noise(best: Trial, start: Trial) -> bool:
    """Return whether the best score exceeds the start's by no more than `CERTAINTY` standard errors
    of their means over fresh seeds.
    """
    errors = [each.fresh_spread() / len(each.fresh) ** 0.5 for each in (best, start) if each.fresh]
    noise = math.hypot(*errors) if len(errors) == 2 else math.nan
    return best.unbiased_score - start.unbiased_score <= CERTAINTY * noise


def _failures(kind: str, trials: Sequence[Trial]) -> str:
    """Return the number of trials of a kind (see `incomplete`), and the most frequent causes."""
    from optisense.search.study.failures import causes_among, counted

    causes = causes_among(trials)
    lines = [f"{counted(trials)} {kind}:"]
    lines += [f"  {counted(each.trials)}: {each.text}" for each in causes[:MOST_CAUSES]]
    if len(causes) > MOST_CAUSES:
        lines.append(f"  and {len(causes) - MOST_CAUSES} more causes")
    return "\n".join(lines)


def _beside(study: Study, best: Trial, start: Trial | None) -> list[str]:
    """Return the lines beside the score: other objectives, and parts such as the coverage."""
    from optisense.search.study.study import beside

    before = {} if start is None else beside(study, start)
    return [
        f"  {name} {_number(value)}"
        + (f" (start {_number(before[name])})" if name in before else "")
        for name, value in beside(study, best).items()
    ]


def _print_front(result: SearchResult) -> None:
    """Print the Pareto front: the trials that no other one dominates."""
    names = result.study.settings.names
    table = table_of("trial", *names, texts=0)
    for trial in result.front:
        table.add_row(str(trial.number), *(f"{trial.scores[name]:.4g}" for name in names))
    output.print("Pareto front (no trial is better in all objectives):")
    output.print(table)


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "failed"
