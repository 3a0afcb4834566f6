"""Experiments, and how they run: from units to numbers, a picture and a text."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from numpy.typing import NDArray

from optisense import __version__
from optisense.json_values import json_ready
from optisense.search.study.settings import package_versions
from optisense.writing import write_json, write_text, written_whole
from paper.bench import Bench
from paper.claims import Claim, Table
from paper.text import PICTURE, RESULT, TEXT, chapter
from paper.unit import ExperimentError, Record, Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 80
"""Resolution of the experiments' figures, dots per inch, which keeps each file below 100 kB."""

Values = dict[str, Any]
Pictures = dict[str, NDArray[np.uint8]]


@dataclass(frozen=True)
class Finding:
    """Final result of an experiment's steps.

    Attributes:
        numbers: plain values for JSON, from which texts and curves are made.
        pictures: pictures (h, w, 3) uint8 by name, which the figure shows.
    """

    numbers: Values
    pictures: Pictures = field(default_factory=dict)


Steps = Generator[list[Unit], list[Record], Finding]
"""Generator that yields batches of units and is sent their records, before its next batch."""


@dataclass(frozen=True)
class Experiment:
    """Reproduction of a table or figure of the OptiSense paper.

    Attributes:
        name: name on the command line.
        title: title of its chapter on the page.
        about: summary in one line.
        steps: returns the generator of its units, from the settings.
        claims: returns the paper's statements with verdicts, from the numbers.
        tables: returns the tables for readers, from the numbers.
        draw: returns the figure, from the numbers and the pictures.
        notes: returns remarks for readers, paragraphs of Markdown, from the numbers.
        repeats_claims: whether its claims are also those of other experiments; the page then
            counts them once.
    """

    name: str
    title: str
    about: str
    steps: Callable[[Values], Steps]
    claims: Callable[[Values], list[Claim]]
    tables: Callable[[Values], list[Table]]
    draw: Callable[[Values, Pictures], Figure]
    notes: Callable[[Values], list[str]] = lambda numbers: []
    repeats_claims: bool = False

    def settings(self, quick: bool = False, seeds: int | None = None) -> Values:
        """Return the settings of its YAML file, with those of a quick run and the number of seeds.

        Raises:
            ExperimentError: the number of seeds is below 1.
        """
        file = files("paper") / f"{self.name.replace('-', '_')}.yaml"
        stored = yaml.safe_load(file.read_text(encoding="utf-8"))
        chosen: Values = {**stored["full"], **(stored["quick"] if quick else {})}
        if seeds is not None:
            if seeds < 1:
                raise ExperimentError(f"the number of seeds is {seeds}", hint="Give 1 or more")
            chosen["seeds"] = seeds
        return chosen


def prepare(
    experiments: Sequence[Experiment], bench: Bench, quick: bool = False, seeds: int | None = None
) -> None:
    """Compute the first batches of several experiments together.

    The experiments then find these results in the folder. Processes start once, and units of the
    same sensor share its scene and light across experiments.

    Raises:
        OptiSenseError: a unit can't be computed, or its result not written.
    """
    bench.run(
        [unit for each in experiments for unit in next(each.steps(each.settings(quick, seeds)))]
    )


def run(
    experiment: Experiment, bench: Bench, quick: bool = False, seeds: int | None = None
) -> Values:
    """Run an experiment, write its folder, and return the content of its result.json.

    Raises:
        OptiSenseError: a unit can't be computed, or a result not written.
    """
    settings = experiment.settings(quick, seeds)
    began = time.perf_counter()
    records: list[Record] = []
    units: list[Unit] = []
    steps = experiment.steps(settings)
    batch = next(steps)
    while True:
        answers = bench.run(batch)
        records += answers
        units += batch
        try:
            batch = steps.send(answers)
        except StopIteration as end:
            finding: Finding = end.value
            break
    result: Values = json_ready(
        {
            "experiment": experiment.name,
            "title": experiment.title,
            "quick": quick,
            "settings": settings,
            "versions": {"optisense": __version__, **package_versions()},
            "seconds": {
                "units": round(sum(record.seconds for record in records), 1),
                "processor": round(sum(record.processor_seconds for record in records), 1),
                "this_run": round(time.perf_counter() - began, 1),
            },
            "units": len(records),
            "spent": {
                unit.key: [record.seconds, record.processor_seconds, unit.alone]
                for unit, record in zip(units, records, strict=True)
            },
            "numbers": finding.numbers,
            "claims": [claim.to_plain() for claim in experiment.claims(finding.numbers)],
            "gaps": gaps(records),
        }
    )
    write(experiment, result, finding.pictures, bench.folder / experiment.name)
    return result


def gaps(records: Sequence[Record]) -> list[dict[str, str]]:
    """Return the units without a result, or without one of several scores, with the reasons."""
    found = {}
    for record in records:
        if record.failure is not None:
            found[record.label] = record.failure
        for name, reason in record.values.get("failures", {}).items():
            found[f"{record.label}, {name}"] = reason
    return [{"what": what, "reason": reason} for what, reason in found.items()]


def write(
    experiment: Experiment, result: Mapping[str, Any], pictures: Pictures, folder: Path
) -> None:
    """Write the result (JSON), the figure (PNG) and the text (Markdown) of an experiment.

    Raises:
        OutputError: a file can't be written.
    """
    with written_whole(folder / PICTURE, "a picture") as temporary:
        experiment.draw(dict(result["numbers"]), pictures).savefig(temporary, dpi=DOTS_PER_INCH)
    write_text(folder / TEXT, chapter(experiment, result, PICTURE))
    write_json(folder / RESULT, result)
