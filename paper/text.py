"""Text of an experiment, made from its recorded result, and the page of all experiments."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optisense.writing import write_text
from paper.claims import AGREES, DISAGREES, OPEN
from paper.unit import ExperimentError

if TYPE_CHECKING:
    from paper.experiment import Experiment

RESULT, PICTURE, TEXT = "result.json", "picture.png", "text.md"
"""Names of the files of an experiment in its folder."""

MOST_GAPS = 6
"""Largest number of failed evaluations that the text lists; the number of the others is stated."""


def chapter(experiment: Experiment, result: Mapping[str, Any], picture: str) -> str:
    """Return the Markdown text of one experiment.

    Args:
        experiment: the experiment.
        result: the content of its result.json.
        picture: path of the picture, relative to the text.
    """
    numbers = result["numbers"]
    parts = [f"## {experiment.title}", f"![{experiment.title}]({picture})"]
    if result["quick"]:
        parts.append("**Quick run:** fewer evaluations at lower quality, and less certain results.")
    if result["settings"].get("seeds") == 1:
        parts.append("**One seed:** the random scatter of the differences is not known.")
    parts += [_verdicts(result["claims"]), *experiment.notes(numbers)]
    parts += [table.markdown() for table in experiment.tables(numbers)]
    if result["gaps"]:
        parts.append(_gaps(result["gaps"]))
    parts.append(_how(experiment.name, result))
    return "\n\n".join(parts) + "\n"


def _verdicts(claims: list[Mapping[str, Any]]) -> str:
    """Return a table of statements, and the reasons why some do not hold, each reason once."""
    lines = ["| | statement of the paper | result | verdict |", "| --- | --- | --- | --- |"]
    reasons: dict[str, list[str]] = {}
    for number, claim in enumerate(claims, 1):
        lines.append(f"| {number} | {claim['says']} | {claim['here']} | **{claim['verdict']}** |")
        if claim["why"] and not claim["holds"]:
            reasons.setdefault(claim["why"], []).append(str(number))
    for why, numbers in reasons.items():
        which = "Statement" if len(numbers) == 1 else "Statements"
        lines += ["", f"*{which} {listed(numbers)}.* {why}"]
    return "\n".join(lines)


def listed(words: list[str]) -> str:
    """Return words as an enumeration, such as ``1, 2 and 3``."""
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def _gaps(gaps: list[Mapping[str, str]]) -> str:
    """Return the list of evaluations without a score, with the reasons."""
    lines = [f"Evaluations without a score ({len(gaps)}):", ""]
    lines += [f"- {gap['what']}: {gap['reason'].rstrip('.')}." for gap in gaps[:MOST_GAPS]]
    if len(gaps) > MOST_GAPS:
        lines.append(f"- {len(gaps) - MOST_GAPS} more, which the result file lists.")
    return "\n".join(lines)


def _how(name: str, result: Mapping[str, Any]) -> str:
    """Return the sentence that states the command, the release and the cost of a result."""
    seconds = result["seconds"]
    seeds = result["settings"].get("seeds")
    over = f", {seeds} seed{'s' if seeds > 1 else ''}" if seeds else ""
    release = result["versions"].get("optisense", "unknown")
    by = "an unrecorded release" if release == "unknown" else f"OptiSense {release}"
    return (
        f"Results of `python -m paper {name}{' --quick' if result['quick'] else ''}` with {by}: "
        f"{result['units']} evaluations{over}, {seconds['processor'] / 60:.1f} processor minutes. "
        "± is the standard deviation over seeds."
    )


def read_result(folder: Path) -> dict[str, Any]:
    """Return the recorded result of an experiment.

    Raises:
        ExperimentError: the result does not exist, or can't be read.
    """
    path = folder / RESULT
    try:
        read: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return read
    except (OSError, ValueError) as error:
        raise ExperimentError(
            f"the result can't be read: {error}", where=str(path), hint="Run the experiment again"
        ) from error


def write_page(page: Path, results: Path, experiments: list[Experiment]) -> None:
    """Write one page of all experiments, with results and pictures in a folder beside it.

    Args:
        page: path of the Markdown file; the folder has its name without the suffix.
        results: folder of all results.
        experiments: the experiments on the page, in this order.

    Raises:
        ExperimentError: an experiment has no result.
        OutputError: a file can't be written.
    """
    beside = page.with_suffix("")
    beside.mkdir(parents=True, exist_ok=True)
    chapters, rows, counts = [], [], dict.fromkeys((AGREES, DISAGREES, OPEN), 0)
    repeating = [f"*{each.title}*" for each in experiments if each.repeats_claims]
    without = f" (without {', '.join(repeating)}, which repeats statements)" if repeating else ""
    spent: dict[str, list[float]] = {}
    quick: list[str] = []
    for experiment in experiments:
        result = read_result(results / experiment.name)
        name = experiment.name
        write_text(beside / f"{name}.json", (results / name / RESULT).read_text("utf-8"))
        shutil.copyfile(results / name / PICTURE, beside / f"{name}.png")
        chapters.append(chapter(experiment, result, f"{beside.name}/{name}.png"))
        spent |= result["spent"]
        quick += [f"*{experiment.title}*"] if result["quick"] else []
        verdicts = [claim["verdict"] for claim in result["claims"]]
        for verdict in () if experiment.repeats_claims else verdicts:
            counts[verdict] += 1
        counts_text = ", ".join(_counted(verdicts.count(v), v) for v in counts if v in verdicts)
        rows.append(f"| [{experiment.title}](#{_anchor(experiment.title)}) | {counts_text} |")
    # Wall times are not reported, as they depend on what else the machine did.
    processor = sum(seconds for _, seconds, _ in spent.values())
    head = [
        "# The paper's tables and figures",
        "The command `python -m paper all --page FILE` writes this page; do not edit it.",
        INTRODUCTION,
        "\n".join(["| experiment | statements of the paper |", "| --- | --- |", *rows]),
        f"In total{without}: "
        f"{', '.join(_counted(count, verdict) for verdict, count in counts.items())}.",
        f"The {len(spent)} evaluations take {processor / 60:.0f} processor minutes. An evaluation "
        f"that several experiments share is counted once.{_quick_runs(quick)}",
    ]
    write_text(page, "\n\n".join([*head, *(text.rstrip() for text in chapters)]) + "\n")


def _quick_runs(titles: list[str]) -> str:
    """Return a sentence on the experiments that were made with ``--quick``, if there are any."""
    if not titles:
        return ""
    are = "is a quick run" if len(titles) == 1 else "are quick runs"
    return f" {listed(titles)} {are}."


def _counted(number: int, verdict: str) -> str:
    """Return a number of verdicts as text, such as ``1 agrees`` or ``3 agree``."""
    return f"{number} {verdict if number == 1 or verdict == OPEN else verdict.removesuffix('s')}"


def _anchor(title: str) -> str:
    """Return the anchor that GitHub makes of a heading."""
    kept = "".join(c for c in title.lower() if c.isalnum() or c in " -")
    return kept.replace(" ", "-")


INTRODUCTION = """\
This page compares the statements of the OptiSense paper with experiments on models of its four
sensors. One command runs each experiment. The geometry of three of the sensors is partly
[assumed](sensors.md), and nothing was tuned towards the paper's figures. Where a statement does not
hold, the text says so and gives the likely cause. Verdicts are computed from the numbers.
*Inconclusive* means that the differences are within the random scatter of the seeds (t tests at
95 %). A statement on the best of several variants is also inconclusive if it holds for some of the
variants that do not differ significantly from the best one, and not for the others.

The experiments are a part of the source and not of the installed package. Type their commands in
the folder of the clone. Without a name, the command lists the experiments. A quick run makes fewer
evaluations at lower quality; this one takes less than half a minute:

```console
$ python -m paper
$ python -m paper svelte-mirror --quick --seeds 1 --workers 1 --out quick-results
```

All experiments in full take about an hour and a half on two processors:

```console long
$ python -m paper all --out results
```

The same command continues an interrupted run and does not repeat finished evaluations. Running all
experiments together is faster than running one after the other, because they share sensors and
light.

Each section names the release that produced its results. The results of an unrecorded release are
from 22 November 2026. They differ from those of the present release in the smoothing of the light
of metallic coatings, and in the LEDs of GelSight360, which are 0.8 mm high instead of 1 mm."""
