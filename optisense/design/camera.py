"""The camera of a design."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from optisense.design.fields import Count, Direction, Model, Name, Number, Vector
from optisense.design.responses import USUAL_RESPONSE, CameraResponse

Pixels = Annotated[Count, Field(le=65_536)]


class Camera(Model):
    """A pinhole with a pose. Image right is direction x up: pictures are never mirrored."""

    model: Name = Field(description="library camera it started from")
    projection: Literal["perspective", "equidistant"] = Field(
        default="perspective", description="perspective; equidistant (fisheye)"
    )
    fov: Annotated[Number, Field(gt=0.0, le=360.0)] = Field(
        description="degrees, across the image width"
    )
    resolution: tuple[Pixels, Pixels] = Field(description="pixels, width and height")
    position: Vector = Field(description="mm, entrance pupil, x y z")
    direction: Direction = Field(description="where it looks, any length")
    up: Direction = Field(description="upward in the picture, any length")
    response: CameraResponse | None = Field(
        default=None, description="how light becomes the picture, instead of the usual way"
    )

    @property
    def any_response(self) -> CameraResponse:
        """Its response: the usual one where it names none."""
        return USUAL_RESPONSE if self.response is None else self.response

    @model_serializer(mode="wrap")
    def _without_the_usual(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """A camera of the usual response is written as ever."""
        values: dict[str, Any] = handler(self)
        if values.get("response") is None:
            values.pop("response", None)
        return values

    @model_validator(mode="after")
    def _makes_sense(self) -> Camera:
        if self.projection == "perspective" and self.fov >= 180.0:
            raise ValueError("a perspective camera sees less than 180 degrees; use equidistant")
        direction, up = np.array(self.direction), np.array(self.up)
        across = np.linalg.norm(np.cross(direction, up))
        if across < 1e-6 * np.linalg.norm(direction) * np.linalg.norm(up):
            raise ValueError("direction and up are parallel; up must point to the picture's top")
        return self

    def axes(self) -> NDArray[np.float64]:
        """(3, 3) orthonormal rows: image right, image up, viewing direction."""
        forward = np.array(self.direction) / np.linalg.norm(self.direction)
        right = np.cross(forward, np.array(self.up))
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(right, forward), forward])
