"""Scoring a sensor by several objectives; an error in one does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from optisense.design import SensorDesign
from optisense.design.sensor_design import refuse_no_design
from optisense.errors import ObjectiveError
from optisense.keyword_types import as_type
from optisense.near import suggestion
from optisense.objectives.combined import resolve
from optisense.objectives.evaluation import Evaluation, ProgressCallback
from optisense.objectives.registry import Objective, pixels_read
from optisense.objectives.score import Score
from optisense.objectives.scoring import run_objective
from optisense.objectives.settings import Settings

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

IMAGES_SHARE = 0.8
"""Share of the images in the time of scoring; the rest is that of the objectives themselves."""


class Scoring:
    """Scoring of a model, objective by objective, with the progress of all.

    Iteration runs the objectives and yields their scores, so that those before an interruption are
    known.

    Attributes:
        evaluation: images and rays that the objectives share.
    """

    def __init__(
        self,
        model: OpticalModel,
        objectives: Sequence[Objective],
        settings: Mapping[str, Any],
        progress: Callable[[float, str, str], None],
    ) -> None:
        """Store the arguments.

        Args:
            settings: fields of `Settings`, and keyword arguments of the objectives.
            progress: function that is called with the finished fraction (0 to 1), the title of the
                objective, and the step of its images, which is empty between them.

        Raises:
            ObjectiveError: a setting is unknown or invalid.
        """
        shared, self._own = split_settings(settings, objectives)
        reads = pixels_read(objectives, self._own)
        self.evaluation = Evaluation(model, Settings(**shared), self._show_images, reads)
        self._objectives = objectives
        self._progress = progress
        self._images_share = 0.0 if all(each.rays_only for each in objectives) else IMAGES_SHARE
        self._images = 0.0
        self._finished = 0
        self._title = ""

    def __iter__(self) -> Iterator[Score]:
        for each in self._objectives:
            self._title = each.title
            self._show()
            score = run_objective(each, self.evaluation, self._own[each.name])
            self._finished += 1
            self._show()
            yield score

    def _show_images(self, fraction: float, step: str) -> None:
        self._images = max(self._images, min(fraction, 1.0))
        self._show(step)

    def _show(self, step: str = "") -> None:
        share = self._images_share
        done = share * self._images + (1.0 - share) * self._finished / len(self._objectives)
        self._progress(done, self._title, step)


@overload
def evaluate(
    sensor: OpticalModel | SensorDesign | Evaluation,
    objectives: str | Objective,
    *,
    progress: ProgressCallback | None = None,
    **settings: Any,
) -> Score: ...


@overload
def evaluate(
    sensor: OpticalModel | SensorDesign | Evaluation,
    objectives: Iterable[str | Objective],
    *,
    progress: ProgressCallback | None = None,
    **settings: Any,
) -> dict[str, Score]: ...


def evaluate(
    sensor: OpticalModel | SensorDesign | Evaluation,
    objectives: str | Objective | Iterable[str | Objective],
    *,
    progress: ProgressCallback | None = None,
    **settings: Any,
) -> Score | dict[str, Score]:
    """Score a sensor.

    Several objectives share images and rays. An objective that fails gives a score with its
    `failure` set and does not affect the others.

    Args:
        sensor: a model, a design, or an `Evaluation`, whose images and rays are reused.
        objectives: one name or several; a user's own objective as "file.py:function".
        progress: function that is called while images are rendered.
        settings: fields of `Settings`, and keyword arguments of the objectives.

    Returns:
        The score, or scores by name if several objectives were given.

    Raises:
        ObjectiveError: an objective is unknown, or a setting is unknown or invalid.
        SetupError: the renderer can't run on this machine.
        OptiSenseError: the design can't be built.
    """
    wanted = resolve(objectives)
    shared, own = split_settings(settings, wanted)
    if isinstance(sensor, Evaluation):
        if shared:
            raise ObjectiveError(
                "the images and rays of an existing evaluation have their settings already: "
                + ", ".join(shared),
                hint="Create a new evaluation with these settings",
            )
        evaluation = sensor
    else:
        reads = pixels_read(wanted, own)
        evaluation = Evaluation(_model(sensor), replace(Settings(), **shared), progress, reads)
    scores = {each.name: run_objective(each, evaluation, own[each.name]) for each in wanted}
    if isinstance(objectives, str | Objective):
        return scores[wanted[0].name]
    return scores


def split_settings(
    settings: Mapping[str, Any], objectives: Iterable[Objective]
) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Divide settings into those of images and rays, and those of each objective, by objective.

    Raises:
        ObjectiveError: a setting is unknown (the message names a near match), or has another type
            than its default.
    """
    known = {field.name for field in fields(Settings)}
    wanted = list(objectives)
    shared = {key: value for key, value in settings.items() if key in known}
    own = {
        each.name: {key: value for key, value in settings.items() if key in each.settings}
        for each in wanted
    }
    taken = known.union(*(each.settings for each in wanted))
    for key in settings:
        if key not in taken:
            hint = suggestion(key, taken, limit=30)
            raise ObjectiveError(f"there is no setting '{key}'", hint=hint)
    for each in wanted:
        for key, value in own[each.name].items():
            try:
                own[each.name][key] = as_type(value, (type(each.settings[key]),))
            except ValueError as needed:
                raise ObjectiveError(
                    f"the setting '{key}' is {value!r}", hint=f"Give {needed}"
                ) from None
    return shared, own


def _model(sensor: OpticalModel | SensorDesign) -> OpticalModel:
    if isinstance(sensor, str | Path):
        refuse_no_design(sensor)
    if isinstance(sensor, SensorDesign):
        from optisense.optics import OpticalModel

        return OpticalModel(sensor)
    return sensor
