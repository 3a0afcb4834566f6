"""Shapes and parts of a recipe: their files, placement and roles."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from optisense.design import Role
from optisense.design.fields import Model, Name, Number, Positive, Vector
from optisense.length_units import Units
from optisense.sensors.from_meshes.directions import Side, Way

Angle = Annotated[Number, Field(ge=0.0, le=180.0)]

Turn = Annotated[Number, Field(ge=-720.0, le=720.0)]
Turns = tuple[Turn, Turn, Turn]


class ShapeReference(Model):
    """Shape of a recipe: a file, or faces of another part."""

    file: str | None = Field(default=None, description="OBJ, STL, PLY or STEP file")
    solid: str | Annotated[list[str], Field(min_length=1)] | None = Field(
        default=None, description="name of the body in a STEP file, or [NAME, NAME] for several"
    )
    units: Units | None = Field(
        default=None, description="unit of this file, if not that of the others"
    )
    faces_of: Name | None = Field(default=None, description="part whose faces these are")
    towards: Way | None = Field(default=None, description="direction of the selected faces")
    within: Angle | None = Field(
        default=None, description="largest angle to that direction, degrees"
    )
    tangent: bool | None = Field(
        default=None,
        description="whether faces that continue them without a sharp edge are selected, too",
    )
    patches: Literal["largest", "all"] | None = Field(
        default=None, description="selection from several separate patches: largest; all"
    )

    mirror: Literal["x", "y", "z"] | None = Field(
        default=None, description="axis along which the shape of the file is mirrored"
    )
    turn: Turns | None = Field(
        default=None,
        description="rotations about x, then y, then z of the frame of the file, degrees",
    )
    move: Vector | None = Field(default=None, description="translation after mirror and turn, mm")

    @property
    def solids(self) -> list[str]:
        """Names of the bodies in a STEP file; empty if none is named."""
        return self.solid if isinstance(self.solid, list) else [self.solid] if self.solid else []

    @property
    def source(self) -> str:
        """The file and the bodies in it, or the faces of another part, in words."""
        faces = f"faces of {self.faces_of} towards {self.towards}"
        faces += ", and those that continue them smoothly" if self.tangent else ""
        return ", body ".join([self.file or faces, *self.solids])

    @model_validator(mode="after")
    def _one_source(self) -> ShapeReference:
        if (self.file is None) == (self.faces_of is None):
            raise ValueError("give either a file, or faces_of another part")
        if self.faces_of is not None and (self.solid is not None or self.units is not None):
            raise ValueError("solid and units are for files only, not for faces_of")
        if self.faces_of is not None:
            for name in ("mirror", "turn", "move"):
                if getattr(self, name) is not None:
                    raise ValueError(f"{name} is for files only; faces move with their part")
        if self.faces_of is not None and self.towards is None:
            raise ValueError("faces_of needs towards, the direction of the faces (+z, -x, ...)")
        for name in ("within", "tangent", "patches"):
            if getattr(self, name) is not None and self.towards is None:
                raise ValueError(f"{name} needs towards, which is missing")
        return self


class PartChoice(ShapeReference):
    """Part of the sensor in a recipe."""

    role: Role = Field(description="; ".join(role.value for role in Role))
    material: Name | None = Field(default=None, description="material of the library")
    priority: Annotated[int, Field(strict=True, ge=-1000, le=1000)] | None = Field(
        default=None, description="where solids overlap, the one with the higher priority counts"
    )
    cut_every: Positive | None = Field(
        default=None,
        description="distance of the planes along which triangles are cut, mm, so that cages can "
        "bend them; not cut if left out",
    )
    on: Name | None = Field(
        default=None, description="part on whose side this part lies with its own flat face"
    )
    side: Side | None = Field(default=None, description="side of that part; +z if left out")
    flush: list[Side] | None = Field(
        default=None,
        description="sides that are flush with those of that part; centred if left out",
    )
    gap: Number | None = Field(
        default=None, description="distance between the two, mm; 0 if left out"
    )

    @model_validator(mode="after")
    def _cuts_a_file(self) -> PartChoice:
        if self.cut_every is not None and self.faces_of is not None:
            raise ValueError("cut_every is for files only; faces have the triangles of their part")
        return self

    @model_validator(mode="after")
    def _lies_on_something(self) -> PartChoice:
        if self.on is None:
            for name in ("side", "flush", "gap"):
                if getattr(self, name) is not None:
                    raise ValueError(f"{name} needs on, which is missing")
        elif self.faces_of is not None:
            raise ValueError("on is for files only; faces lie where their part lies")
        axes = [side[-1] for side in self.flush or []]
        lies_along = (self.side or "+z")[-1]
        for axis in axes:
            if axis == lies_along:
                raise ValueError(f"flush can't name {axis}, along which the part lies on the other")
            if axes.count(axis) > 1:
                raise ValueError(f"flush names both sides along {axis}; give one of them")
        return self
