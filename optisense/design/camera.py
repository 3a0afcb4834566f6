"""The camera of a design: its pose, its lens, and how it turns light into a picture."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from optisense.design.fields import (
    Colour,
    Count,
    Direction,
    InconsistentValueError,
    Model,
    Name,
    Number,
    PositiveRGB,
    Vector,
)
from optisense.design.kinds import KindModel
from optisense.design.lenses import LensBlur, LensDistortion, LensShading
from optisense.design.responses import (
    USUAL_RESPONSE,
    BlackLevel,
    CameraResponse,
    PictureChain,
    SensorNoise,
    ToneCurve,
)
from optisense.design.responses.chain import SoftFocus
from optisense.design.responses.electronics import ChannelMatrix

Pixels = Annotated[Count, Field(le=65_536)]

SAME_SHAPE = 0.01
"""Largest difference between the height of a picture and that of the camera's aspect ratio, as a
share of it, up to which both have the same shape: 1280x960 is that of a camera of 3280x2464."""


class ImagingModel(Model):
    """Effects of lens, sensor and processor on a picture; None stands for an ideal one.

    Designs and entries of the library share these fields. The order of the chain is that of
    `design.responses.chain`.
    """

    distortion: LensDistortion | None = Field(
        default=None, description="distortion of the lens; fov is that of the lens without it"
    )
    shading: LensShading | None = Field(
        default=None, description="dimming of the picture towards its corners"
    )
    blur: LensBlur | None = Field(default=None, description="blur of the lens")
    crosstalk: ChannelMatrix | None = Field(
        default=None, description="rows: shares of R, G, B of the light in R, G, B of the sensor"
    )
    stray_light: Colour | None = Field(
        default=None,
        description="uniform light on the whole sensor, such as ambient light that leaks in: R, G, "
        "B, shares of a full pixel",
    )
    response: CameraResponse | None = Field(
        default=None, description="conversion of light into the picture; the usual one if left out"
    )
    noise: SensorNoise | None = Field(default=None, description="noise of the sensor")
    black_level: BlackLevel | None = Field(
        default=None, description="level that the sensor reads in the dark"
    )
    white_balance: PositiveRGB | None = Field(default=None, description="gains of R, G, B")
    colour_matrix: ChannelMatrix | None = Field(
        default=None, description="rows: shares of R, G, B of the sensor in R, G, B of the picture"
    )
    tone_curve: ToneCurve | None = Field(
        default=None, description="curve of the stored levels, instead of the response's own"
    )

    def kinds_of_imaging(self) -> dict[str, KindModel]:
        """Return the components that have kinds and are present, by field."""
        given = ((name, getattr(self, name)) for name in ImagingModel.model_fields)
        return {name: value for name, value in given if isinstance(value, KindModel)}

    @property
    def is_ideal(self) -> bool:
        """True if nothing but the default response makes its pictures."""
        return all(getattr(self, name) is None for name in ImagingModel.model_fields)

    @model_serializer(mode="wrap")
    def _without_the_usual(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave ideal and default components out of the file."""
        values: dict[str, Any] = handler(self)
        for name in ImagingModel.model_fields:
            if values.get(name) is None:
                values.pop(name, None)
        return values


def check_projection(projection: str, fov: float, distortion: LensDistortion | None) -> None:
    """Refuse a field of view and a distortion that do not suit the projection of a lens.

    Raises:
        InconsistentValueError: a perspective lens sees 180 degrees (`fov`) or more, or the
            distortion is for another projection.
    """
    if projection == "perspective" and fov >= 180.0:
        raise InconsistentValueError(
            "a perspective camera sees less than 180 degrees", ("fov",), "Use equidistant"
        )
    if distortion is not None and distortion.projection != projection:
        raise InconsistentValueError(
            f"a lens distortion of kind '{distortion.kind}' is for {distortion.projection} lenses, "
            f"but this lens is {projection}",
            ("distortion", "kind"),
            f"Use 'projection: {distortion.projection}', or another kind of distortion",
        )


class Viewpoint(Model):
    """Position and orientation of a camera, and the size of its picture."""

    model: Name = Field(description="library camera it started from")
    projection: Literal["perspective", "equidistant"] = Field(
        default="perspective", description="perspective; equidistant (fisheye)"
    )
    fov: Annotated[Number, Field(gt=0.0, le=360.0)] = Field(
        description="degrees, across the image width"
    )
    resolution: tuple[Pixels, Pixels] = Field(description="pixels, width and height")
    position: Vector = Field(description="mm, entrance pupil, x y z")
    direction: Direction = Field(description="viewing direction, any length")
    up: Direction = Field(description="upward in the picture, any length")


class Camera(ImagingModel, Viewpoint):
    """Camera with a pose. Image right is direction x up: pictures are never mirrored."""

    @property
    def any_response(self) -> CameraResponse:
        """Response of the camera; the default one if it names none."""
        return USUAL_RESPONSE if self.response is None else self.response

    def view(self) -> dict[str, Any]:
        """Return the numbers that determine its rays, as plain values."""
        return self.model_dump(include={*Viewpoint.model_fields, "distortion"} - {"model"})

    @property
    def angle_scale(self) -> float:
        """Scale in the middle of the picture, in widths of the picture per radian."""
        half = np.radians(0.5 * self.fov)
        return float(0.5 / (half if self.projection == "equidistant" else np.tan(half)))

    def picture_chain(self, vergences: NDArray[np.floating] | None = None) -> PictureChain:
        """Return the chain that turns radiance into the camera's picture.

        Args:
            vergences: inverses (h, w, 2) of the scene's apparent distances in the two principal
                planes over the camera's own picture, of any size, 1/mm. If they are None, a blur
                that depends on depth is left out.
        """
        focus = None
        if self.blur is not None and (vergences is not None or not self.blur.by_depth):
            focus = SoftFocus.of(self.blur, self, vergences)
        return PictureChain(
            response=self.any_response,
            shading=self.shading,
            focus=focus,
            crosstalk=self.crosstalk,
            stray_light=self.stray_light,
            noise=self.noise,
            black_level=self.black_level,
            white_balance=self.white_balance,
            colour_matrix=self.colour_matrix,
            tone_curve=self.tone_curve,
            film=self.resolution[1] / self.resolution[0],
        )

    @model_validator(mode="after")
    def _check_consistent(self) -> Camera:
        check_projection(self.projection, self.fov, self.distortion)
        direction, up = np.array(self.direction), np.array(self.up)
        across = np.linalg.norm(np.cross(direction, up))
        if across < 1e-6 * np.linalg.norm(direction) * np.linalg.norm(up):
            raise ValueError("direction and up are parallel; up must point to the picture's top")
        return self

    def size_at(self, width: int, shape: tuple[int, int] | None = None) -> tuple[int, int]:
        """Return a width and the height, pixels, of a picture of the camera's aspect ratio.

        Args:
            shape: width and height of a picture whose aspect ratio is taken instead.
        """
        across, down = self.resolution if shape is None else shape
        return width, max(1, round(width * down / across))

    def shape_notes(self, *resolutions: tuple[int, int] | None) -> list[str]:
        """Return a note for each resolution whose aspect ratio is not the camera's.

        The field of view is that along the width, so that such a picture shows less or more along
        the height.

        Args:
            resolutions: (width, height), pixels; None is the camera's own. One given twice has one
                note.
        """
        across, down = self.resolution
        notes = []
        for width, height in dict.fromkeys(each for each in resolutions if each is not None):
            off = height - width * down / across
            if abs(off) <= max(1.0, SAME_SHAPE * height):
                continue
            same = self.size_at(max(1, round(math.sqrt(width * height * across / down))))
            what = "shows more above and below than" if off > 0 else "cuts off top and bottom of"
            notes.append(
                f"a picture of {width}x{height} {what} the camera's picture, which is "
                f"{across}x{down}: use {same[0]}x{same[1]}"
            )
        return notes

    def axes(self) -> NDArray[np.float64]:
        """Return orthonormal rows (3, 3): image right, image up, viewing direction."""
        forward = np.array(self.direction) / np.linalg.norm(self.direction)
        right = np.cross(forward, np.array(self.up))
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(right, forward), forward])
