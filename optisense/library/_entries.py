"""Entries of the library: a value, and the source of each of its numbers."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from optisense.design.camera import ImagingModel, Pixels, check_projection
from optisense.design.colour import WAVELENGTHS
from optisense.design.emitters import LightModel
from optisense.design.fields import Colour, InconsistentValueError, Model, Name, Number, Positive
from optisense.design.materials import CoatingModel, Material
from optisense.design.sensor_design import Status
from optisense.near import suggestion

Value = TypeVar("Value", bound=Model)

LENS_MISFIT = 0.1
"""Largest relative difference between the focal length and that of the field of view. Vendors round
and lenses distort; of the Raspberry Pi cameras the worst is off by 5 %, half of this."""

PROJECTIONS: dict[str, Callable[[float], float]] = {
    "perspective": lambda half: float(np.tan(half)) if half < np.pi / 2.0 else np.inf,
    "equidistant": lambda half: half,
}
"""Ratio of image height to focal length for a ray at an angle (radians) to the axis."""

Text = Annotated[str, Field(min_length=1, max_length=2000)]

NOT_NUMBERS = frozenset({"kind", "shape", "library", "colour", "part", "maker"})
"""Fields of an entry that need no source: words, and the names of colours."""


def _date(value: Any) -> Any:
    """Return a date as text; YAML files may have a year as a number.

    Raises:
        ValueError: it is no date.
    """
    text = str(value) if type(value) is int else value
    if isinstance(text, str) and re.fullmatch(r"\d{4}(-\d{2}(-\d{2})?)?", text) is None:
        raise ValueError("should be a year, year-month or day, such as 2026-03")
    return text


class Source(Model):
    """Source of one or several numbers."""

    status: Status
    source: Text
    date: Annotated[str, BeforeValidator(_date)] | None = None
    """Date when the source was published, or else read (year, year-month or full)."""


class Entry(Model, Generic[Value]):
    """Library entry.

    Attributes:
        description: description in one line.
        maker: maker or vendor.
        value: material, coating, light or camera.
        sources: source of each field with a number; fields without one are `unsourced`.
    """

    description: Text
    maker: Text | None = None
    value: Value
    sources: dict[str, Source] = Field(default_factory=dict)

    def numbers(self) -> list[str]:
        """Return the fields that need a source."""
        given = self.value.model_dump(exclude_none=True)
        return [field for field in given if field not in NOT_NUMBERS]

    def source_names(self) -> list[str]:
        """Return the names that `sources` may have."""
        return [*type(self.value).model_fields, "maker"]

    def source(self, field: str) -> Source | None:
        """Return the source of a number of `numbers`, or None if there is none."""
        return self.sources.get(field)

    def unsourced(self) -> list[str]:
        """Return the numbers without a source."""
        return [field for field in self.numbers() if self.source(field) is None]

    @model_validator(mode="after")
    def _check_source_names(self) -> Entry[Value]:
        known = self.source_names()
        for name in self.sources:
            if name not in known:
                raise InconsistentValueError(
                    f"there is a source for '{name}', which this entry does not have",
                    ("sources", name),
                    suggestion(name, known),
                )
        return self


class TypicalLight(Model):
    """Output of one colour of a light at its nominal current.

    Attributes:
        colour: R, G, B for a design's light group, not all 0.
        part: order number at the maker.
        wavelength: dominant wavelength, nm.
        current: nominal current, mA.
        flux: radiant flux at this current, mW.
    """

    colour: Colour
    part: Text | None = None
    wavelength: Annotated[Number, Field(ge=WAVELENGTHS[0], le=WAVELENGTHS[1])] | None = None
    current: Positive | None = None
    flux: Positive | None = None

    @model_validator(mode="after")
    def _check_colour(self) -> TypicalLight:
        if max(self.colour) <= 0.0:
            raise InconsistentValueError("the light has no colour", ("colour",), "Give one above 0")
        return self


class LightEntry(Entry[LightModel]):
    """Light with its package and its colours.

    A source for `flux` refers to all colours, one for `flux.red` to one of them.

    Attributes:
        package: width, length and height of its body, mm.
        window: width and height of the opening of a light that is simulated as a point, mm.
        typical: its colours, by name.
    """

    package: tuple[Positive, Positive, Positive] | None = None
    window: tuple[Positive, Positive] | None = None
    typical: dict[Name, TypicalLight] = Field(default_factory=dict)

    def numbers(self) -> list[str]:
        """Return the fields that need a source; those of a colour as `flux.red`."""
        own = [name for name in ("package", "window") if getattr(self, name) is not None]
        colours = [
            f"{field}.{colour}"
            for colour, light in self.typical.items()
            for field in light.model_dump(exclude_none=True)
            if field not in NOT_NUMBERS
        ]
        return [*super().numbers(), *own, *colours]

    def source_names(self) -> list[str]:
        """Return the names that `sources` may have."""
        fields = [field for field in TypicalLight.model_fields if field != "colour"]
        each = [f"{field}.{colour}" for colour in self.typical for field in fields]
        return [*super().source_names(), "package", "window", *fields, *each]

    def source(self, field: str) -> Source | None:
        """Return the source of a number of `numbers`, or None if there is none."""
        return self.sources.get(field) or self.sources.get(field.split(".")[0])


class LensFacts(Model):
    """View of a camera module as sold.

    Attributes:
        projection: projection of angles to image heights.
        fov: field of view across the image width, degrees.
        resolution: pixels of the sensor, width and height.
        pixel_size: pixel size, micrometres.
        focal_length: focal length, mm.
        f_number: focal length divided by the diameter of the entrance pupil.
    """

    projection: Literal["perspective", "equidistant"] = "perspective"
    fov: Annotated[Number, Field(gt=0.0, le=360.0)]
    resolution: tuple[Pixels, Pixels]
    pixel_size: Positive | None = None
    focal_length: Positive | None = None
    f_number: Positive | None = None

    def size_at(self, width: int) -> tuple[int, int]:
        """Return a width and the height, pixels, of a picture of the sensor's aspect ratio."""
        across, down = self.resolution
        return width, max(1, round(width * down / across))

    def _misfit(self) -> tuple[str, str] | None:
        """Return the problem of a field of view that does not fit the focal length and image width,
        and its remedy.

        A perspective lens of focal length f shows 2 atan(w / 2f) across a width w, an equidistant
        one w / f. The result is None if they agree within `LENS_MISFIT`, or if the focal length or
        the pixel size is unknown.
        """
        if self.pixel_size is None or self.focal_length is None:
            return None
        known = self.focal_length
        width, height = (0.001 * self.pixel_size * pixels for pixels in self.resolution)

        def off(size: float, law: str) -> float:
            """Return the relative difference of the focal length from that of such a lens."""
            with np.errstate(over="ignore", divide="ignore"):  # infinity is a misfit, too
                focal = 0.5 * size / PROJECTIONS[law](np.radians(0.5 * self.fov))
                return float(abs(focal / known - 1.0))

        if off(width, self.projection) <= LENS_MISFIT:
            return None
        half = 0.5 * width / known
        angle = np.degrees(2.0 * (half if self.projection == "equidistant" else np.arctan(half)))
        message = (
            f"a field of view of {self.fov:g} degrees does not fit a focal length of {known:g} mm "
            f"and an image {width:.3g} mm wide ({self.resolution[0]} pixels of {self.pixel_size:g} "
            f"micrometres): as {self.projection} they give {angle:.1f} degrees"
        )
        other = "perspective" if self.projection == "equidistant" else "equidistant"
        across = "give the angle across the width"
        diagonal = off(float(np.hypot(width, height)), self.projection)
        least, reason = min(
            (diagonal, f"It fits the image's diagonal: {across}"),
            (off(height, self.projection), f"It fits the image's height: {across}"),
            (off(width, other), f"It fits another projection: give 'projection: {other}'"),
        )
        if least > LENS_MISFIT:
            reason = (
                "Correct the one that is wrong; where the lens fits no projection, leave out "
                "focal_length"
            )
        return message, reason


class CameraModel(ImagingModel, LensFacts):
    """Camera module as sold: its view, and the effects of its lens, sensor and processor.

    `imaging` has the data that a design can take over besides the view.
    """

    def imaging(self) -> dict[str, Any]:
        """Return the known fields of its `ImagingModel`: plain values, as for a design file."""
        values = self.model_dump(mode="json", include=set(ImagingModel.model_fields))
        return {name: value for name, value in values.items() if value is not None}

    @model_validator(mode="after")
    def _check_consistent(self) -> CameraModel:
        check_projection(self.projection, self.fov, self.distortion)
        misfit = self._misfit()
        if misfit is not None:
            raise InconsistentValueError(misfit[0], ("fov",), misfit[1])
        return self

    def angles(self) -> tuple[float, float, float]:
        """Return the angles seen across the image's width, its height and its diagonal, degrees."""
        width, height = self.resolution
        across = np.array([width, height, np.hypot(width, height)]) / width
        if self.projection == "equidistant":
            wide, high, diagonal = self.fov * across
        else:
            half = np.tan(np.radians(self.fov / 2.0)) * across
            wide, high, diagonal = 2.0 * np.degrees(np.arctan(half))
        return float(wide), float(high), float(diagonal)


MaterialEntry = Entry[Material]
CoatingEntry = Entry[CoatingModel]
CameraEntry = Entry[CameraModel]

AnyEntry = MaterialEntry | CoatingEntry | LightEntry | CameraEntry
