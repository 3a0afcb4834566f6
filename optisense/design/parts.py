"""The parts of a sensor: a mesh, what it is for, and what it is made of."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from optisense.design.fields import Model, Name, RelativePath


class Role(StrEnum):
    """What a part is for."""

    SENSING_SURFACE = "sensing_surface"
    """The inside of the opaque coating; an open surface whose normals look into the sensor."""
    ELASTOMER = "elastomer"
    """A closed, soft, transparent solid."""
    SUPPORT = "support"
    """A closed, rigid, transparent solid."""
    MIRROR = "mirror"
    """A reflecting surface or solid."""
    BLOCKER = "blocker"
    """An opaque surface or solid that stops light."""
    INTERFACE = "interface"
    """A refracting sheet."""
    INDENTER = "indenter"
    """An object that touches the sensor."""


TRANSPARENT_SOLIDS = frozenset({Role.ELASTOMER, Role.SUPPORT})
"""Roles whose meshes must be closed, since light is refracted into and out of them."""


class Part(Model):
    """A solid or a surface of the sensor.

    Which roles take which kind of material: elastomer, support and interface a dielectric;
    mirror a conductor or a diffuse one; blocker any opaque one (none absorbs everything);
    sensing_surface none, as it wears the design's coating.
    """

    role: Role = Field(description="; ".join(role.value for role in Role))
    mesh: RelativePath = Field(description="in mm, inside this folder")
    material: Name | None = Field(default=None, description="one of the materials above")
    priority: Annotated[int, Field(strict=True, ge=-1000, le=1000)] = Field(
        default=0, description="where solids overlap, the higher one counts"
    )
