"""What an experiment is, and running one: units to numbers, picture and text."""

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
from optisense.objectives.score import json_ready
from optisense.search.study.settings import package_versions
from optisense.writing import write_json, write_text, written_whole
from paper.bench import Bench
from paper.claims import Claim, Table
from paper.errors import ExperimentError
from paper.text import PICTURE, RESULT, TEXT, chapter
from paper.unit import Record, Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 80
"""Resolution of the experiments' figures, which keeps each below 100 kB."""

Values = dict[str, Any]
Pictures = dict[str, NDArray[np.uint8]]


@dataclass(frozen=True)
class Finding:
    """What an experiment's steps end with.

    Attributes:
        numbers: ready for JSON; all that text and curves are made of.
        pictures: (h, w, 3) uint8 by name, to be drawn.
    """

    numbers: Values
    pictures: Pictures = field(default_factory=dict)


Steps = Generator[list[Unit], list[Record], Finding]
"""Asks batches of units and is sent their records; later batches may rest on earlier records."""


@dataclass(frozen=True)
class Experiment:
    """A table or figure of the OptiSense paper, made again.

    Attributes:
        name: as on the command line.
        title: of its chapter on the page.
        about: one line.
        steps: asks units, given the settings.
        claims: what the paper says, held against the numbers.
        tables: the numbers for people.
        draw: the picture, of the numbers and the pictures.
        notes: what the reader must know, given the numbers; Markdown paragraphs.
        again: whether its statements are those of other experiments, so that the page does not
            count them a second time.
    """

    name: str
    title: str
    about: str
    steps: Callable[[Values], Steps]
    claims: Callable[[Values], list[Claim]]
    tables: Callable[[Values], list[Table]]
    draw: Callable[[Values, Pictures], Figure]
    notes: Callable[[Values], list[str]] = lambda numbers: []
    again: bool = False

    def settings(self, quick: bool = False, seeds: int | None = None) -> Values:
        """Those of its YAML file; a quick run changes some, and the user the number of seeds.

        Raises:
            ExperimentError: less than one seed.
        """
        file = files("paper") / f"{self.name.replace('-', '_')}.yaml"
        stored = yaml.safe_load(file.read_text(encoding="utf-8"))
        chosen: Values = {**stored["full"], **(stored["quick"] if quick else {})}
        if seeds is not None:
            if seeds < 1:
                raise ExperimentError(f"{seeds} seeds are none", hint="Give 1 or more")
            chosen["seeds"] = seeds
        return chosen


def prepare(
    experiments: Sequence[Experiment], bench: Bench, quick: bool = False, seeds: int | None = None
) -> None:
    """Work out what several experiments ask first, all in one go.

    Running each of them then finds its answers kept. Processes start once, and units of one sensor
    share its scene and light, whichever experiment asks for them.

    Raises:
        OptiSenseError: a unit can't be worked out, or its answer not kept.
    """
    bench.run(
        [unit for each in experiments for unit in next(each.steps(each.settings(quick, seeds)))]
    )


def run(
    experiment: Experiment, bench: Bench, quick: bool = False, seeds: int | None = None
) -> Values:
    """Run an experiment and write its folder; returns the content of its result.json.

    Raises:
        OptiSenseError: it can't be run, or its results not written.
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
    """The units without a result, and units of several scores that miss one, with reasons."""
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
    """result.json, picture.png and text.md.

    Raises:
        OutputError: they can't be written.
    """
    with written_whole(folder / PICTURE, "a picture") as temporary:
        experiment.draw(dict(result["numbers"]), pictures).savefig(temporary, dpi=DOTS_PER_INCH)
    write_text(folder / TEXT, chapter(experiment, result, PICTURE))
    write_json(folder / RESULT, result)
