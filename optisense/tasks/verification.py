"""Verification that one sensor reads better than another, on objects that no score uses.

Both sensors are calibrated with balls, like real ones, and then touch the same objects at the same
places. The errors of the normals and depth that they read are compared; see docs/verify.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from optisense.array_types import FloatArray
from optisense.errors import TaskError
from optisense.geometry.objects import OBJECTS
from optisense.json_values import json_ready
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays
from optisense.mechanics.skins import CONFORMING
from optisense.near import suggestion
from optisense.tasks._calibration import CalibratedSensor, ReconstructionSettings
from optisense.tasks._draws import rays_of_places
from optisense.tasks._unseen_presses import UnseenPress, choose_presses
from optisense.tasks.paired_errors import (
    BETTER,
    INCONCLUSIVE,
    LEAST_OBJECTS,
    WORSE,
    ErrorChange,
    error_change,
)
from optisense.tasks.press_readings import (
    PressPictures,
    PressReading,
    check_seen,
    flat_errors,
    read_press,
    whole_errors,
)

if TYPE_CHECKING:
    from optisense.geometry import Contact
    from optisense.optics import OpticalModel

NEAR = 2.0
"""Largest distance of a place of the skin from the nearest point that a camera sees at which the
place counts as seen, in units of the sum of both cameras' median pixel sizes on the skin;
neighbouring pixels of one camera are one pixel size apart."""

BEFORE, AFTER = "before", "after"
"""Default names of the two sensors, in this order."""


@dataclass(frozen=True)
class VerificationSettings:
    """Settings of a verification: the presses and the readers.

    Attributes:
        objects: keys of `optisense.geometry.objects.OBJECTS`.
        places: number of presses of each object.
        readers: number of readers fitted to each sensor's ball presses; errors are means over them.
        reading: settings of the calibration of a reader.
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
                f"{self.places} places and {self.readers} readers are impossible",
                hint="Give at least one of each",
            )


LARGEST_AREA_A_BALL = 20.0
"""Largest area of skin (mm^2) for each calibrating ball with which an inconclusive verdict needs no
remark: with 110 mm^2, networks have errors that are a tenth larger than with 20."""


@dataclass(frozen=True)
class SensorView:
    """Measures of a camera's view of the untouched skin.

    Attributes:
        coverage: share of the skin's area in view.
        area: area of the skin in view, mm^2.
        detail: median length (mm) of the longer side of a pixel's footprint on the skin.
        stretching: median ratio of length to width of a pixel's footprint.
    """

    coverage: float
    area: float
    detail: float
    stretching: float


@dataclass(frozen=True, eq=False)
class Verification:
    """Errors of two sensors that read the same objects.

    Errors are means over the whole contact; parts that only the other camera sees count as read
    flat.

    Attributes:
        names: names of the two sensors.
        settings: settings of the calibration and the presses of both.
        scale: factor on the real sizes of the objects.
        same_places: whether both were pressed at the same places; otherwise their skins differ.
        normals: (objects, places, readers) errors of the normals of each sensor, degrees.
        depths: (objects, places, readers) errors of the depth of each sensor, mm.
        flat: mean errors (degrees and mm) of a reader that always reads a flat surface.
        views: measures of the view of each sensor.
        pictures: pictures of each sensor at the first place of each object.
        contacts: contacts of each object with the first sensor.
        shape_notes: notes on pictures of another shape than the cameras', as of `Camera`.
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
    shape_notes: tuple[str, ...] = ()

    @property
    def normal_change(self) -> ErrorChange:
        """Change of the error of the normals, degrees."""
        return error_change(*self.normals)

    @property
    def depth_change(self) -> ErrorChange:
        """Change of the error of the depth, mm."""
        return error_change(*self.depths)

    @property
    def verdict(self) -> str:
        """The verdict: BETTER, WORSE or INCONCLUSIVE.

        It is that of the normals, unless depth has the opposite one. A camera-based sensor measures
        normals directly; depth is integrated from them.
        """
        normals, depth = self.normal_change.verdict, self.depth_change.verdict
        return INCONCLUSIVE if {normals, depth} == {BETTER, WORSE} else normals

    def in_words(self) -> str:
        """Return the verdict as a sentence with its numbers."""
        normals, depth = self.normal_change, self.depth_change
        second = self.names[1]
        numbers = (
            f"the error of normals is {normals.after:.1f} degrees instead of "
            f"{normals.before:.1f} (95 % interval of the change {normals.interval(1)})"
        )
        if self.verdict != INCONCLUSIVE:
            beside = {
                INCONCLUSIVE: "the errors of depth do not differ measurably",
                self.verdict: f"that of depth {depth.after:.3f} mm instead of {depth.before:.3f}",
            }[depth.verdict]
            return f"{second} reads {self.verdict}: {numbers}, {beside}"
        if normals.verdict != INCONCLUSIVE:
            return (
                f"It is inconclusive whether {second} reads better: {numbers}, but that of depth "
                f"{depth.after:.3f} mm instead of {depth.before:.3f}"
            )
        return f"It is inconclusive whether {second} reads better: {numbers}"

    def notes(self) -> list[str]:
        """Remarks on the procedure for the user, as sentences without a full stop."""
        found = list(self.shape_notes)
        if self.scale < 1.0:
            found.append(
                f"the objects are larger than the skin and were scaled to {100 * self.scale:.0f} %"
            )
        if not self.same_places:
            found.append(
                "the sensing surfaces differ, so each sensor was pressed at places of its own, and "
                "what its camera does not see does not count"
            )
        count = len(self.settings.objects)
        if count < LEAST_OBJECTS:
            found.append(f"a verdict needs {LEAST_OBJECTS} or more objects, and there were {count}")
        balls = self.settings.reading.presses
        area = max(view.area for view in self.views)
        if self.verdict == INCONCLUSIVE and area > LARGEST_AREA_A_BALL * balls:
            found.append(
                f"each of the {balls} balls calibrated {area / balls:.0f} mm^2 of skin; more balls "
                f"(--presses {math.ceil(area / LARGEST_AREA_A_BALL)}) reduce the errors of both "
                "readers"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return all errors and settings, ready for JSON."""
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
    kept: KeptArrays = NOTHING_KEPT,
) -> Verification:
    """Press the same objects into two sensors and compare the errors of their readings.

    Args:
        models: the sensors.
        settings: the settings; the defaults if None.
        names: names of the sensors.
        progress: function that is called with the sensor (0 or 1), the number of its pictures
            taken, and their total number.
        kept: store of what is read from each press.

    Raises:
        TaskError: a camera sees nothing, an object has no place, or a sensor can't be calibrated.
    """
    settings = settings or VerificationSettings()
    resolution = settings.reading.resolution
    for name, model in zip(names, models, strict=True):
        if not rays_of_places(model, resolution).hit.any():
            raise TaskError(
                f"the camera of {name} sees nothing of the sensing surface",
                hint="Check the camera's position, direction and field of view",
            )
    chosen = choose_presses(
        models, settings.objects, settings.places, settings.reading.seed, resolution
    )
    _check_views(models, chosen.presses, settings.reading)
    readings: list[list[PressReading]] = []
    views = []
    reach = 0.0
    trees = []
    for number, model in enumerate(models):

        def on_press(done: int, side: int = number) -> None:
            if progress is not None:
                progress(side, done, settings.reading.presses + len(chosen.presses))

        sensor = CalibratedSensor(model, settings.reading, on_press, settings.readers, kept)
        areas = _areas(model, sensor)
        others = readings[0] if readings else None
        readings.append(
            _read_all(sensor, areas, chosen.presses, number, settings, on_press, kept, others)
        )
        views.append(_view(model, areas, sensor))
        trees.append(cKDTree(sensor.untouched.points[areas > 0.0]))
        reach += NEAR * float(np.sqrt(np.median(areas[areas > 0.0])))
    pairs = list(zip(*readings, strict=True))
    shape = len(settings.objects), settings.places, settings.readers
    # Different skins have no places in common.
    reach = reach if chosen.same_places else np.inf
    found = [whole_errors(pair, trees, reach) for pair in pairs]
    normals, depths = (
        tuple(np.array([each[what][side] for each in found]).reshape(shape) for side in (0, 1))
        for what in (0, 1)
    )
    flats = np.array([flat_errors(max(pair, key=lambda each: each.areas.sum())) for pair in pairs])
    step = settings.places
    notes = [note for each in models for note in each.design.camera.shape_notes(resolution)]
    return Verification(
        names=names,
        shape_notes=tuple(dict.fromkeys(notes)),
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


def _check_views(
    models: tuple[OpticalModel, OpticalModel],
    presses: Sequence[UnseenPress],
    reading: ReconstructionSettings,
) -> None:
    """Check by rays, before anything is rendered, that a camera sees the contact of each press, and
    raise TaskError if neither does.

    The shape of an elastic skin takes a second to solve for, so it is only used where the overlap
    of object and skin is in neither picture.
    """
    from optisense.optics.transport.chief_rays import pixel_areas

    views = []
    for model in models:
        size = reading.resolution or model.design.camera.size_at(reading.width)
        views.append((model, size, pixel_areas(model.chief_rays(size)) > 0.0))
    for press in presses:
        found = any(
            (model.chief_rays(size, [contact], skin).contact_mask & seen).any()
            for skin in dict.fromkeys((CONFORMING, reading.skin))
            for (model, size, seen), contact in zip(views, press.contacts, strict=True)
        )
        check_seen(press.name, found)


def _areas(model: OpticalModel, sensor: CalibratedSensor) -> FloatArray:
    """Return the area (h, w), mm^2, of skin that each pixel of a sensor's pictures sees."""
    from optisense.optics.transport.chief_rays import pixel_areas

    rays = model.chief_rays(sensor.resolution)
    return np.where(sensor.untouched.seen, pixel_areas(rays), 0.0)


def _view(model: OpticalModel, areas: FloatArray, sensor: CalibratedSensor) -> SensorView:
    from optisense.objectives import Evaluation
    from optisense.optics.transport.chief_rays import pixel_stretching

    stretching = pixel_stretching(model.chief_rays(sensor.resolution))
    known = np.isfinite(stretching) & (areas > 0.0)
    # The camera's pixels are smaller than those of these pictures.
    smaller = sensor.resolution[0] / model.design.camera.resolution[0]
    longer = smaller * np.sqrt(areas[known] * stretching[known])
    return SensorView(
        coverage=Evaluation(model).view.skin,
        area=float(areas.sum()),
        detail=float(np.median(longer)),
        stretching=float(np.median(stretching[known])),
    )


def _read_all(
    sensor: CalibratedSensor,
    areas: FloatArray,
    presses: Sequence[UnseenPress],
    side: int,
    settings: VerificationSettings,
    on_press: Callable[[int], None],
    kept: KeptArrays,
    others: Sequence[PressReading] | None,
) -> list[PressReading]:
    """Return a sensor's readings of all presses, with pictures at the first place of each object.
    With the readings of the other sensor, TaskError is raised if neither camera sees a contact.
    """
    found = []
    for number, press in enumerate(presses):
        on_press(settings.reading.presses + number)
        keeps = number % settings.places == 0
        found.append(read_press(sensor, areas, press.contacts[side], number, keeps, kept))
        if others is not None:
            pair = others[number], found[number]
            check_seen(press.name, any(len(each.areas) for each in pair))
    on_press(settings.reading.presses + len(presses))
    return found
