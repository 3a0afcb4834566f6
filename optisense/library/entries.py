"""What the library holds: a value, and where each of its numbers comes from."""

from __future__ import annotations

from typing import Annotated, Generic, Literal, TypeVar

from pydantic import Field

from optisense.design.emitters import LightModel
from optisense.design.fields import Colour, Count, Model, Number, Positive
from optisense.design.materials import Coating, Material
from optisense.design.sensor_design import Status

Value = TypeVar("Value")


class Source(Model):
    """Where one number, or several, come from."""

    status: Status
    source: Annotated[str, Field(min_length=1)]
    date: Annotated[str, Field(pattern=r"^\d{4}(-\d{2}(-\d{2})?)?$")] | None = None
    """When the source was published, or else read (year, year-month or full)."""


class Entry(Model, Generic[Value]):
    """A library entry.

    Attributes:
        description: what it is, in a line.
        value: the material, coating, light or camera.
        sources: for each field of `value` (and of `typical`), where it comes from.
    """

    description: Annotated[str, Field(min_length=1)]
    value: Value
    sources: Annotated[dict[str, Source], Field(min_length=1)]


class TypicalLight(Model):
    """What one colour of a light usually gives.

    Attributes:
        colour: R, G, B for a design's light group.
        wavelength: nm, dominant.
        flux: mW, radiant, at its usual current.
    """

    colour: Colour
    wavelength: Positive | None = None
    flux: Positive | None = None


class LightEntry(Entry[LightModel]):
    """A light with its package and its colours.

    Attributes:
        package: mm, width, length and height of its body.
        typical: its colours, by name.
    """

    package: tuple[Positive, Positive, Positive] | None = None
    typical: dict[str, TypicalLight] = Field(default_factory=dict)


class CameraModel(Model):
    """A camera module as sold.

    Attributes:
        projection: how angle turns into image height.
        fov: degrees, across the image width.
        resolution: pixels of the sensor, width and height.
        pixel_size: micrometres.
        focal_length: mm.
    """

    projection: Literal["perspective", "equidistant"] = "perspective"
    fov: Annotated[Number, Field(gt=0.0, le=360.0)]
    resolution: tuple[Count, Count]
    pixel_size: Positive | None = None
    focal_length: Positive | None = None


MaterialEntry = Entry[Material]
CoatingEntry = Entry[Coating]
CameraEntry = Entry[CameraModel]
