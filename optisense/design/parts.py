"""Parts of a sensor: a mesh, its role, and its material."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field, model_validator

from optisense.design.fields import (
    DEGREES,
    MILLIMETRES,
    Direction,
    Fraction,
    InconsistentValueError,
    Model,
    Name,
    Number,
    Positive,
    RelativePath,
    Vector,
    is_left_out,
)


class Role(StrEnum):
    """Function of a part in the sensor."""

    SENSING_SURFACE = "sensing_surface"
    """Inside of the opaque coating; an open surface whose normals point into the sensor."""
    ELASTOMER = "elastomer"
    """Closed, soft, transparent solid."""
    SUPPORT = "support"
    """Closed, rigid, transparent solid."""
    MIRROR = "mirror"
    """Reflecting surface or solid."""
    BLOCKER = "blocker"
    """Opaque surface or solid that stops light."""
    INTERFACE = "interface"
    """Refracting sheet."""
    INDENTER = "indenter"
    """Object that touches the sensor."""


TRANSPARENT_SOLIDS = frozenset({Role.ELASTOMER, Role.SUPPORT})
"""Roles whose meshes must be closed, since light is refracted into and out of them."""


class FaceFinish(Model):
    """Finish of some faces of a transparent solid.

    The faces are those of the mesh at rest that point along `direction` and lie within `box`; one
    of the two suffices.
    """

    direction: Direction | None = Field(
        default=None, description="direction of the faces' normals, to `within` degrees"
    )
    within: Annotated[Number, Field(gt=0.0, le=180.0)] = Field(
        default=30.0,
        description="largest angle between direction and normal",
        json_schema_extra=DEGREES,
    )
    box: tuple[Vector, Vector] | None = Field(
        default=None, description="mm, two corners of a box that the faces lie in, at rest"
    )
    roughness: Fraction | None = Field(
        default=None, description="GGX alpha in place of the material's: ground, frosted or cut"
    )
    paint: Name | None = Field(
        default=None, description="an opaque material above, instead of roughness"
    )

    @model_validator(mode="after")
    def _check_faces(self) -> FaceFinish:
        if self.direction is None and self.box is None:
            raise InconsistentValueError(
                "the finish does not say which faces it covers",
                (),
                "Give 'direction', 'box' or both",
            )
        if (self.roughness is None) == (self.paint is None):
            raise InconsistentValueError(
                "faces have either a roughness or a paint", (), "Give one of the two"
            )
        if self.box is not None and any(a > b for a, b in zip(*self.box, strict=True)):
            raise InconsistentValueError(
                "the first corner of the box must be the lower one", ("box",), "Swap the corners"
            )
        return self


class Part(Model):
    """Solid or surface of the sensor.

    The kinds of material by role: elastomer, support and interface take a dielectric; mirror a
    conductor or a diffuse one; blocker any opaque one (none absorbs everything); sensing_surface
    none, as it has the design's coating.

    A mirror, blocker or interface may be an open sheet. Light meets it as it is drawn; `thickness`
    is for manufacturing: the material lies behind the face, opposite to its normals.
    """

    role: Role = Field(description="; ".join(role.value for role in Role))
    mesh: RelativePath = Field(description="in mm, inside this folder")
    material: Name | None = Field(default=None, description="one of the materials above")
    priority: Annotated[int, Field(strict=True, ge=-1000, le=1000)] = Field(
        default=0, description="where solids overlap, the higher one counts"
    )
    thickness: Positive | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="mm that a sheet is made with, behind the face that is drawn",
        json_schema_extra=MILLIMETRES,
    )
    faces: dict[Name, FaceFinish] | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="frosted or painted faces of an elastomer or support, by name",
    )
