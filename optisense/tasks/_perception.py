"""Perception tasks: the accuracy with which a known angle, size or force is predicted from
pictures.

As in the OptiSense paper ("Why choosing those objective functions?"), a small set of simulated
contacts is rendered for each task, each picture is reduced to a few features, and a random forest
predicts the quantity from them. Each task module defines the contacts and the features.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from optisense.array_types import ByteArray, FloatArray
from optisense.design.difference import design_values, mesh_digests
from optisense.design.sensor_design import refuse_design
from optisense.errors import TaskError
from optisense.folders import held
from optisense.geometry import Contact
from optisense.json_values import json_ready
from optisense.mechanics import CONFORMING
from optisense.mechanics.skins import refuse_drags
from optisense.optics.estimators import RADIANCE_CACHE, current_name
from optisense.reading.camera_noise import add_camera_noise
from optisense.tasks._records import CsvTable, read_object, refuse_differences
from optisense.tasks._regression import FOLDS, ForestReading, read_by_forest
from optisense.tasks._sample_settings import SampleRendering
from optisense.tasks._snr import NEIGHBOURS, signal_to_noise
from optisense.untrusted_files import COPY_AGAIN
from optisense.writing import write_json

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

SETTINGS = "task.json"
SAMPLES = "samples.csv"

_CONTACT, _CAMERA, _SENSOR = 3, 4, 9
"""Numbers that are hashed with the seed, one for each kind of random draw, so that the draws are
independent. They are unique among the modules of this package."""


class PerceptionTask(Protocol):
    """A quantity to predict from pictures; a frozen dataclass, whose fields are its settings."""

    @property
    def name(self) -> str:
        """The task's name on the command line."""
        ...

    @property
    def unit(self) -> str:
        """The unit of the targets."""
        ...

    @property
    def targets(self) -> tuple[str, ...]:
        """Names of the quantities to predict."""
        ...

    @property
    def features(self) -> tuple[str, ...]:
        """Names of the features of a picture."""
        ...

    @property
    def width(self) -> int:
        """Width (pixels) of the pictures that the features need."""
        ...

    @property
    def contact_only(self) -> bool:
        """Whether the features depend on pixels of the contact only."""
        ...

    def check(self, model: OpticalModel) -> None:
        """Check before any work that the contacts are possible on the sensor.

        Raises:
            ContactError: a contact is not possible.
        """
        ...

    def contact(
        self, model: OpticalModel, rng: np.random.Generator
    ) -> tuple[Contact, Sequence[float]]:
        """Return a random contact and its targets."""
        ...

    def measure(self, picture: ByteArray, image: TactileImage) -> Sequence[float]:
        """Return the features of a picture (h, w, 3) that the camera stored.

        Raises:
            TaskError: the features cannot be computed, for instance as the contact is not seen.
        """
        ...


@dataclass(frozen=True)
class SampleSettings(SampleRendering):
    """Settings of the samples.

    Attributes:
        count: number of samples.
        seed: seed of all random numbers; sample i depends on it and on i only.
        camera_noise: standard deviation in levels of 255 (see `camera_noise`).
        resolution: (width, height) pixels; if None, the task's width in the camera's proportions.
        photons: number of photons of the light that all samples share.
        estimator: estimator of the light, "radiance-cache" or "sppm".
        skin: "elastic" or "conforming"; see docs/mechanics.md.
    """

    count: int = 200
    estimator: str = RADIANCE_CACHE


@dataclass(frozen=True)
class Samples:
    """The features (n, f), levels of 255 or the task's units, and targets (n, t), its unit."""

    features: FloatArray
    targets: FloatArray


@dataclass(frozen=True)
class PerceptionResult:
    """The accuracy with which a sensor measures a quantity.

    Attributes:
        task: name of the task.
        design: name of the design.
        unit: unit of the targets.
        targets: names of the targets.
        samples: the samples.
        reading: cross-validated predictions of the random forest.
        snr: the signal-to-noise ratio.
        settings: the settings of task and samples.
    """

    task: str
    design: str
    unit: str
    targets: tuple[str, ...]
    samples: Samples
    reading: ForestReading
    snr: float
    settings: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return all values except the samples, ready for JSON."""
        error = np.abs(self.reading.predictions - self.samples.targets).mean(axis=0)
        return {
            "task": self.task,
            "design": self.design,
            "unit": self.unit,
            "mean_absolute_error": self.reading.error,
            "error_of_target": dict(zip(self.targets, error.tolist(), strict=True)),
            "spread_among_folds": self.reading.spread,
            "error_of_guessing": self.reading.guess,
            "signal_to_noise": json_ready(self.snr),
            "samples": len(self.samples.targets),
            "settings": json_ready(self.settings),
        }


def perceive(
    task: PerceptionTask,
    model: OpticalModel,
    settings: SampleSettings | None = None,
    neighbours: int = NEIGHBOURS,
    folder: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> PerceptionResult:
    """Render samples of a task and compute the accuracy with which they predict its targets.

    Args:
        task: the perception task.
        model: the sensor.
        settings: settings of the samples; the defaults if None.
        neighbours: number k of neighbours of the signal-to-noise ratio.
        folder: folder that stores the samples, so that work continues; None: only in memory.
        progress: function that is called with the number of finished samples and of all.

    Raises:
        DesignError: there is a design instead of a model.
        TaskError: a contact is not seen, there are too few samples, or the folder holds samples
            with other settings.
        ContactError: a contact is not possible on the sensor.
    """
    settings = settings or SampleSettings()
    least = max(2 * FOLDS, neighbours + 1)
    if settings.count < least or neighbours < 2:
        raise TaskError(
            f"{settings.count} samples and {neighbours} neighbours are impossible",
            hint=f"Use 2 neighbours or more, and at least {least} samples",
        )
    samples = collect(task, model, settings, folder, progress)
    return PerceptionResult(
        task=task.name,
        design=model.design.name,
        unit=task.unit,
        targets=task.targets,
        samples=samples,
        reading=read_by_forest(samples.features, samples.targets, settings.seed),
        snr=signal_to_noise(samples.features, samples.targets, neighbours),
        settings=_described(task, model, settings) | {"neighbours": neighbours},
    )


def collect(
    task: PerceptionTask,
    model: OpticalModel,
    settings: SampleSettings,
    folder: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Samples:
    """Render, measure and label `settings.count` random contacts; see `perceive`."""
    refuse_design(model)
    task.check(model)
    first, _ = _contact(task, model, settings, 0)
    refuse_drags([first], settings.skin)
    names = (*task.features, *task.targets)
    with ExitStack() as kept:
        table = None
        if folder is not None:
            kept.enter_context(held(folder))
            table = _open_table(folder, task, model, settings, names)
            kept.callback(table.close)
        rows = [] if table is None else _kept_numbers(table, names)
        camera = None
        for index in range(len(rows), settings.count):
            if progress is not None:
                progress(index, settings.count)
            camera = camera or _Camera(task, model, settings)
            row = camera.sample(index)
            rows.append(row)
            if table is not None:
                table.add(dict(zip(names, row, strict=True)))
        if progress is not None:
            progress(settings.count, settings.count)
    values = np.array(rows[: settings.count], dtype=np.float64)
    split = len(task.features)
    return Samples(values[:, :split], values[:, split:])


class _Camera:
    """The camera of one task, with a fixed exposure."""

    def __init__(self, task: PerceptionTask, model: OpticalModel, settings: SampleSettings) -> None:
        self._task = task
        self._model = model
        self._settings = settings
        self._exposure = self._render([]).auto_exposure()

    def sample(self, index: int) -> list[float]:
        """Return features and targets of one contact."""
        seed = self._settings.seed
        contact, targets = _contact(self._task, self._model, self._settings, index)
        image = self._render([contact])
        picture = add_camera_noise(
            image.picture(self._exposure, (seed, index, _SENSOR)),
            self._settings.camera_noise,
            [seed, index, _CAMERA],
        )
        return [*map(float, self._task.measure(picture, image)), *map(float, targets)]

    def _render(self, contacts: Sequence[Contact]) -> TactileImage:
        return self._settings.render(
            self._model,
            contacts,
            _resolution(self._task, self._model, self._settings),
            estimator=self._settings.estimator,
            only_contacts=bool(contacts) and self._task.contact_only,
        )


def _contact(
    task: PerceptionTask, model: OpticalModel, settings: SampleSettings, index: int
) -> tuple[Contact, Sequence[float]]:
    """Return the contact of a sample, and its targets."""
    return task.contact(model, np.random.default_rng([settings.seed, index, _CONTACT]))


def _resolution(
    task: PerceptionTask, model: OpticalModel, settings: SampleSettings
) -> tuple[int, int]:
    if settings.resolution is not None:
        return settings.resolution
    return model.design.camera.size_at(task.width)


def _described(
    task: PerceptionTask, model: OpticalModel, settings: SampleSettings
) -> dict[str, Any]:
    """Return all values that determine the samples, except their number."""
    values = asdict(settings) | {"resolution": _resolution(task, model, settings)}
    del values["count"]
    return {"task": task.name, task.name: asdict(task), "samples": values}  # type: ignore[call-overload]


def _open_table(
    folder: Path,
    task: PerceptionTask,
    model: OpticalModel,
    settings: SampleSettings,
    names: Sequence[str],
) -> CsvTable:
    now = _described(task, model, settings) | {
        "design": design_values(model.design),
        "meshes": mesh_digests(model.design),
    }
    if (folder / SETTINGS).exists():
        before = read_object(folder / SETTINGS)
        kept = before.get("samples")
        if not isinstance(kept, dict):
            raise TaskError("'samples' is no object", where=str(folder / SETTINGS), hint=COPY_AGAIN)
        kept["estimator"] = current_name(kept.get("estimator"))
        kept.setdefault("skin", CONFORMING)
        refuse_differences("samples", folder, before, now)
    else:
        write_json(folder / SETTINGS, now, "the results")
    return CsvTable(folder / SAMPLES, names)


def _kept_numbers(table: CsvTable, names: Sequence[str]) -> list[list[float]]:
    """Return the values of the samples in a table."""
    found = []
    for line, row in enumerate(table.rows, start=2):
        try:
            found.append([float(row[name]) for name in names])
        except (TypeError, ValueError) as error:
            raise TaskError(
                f"a kept sample can't be read: {error}",
                where=f"{table.path}:{line}",
                hint="Delete this line and those after it; the next run makes the samples again",
            ) from error
    return found
