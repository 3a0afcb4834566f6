"""Whether one sensor reads better than another, on things that no score has seen.

Both are calibrated with balls, as users calibrate real ones, and then touch the same objects at the
same places. What comes back of normals and depth decides; see docs/verify.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optisense.errors import TaskError
from optisense.geometry.objects import OBJECTS
from optisense.near import suggestion
from optisense.objectives.score import json_ready
from optisense.tasks.calibration import CalibratedSensor, ReconstructionSettings
from optisense.tasks.draws import PLACES_SEEN
from optisense.tasks.paired_bootstrap import (
    BETTER,
    LEAST_OBJECTS,
    UNKNOWN,
    WORSE,
    ErrorChange,
    error_change,
)
from optisense.tasks.press_readings import (
    PressPictures,
    PressReading,
    flat_errors,
    read_press,
    whole_errors,
)
from optisense.tasks.unseen_presses import UnseenPress, choose_presses

if TYPE_CHECKING:
    from optisense.geometry import Contact
    from optisense.optics import OpticalModel

FloatArray = NDArray[np.float64]

NEAR = 2.0
"""Pixels of both cameras, side by side, within which a place of the skin counts as seen by one that
has a pixel there; between neighbouring pixels lies one."""

BEFORE, AFTER = "before", "after"
"""The two sensors, in this order."""


@dataclass(frozen=True)
class VerificationSettings:
    """Settings of a verification: the presses and the readers.

    Attributes:
        objects: keys of `optisense.geometry.objects.OBJECTS`.
        places: presses of each object.
        readers: that are fitted to each sensor's ball presses; errors are means over them.
        reading: how a reader is calibrated.
    """

    objects: tuple[str, ...] = tuple(OBJECTS)
    places: int = 3
    readers: int = 3
    reading: ReconstructionSettings = field(default_factory=ReconstructionSettings)

    def __post_init__(self) -> None:
        for name in self.objects:
            if name not in OBJECTS:
                raise TaskError(
                    f"there is no object '{name}'",
                    hint=suggestion(name, OBJECTS) or "Known: " + ", ".join(OBJECTS),
                )
        if not self.objects or len(set(self.objects)) < len(self.objects):
            raise TaskError("an object is named twice, or none is", hint="Name each object once")
        if self.places < 1 or self.readers < 1:
            raise TaskError(
                f"{self.places} places and {self.readers} readers make no sense",
                hint="Give at least one of each",
            )


@dataclass(frozen=True)
class SensorView:
    """Measures of a camera's view of the untouched skin.

    Attributes:
        coverage: share of the skin's area.
        detail: mm, the longer side of what a pixel of the camera shows of the skin, its median.
        stretching: how much longer than wide that is, its median.
    """

    coverage: float
    detail: float
    stretching: float


@dataclass(frozen=True)
class Verification:
    """Errors of two sensors that read the same objects.

    Arrays are (objects, places, readers), of errors over the whole contact: what a camera does not
    see of it, while the other does, counts as read flat.

    Attributes:
        names: of the two sensors.
        settings: of both.
        scale: factor on the real sizes of the objects.
        same_places: whether both were pressed at the same places; else they have other skins.
        normals: degrees, of each sensor. depths: mm.
        flat: errors of reading nothing: degrees and mm, means over all presses.
        views: of each sensor.
        pictures: of the first place of each object, of each sensor.
        contacts: of each object, in the first sensor.
    """

    names: tuple[str, str]
    settings: VerificationSettings
    scale: float
    same_places: bool
    normals: tuple[FloatArray, FloatArray]
    depths: tuple[FloatArray, FloatArray]
    flat: tuple[float, float]
    views: tuple[SensorView, SensorView]
    pictures: dict[str, tuple[PressPictures, PressPictures]]
    contacts: dict[str, list[Contact]]

    @property
    def normal_change(self) -> ErrorChange:
        """Degrees."""
        return error_change(*self.normals, seed=self.settings.reading.seed)

    @property
    def depth_change(self) -> ErrorChange:
        """mm."""
        return error_change(*self.depths, seed=self.settings.reading.seed)

    @property
    def verdict(self) -> str:
        """BETTER, WORSE or UNKNOWN: what normals tell, unless depth tells the opposite.

        Normals are what a camera-based sensor reads; depth is integrated from them.
        """
        normals, depth = self.normal_change.verdict, self.depth_change.verdict
        return UNKNOWN if {normals, depth} == {BETTER, WORSE} else normals

    def in_words(self) -> str:
        """The verdict as a sentence with its numbers."""
        normals, depth = self.normal_change, self.depth_change
        second = self.names[1]
        numbers = (
            f"normals off by {normals.after:.1f} degrees instead of {normals.before:.1f} (95 % "
            f"interval of the change {normals.low:+.1f} to {normals.high:+.1f})"
        )
        if self.verdict != UNKNOWN:
            beside = {
                UNKNOWN: "no telling difference in depth",
                self.verdict: f"depth off by {depth.after:.3f} mm instead of {depth.before:.3f}",
            }[depth.verdict]
            return f"{second} reads {self.verdict}: {numbers}, {beside}"
        if normals.verdict != UNKNOWN:
            return (
                f"Whether {second} reads better cannot be told: {numbers}, but depth off by "
                f"{depth.after:.3f} mm instead of {depth.before:.3f}"
            )
        return f"Whether {second} reads better cannot be told: {numbers}"

    def notes(self) -> list[str]:
        """Remarks on the procedure for the user, as sentences without a full stop."""
        found = []
        if self.scale < 1.0:
            found.append(
                f"the objects are larger than the skin and were scaled to {100 * self.scale:.0f} %"
            )
        if not self.same_places:
            found.append(
                "the sensors have other skins, so each was pressed at places of its own and what "
                "its camera does not see does not count"
            )
        count = len(self.settings.objects)
        if count < LEAST_OBJECTS:
            found.append(
                f"{count} objects are too few to tell a difference; {LEAST_OBJECTS} will do"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """All errors and settings, ready for JSON."""
        objects = {}
        for row, name in enumerate(self.settings.objects):
            objects[name] = {
                "places": [list(each.point or ()) for each in self.contacts[name]],
                "depth": self.contacts[name][0].depth,
                **{
                    f"{what}_{label}": errors[row].mean(axis=1).tolist()
                    for what, pair in (("normals", self.normals), ("depth", self.depths))
                    for label, errors in zip((BEFORE, AFTER), pair, strict=True)
                },
            }
        return {
            "verdict": self.verdict,
            "in_words": self.in_words(),
            BEFORE: {"name": self.names[0], **asdict(self.views[0])},
            AFTER: {"name": self.names[1], **asdict(self.views[1])},
            "normals": self.normal_change.to_dict(),
            "depth": self.depth_change.to_dict(),
            "reading_nothing": {"normals": self.flat[0], "depth": self.flat[1]},
            "units": {"normals": "degrees", "depth": "mm", "detail": "mm"},
            "scale_of_objects": self.scale,
            "same_places": self.same_places,
            "notes": self.notes(),
            "objects": objects,
            "settings": json_ready(asdict(self.settings)),
        }


def verify(
    models: tuple[OpticalModel, OpticalModel],
    settings: VerificationSettings | None = None,
    names: tuple[str, str] = (BEFORE, AFTER),
    progress: Callable[[int, int, int], None] | None = None,
) -> Verification:
    """Press the same objects into two sensors and compare what is read of them.

    Args:
        models: the sensors. settings: the defaults when None. names: to call the sensors by.
        progress: called with the sensor (0 or 1), how many of its pictures are taken, and of how
            many.

    Raises:
        TaskError: a camera sees nothing, an object fits nowhere, or a sensor can't be calibrated.
    """
    settings = settings or VerificationSettings()
    for name, model in zip(names, models, strict=True):
        if not model.chief_rays(PLACES_SEEN).hit.any():
            raise TaskError(
                f"the camera of {name} sees nothing of the sensing surface",
                hint="Check the camera's position, direction and field of view",
            )
    chosen = choose_presses(models, settings.objects, settings.places, settings.reading.seed)
    readings: list[list[PressReading]] = []
    views = []
    reach = 0.0
    trees = []
    for number, model in enumerate(models):
        told = _told(progress, number, settings.reading.presses + len(chosen.presses))
        sensor = CalibratedSensor(model, settings.reading, told, settings.readers)
        areas = _areas(model, sensor)
        readings.append(_read_all(sensor, areas, chosen.presses, number, settings, told))
        views.append(_view(model, areas, sensor))
        trees.append(cKDTree(sensor.untouched.points[areas > 0.0]))
        reach += NEAR * float(np.sqrt(np.median(areas[areas > 0.0])))
    pairs = list(zip(*readings, strict=True))
    shape = len(settings.objects), settings.places, settings.readers
    # On skins of their own, no place of one is a place of the other.
    reach = reach if chosen.same_places else np.inf
    found = [whole_errors(pair, trees, reach) for pair in pairs]
    normals, depths = (
        tuple(np.array([each[what][side] for each in found]).reshape(shape) for side in (0, 1))
        for what in (0, 1)
    )
    flats = np.array([flat_errors(max(pair, key=lambda each: each.areas.sum())) for pair in pairs])
    step = settings.places
    return Verification(
        names=names,
        settings=settings,
        scale=chosen.scale,
        same_places=chosen.same_places,
        normals=(normals[0], normals[1]),
        depths=(depths[0], depths[1]),
        flat=(float(flats[:, 0].mean()), float(flats[:, 1].mean())),
        views=(views[0], views[1]),
        pictures={
            name: (pairs[step * row][0].pictures, pairs[step * row][1].pictures)
            for row, name in enumerate(settings.objects)
        },
        contacts={
            name: [press.contacts[0] for press in chosen.presses[step * row : step * (row + 1)]]
            for row, name in enumerate(settings.objects)
        },
    )


def _told(
    progress: Callable[[int, int, int], None] | None, sensor: int, count: int
) -> Callable[[int], None]:
    return lambda done: None if progress is None else progress(sensor, done, count)


def _areas(model: OpticalModel, sensor: CalibratedSensor) -> FloatArray:
    """(h, w) mm^2 of skin behind each pixel of a sensor's pictures."""
    from optisense.optics.transport.chief_rays import pixel_areas

    rays = model.chief_rays(sensor.resolution)
    return np.where(sensor.untouched.seen, pixel_areas(rays), 0.0)


def _view(model: OpticalModel, areas: FloatArray, sensor: CalibratedSensor) -> SensorView:
    from optisense.optics.transport.chief_rays import pixel_stretching

    stretching = pixel_stretching(model.chief_rays(sensor.resolution))
    known = np.isfinite(stretching) & (areas > 0.0)
    # A pixel of the camera is smaller than one of these pictures.
    smaller = sensor.resolution[0] / model.design.camera.resolution[0]
    longer = smaller * np.sqrt(areas[known] * stretching[known])
    return SensorView(
        coverage=float(areas.sum() / model.sensing.area),
        detail=float(np.median(longer)),
        stretching=float(np.median(stretching[known])),
    )


def _read_all(
    sensor: CalibratedSensor,
    areas: FloatArray,
    presses: Sequence[UnseenPress],
    side: int,
    settings: VerificationSettings,
    told: Callable[[int], None],
) -> list[PressReading]:
    """What a sensor reads of all presses; pictures of the first place of each object."""
    found = []
    for number, press in enumerate(presses):
        told(settings.reading.presses + number)
        keeps = number % settings.places == 0
        found.append(
            read_press(sensor, areas, press.contacts[side], number, settings.readers, keeps)
        )
    told(settings.reading.presses + len(presses))
    return found
