"""The experiments by name."""

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
from paper.experiment import Experiment
from paper.unit import ExperimentError

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
