"""Experiments that reproduce the tables and figures of the OptiSense paper, each by one command.

An experiment consists of units (single evaluations, each kept in a file of its own). It computes
numbers from their results and compares them with the paper's statements. The settings of each
experiment are in a YAML file beside its module.
"""

from __future__ import annotations

from optisense.near import suggestion
from paper import (
    gelbelt_lights,
    gelsight360,
    mini_shapes,
    readings,
    robustness,
    speed,
    svelte_mirror,
    tasks,
)
from paper.bench import Bench
from paper.claims import Claim, Table
from paper.experiment import Experiment, Finding, prepare, run
from paper.text import write_page
from paper.unit import ExperimentError, Found, Record, Unit

__all__ = [
    "EXPERIMENTS",
    "Bench",
    "Claim",
    "Experiment",
    "Finding",
    "Found",
    "Record",
    "Table",
    "Unit",
    "find",
    "prepare",
    "run",
    "write_page",
]

EXPERIMENTS: dict[str, Experiment] = {
    module.EXPERIMENT.name: module.EXPERIMENT
    for module in (
        mini_shapes,
        gelbelt_lights,
        gelsight360,
        svelte_mirror,
        tasks,
        speed,
        robustness,
        readings,
    )
}
"""Experiments by name, in the order of the page."""

ALL = "all"
"""Name on the command line that stands for every experiment."""


def find(name: str) -> list[Experiment]:
    """Return the experiment of a name, or all experiments.

    Raises:
        ExperimentError: no experiment has this name; the hint suggests the most similar one.
    """
    if name == ALL:
        return list(EXPERIMENTS.values())
    if name not in EXPERIMENTS:
        raise ExperimentError(
            f"there is no experiment '{name}'", hint=suggestion(name, [*EXPERIMENTS, ALL], limit=20)
        )
    return [EXPERIMENTS[name]]
