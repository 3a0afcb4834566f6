"""Shape reconstruction: the accuracy of shapes that are reconstructed from a sensor's pictures.

The procedure is that for a real sensor: it is calibrated with balls, then other objects are pressed
in, their normals are read, and integrated to depth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design.sensor_design import refuse_design
from optisense.errors import TaskError
from optisense.geometry import Contact, Cylinder, MeshIndenter, Sphere, TriangleMesh
from optisense.json_values import json_ready
from optisense.mechanics.skins import refuse_drags
from optisense.reading.tilts import angles_between
from optisense.tasks._calibration import LEAST_PIXELS, CalibratedSensor, ReconstructionSettings

if TYPE_CHECKING:
    from optisense.optics import OpticalModel


def pyramid(slope: float = 30.0, height: float = 2.0) -> TriangleMesh:
    """Return a square pyramid (mm) that stands on its tip, with sides tilted by `slope` (degrees)
    and height `height` (mm).
    """
    half = height / np.tan(np.radians(slope))
    base = [(-half, -half, height), (half, -half, height), (half, half, height)]
    vertices = np.array([(0.0, 0.0, 0.0), *base, (-half, half, height)])
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [1, 2, 3], [1, 3, 4]])
    corners = vertices[faces].reshape(-1, 3)
    # The faces do not share vertices, so that edges stay sharp.
    flat = TriangleMesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
    return TriangleMesh(corners, flat.faces, np.repeat(flat.face_normals, 3, axis=0))


RING_SLOPE = 2.0
"""Smallest slope (degrees) of skin around a contact that counts as the ring: about the smallest
slope that a reader can detect in the camera's noise."""


def unseen_objects() -> dict[str, Contact]:
    """Return the objects reconstructed by default; none is a ball of the fit's radius."""
    return {
        "ball of 3 mm": Contact(Sphere(3.0), at=(-2.0, 1.5), depth=0.6),
        "cylinder of 2 mm": Contact(Cylinder(2.0), at=(0.0, 0.0), depth=0.5, rotation=30.0),
        "pyramid of 30 degrees": Contact(
            MeshIndenter(pyramid()), at=(2.0, -1.5), depth=0.7, rotation=20.0
        ),
    }


@dataclass(frozen=True)
class Reconstruction:
    """The true and the reconstructed shape of one object.

    Attributes:
        picture: (h, w, 3) uint8.
        normals, true_normals, untouched_normals: (h, w, 3) unit normals into the gel.
        depth, true_depth: (h, w) depth along the inward normal, mm.
        mask: (h, w) mask of the contact, where its skin is also seen untouched; errors are means
            over its pixels.
    """

    picture: NDArray[np.uint8]
    normals: FloatArray
    true_normals: FloatArray
    untouched_normals: FloatArray
    depth: FloatArray
    true_depth: FloatArray
    mask: NDArray[np.bool_]

    @cached_property
    def angles(self) -> FloatArray:
        """Angles (h, w), degrees, between read and true normals."""
        return angles_between(self.normals, self.true_normals)

    @property
    def normal_error(self) -> float:
        """Mean error of the normals over the contact, degrees."""
        return float(self.angles[self.mask].mean())

    @cached_property
    def ring(self) -> NDArray[np.bool_]:
        """Mask (h, w) of the skin around the contact that slopes by `RING_SLOPE` or more."""
        sloping = angles_between(self.untouched_normals, self.true_normals) >= RING_SLOPE
        return sloping & ~self.mask

    @property
    def depth_error(self) -> float:
        """Mean absolute error of the depth over the contact, mm."""
        return float(np.abs(self.depth - self.true_depth)[self.mask].mean())

    @property
    def ring_normal_error(self) -> float:
        """Mean error of the normals over the ring, degrees; NaN if there is no ring."""
        return _mean(self.angles, self.ring)

    @property
    def ring_depth_error(self) -> float:
        """Mean absolute error of the depth over the ring, mm; NaN if there is no ring."""
        return _mean(np.abs(self.depth - self.true_depth), self.ring)

    def to_dict(self) -> dict[str, float | None]:
        """Return the errors, and those of a reader that always reads a flat surface, ready for
        JSON; None if there is no ring.
        """
        inside = self.mask
        nothing = angles_between(self.untouched_normals, self.true_normals)
        return {
            "normal_error": self.normal_error,
            "normal_error_median": float(np.median(self.angles[inside])),
            "normal_error_of_reading_nothing": float(nothing[inside].mean()),
            "depth_error": self.depth_error,
            "depth_error_of_reading_nothing": float(self.true_depth[inside].mean()),
            "deepest": float(self.true_depth[inside].max()),
            "deepest_read": float(self.depth[inside].max()),
            "contact_pixels": int(inside.sum()),
            "ring_normal_error": json_ready(self.ring_normal_error),
            "ring_normal_error_of_reading_nothing": json_ready(_mean(nothing, self.ring)),
            "ring_depth_error": json_ready(self.ring_depth_error),
            "ring_depth_error_of_reading_nothing": json_ready(_mean(self.true_depth, self.ring)),
            "ring_pixels": int(self.ring.sum()),
        }


def _mean(values: FloatArray, where: NDArray[np.bool_]) -> float:
    """Return the mean absolute value over a mask of pixels; NaN if it is empty."""
    return float(np.abs(values[where]).mean()) if where.any() else float("nan")


def _mean_of_known(values: Iterable[float]) -> float:
    """Return the mean of the values that are not NaN; NaN if there are none."""
    known = [value for value in values if not math.isnan(value)]
    return float(np.mean(known)) if known else float("nan")


@dataclass(frozen=True)
class ReconstructionResult:
    """The accuracy of reconstructed shapes: each object, and the means over objects."""

    design: str
    objects: dict[str, Reconstruction]
    settings: ReconstructionSettings
    fitted_pixels: int

    @property
    def normal_error(self) -> float:
        """Mean error of the normals over the objects, degrees."""
        return float(np.mean([each.normal_error for each in self.objects.values()]))

    @property
    def depth_error(self) -> float:
        """Mean absolute error of the depth over the objects, mm."""
        return float(np.mean([each.depth_error for each in self.objects.values()]))

    @property
    def ring_normal_error(self) -> float:
        """Mean error of the normals over the rings of the objects, degrees; NaN if there are none,
        as with a conforming skin.
        """
        return _mean_of_known(each.ring_normal_error for each in self.objects.values())

    @property
    def ring_depth_error(self) -> float:
        """Mean absolute error of the depth over the rings of the objects, mm; NaN without any."""
        return _mean_of_known(each.ring_depth_error for each in self.objects.values())

    def to_dict(self) -> dict[str, Any]:
        """Return all errors and settings, ready for JSON."""
        return {
            "task": "reconstruction",
            "design": self.design,
            "normal_error": self.normal_error,
            "depth_error": self.depth_error,
            "ring_normal_error": json_ready(self.ring_normal_error),
            "ring_depth_error": json_ready(self.ring_depth_error),
            "units": {"normal_error": "degrees", "depth_error": "mm"},
            "objects": {name: each.to_dict() for name, each in self.objects.items()},
            "fitted_pixels": self.fitted_pixels,
            "settings": json_ready(asdict(self.settings)),
        }


def reconstruct(
    model: OpticalModel,
    settings: ReconstructionSettings | None = None,
    objects: Mapping[str, Contact] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReconstructionResult:
    """Fit a reader to ball presses and apply it to objects that it was not fitted to.

    Args:
        model: the sensor.
        settings: the settings; the defaults if None.
        objects: contacts by name; `unseen_objects` if None.
        progress: function that is called with the number of pictures taken and their total number.

    Raises:
        DesignError: there is a design instead of a model.
        ContactError: an object is off the surface or deeper than the gel, or has a shift or a
            twist on a conforming skin.
        TaskError: an object is not seen, too few presses are seen, or a setting is invalid.
    """
    refuse_design(model)
    settings = settings or ReconstructionSettings()
    wanted = unseen_objects() if objects is None else dict(objects)
    count = settings.presses + len(wanted)

    def report(done: int) -> None:
        if progress is not None:
            progress(done, count)

    refuse_drags(wanted.values(), settings.skin)
    for contact in wanted.values():
        model.place(contact)  # so that errors are reported before any work
    sensor = CalibratedSensor(model, settings, report)
    read = {}
    for number, (name, contact) in enumerate(wanted.items()):
        report(settings.presses + number)
        read[name] = reconstruct_one(sensor, contact, number, name)
    report(count)
    return ReconstructionResult(model.design.name, read, settings, sensor.fitted_pixels)


def reconstruct_one(
    sensor: CalibratedSensor, contact: Contact, number: int = 0, name: str = "the object"
) -> Reconstruction:
    """Press an object into a calibrated sensor and reconstruct it, with the noise of a picture of
    this number; TaskError is raised if the camera does not see the contact.
    """
    image, picture = sensor.take_picture(contact, number)
    # At the border of the view, a pixel may see the contact but not the untouched skin.
    mask = image.contact_mask & sensor.untouched.seen
    if mask.sum() < LEAST_PIXELS:
        raise TaskError(f"the camera does not see {name}", hint="Place it where it looks")
    normals, depth = sensor.read(picture)
    return Reconstruction(
        picture=picture,
        normals=normals,
        true_normals=image.normals.astype(np.float64),
        untouched_normals=sensor.untouched.normals,
        depth=depth,
        true_depth=sensor.untouched.image_depth(image).astype(np.float64),
        mask=mask,
    )
