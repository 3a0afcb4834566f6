"""Bodies of the user's CAD files with their uses, and which of them count as one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from optisense.design import Role
from optisense.geometry import TriangleMesh
from optisense.length_units import MM_PER, Units
from optisense.sensors.from_meshes.directions import nearest_side
from optisense.sensors.from_meshes.files import Body, joined
from optisense.sensors.from_meshes.recipe_parts import ShapeReference

Use = Role | Literal["lights", "camera", "nothing"]
"""Use of a body: a part of some role, a reference for lights or the camera, or none."""


@dataclass(frozen=True)
class CadBody:
    """Body in the user's CAD files.

    Attributes:
        name: name for a part of the design, made of the body's or file's name.
        file: path of the file from the folder of the recipe.
        body: body that was read; its mesh is in the file's own units.
        use: probable use.
        copies: further lights of its name on the same side of the gel, which count as one with it.
    """

    name: str
    file: str
    body: Body
    use: Use
    copies: tuple[Body, ...] = ()

    @property
    def solid(self) -> str | list[str] | None:
        """Name of the body in a STEP file, or names of it and its copies."""
        names = [each.name for each in (self.body, *self.copies) if each.name is not None]
        return names if self.copies else self.body.name

    @property
    def shape(self) -> ShapeReference:
        """Reference to the body in a recipe."""
        return ShapeReference(file=self.file, solid=self.solid)

    def mesh(self, units: Units | None) -> TriangleMesh:
        """Return its mesh in mm; `units` is that of files that don't state theirs (mm if None)."""
        if self.body.own_units:
            return joined((self.body, *self.copies))
        scale = MM_PER[units or "mm"]
        return self.body.mesh.with_vertices(scale * self.body.mesh.vertices)


def with_copies(found: list[CadBody]) -> list[CadBody]:
    """Return the bodies, with lights of one kind on one side of the gel taken together."""
    carrier = carrier_of({each.name: each.use for each in found})
    gel = next((each.body.mesh.bounds for each in found if each.name == carrier), np.zeros((2, 3)))
    groups: dict[tuple[object, ...], CadBody] = {}
    for each in found:
        key: tuple[object, ...] = (each.name,)
        if each.use == "lights" and each.body.kind is not None:
            side = nearest_side((gel - each.body.mesh.bounds).mean(axis=0))
            key = (each.file, each.body.kind, side)
        first = groups.setdefault(key, each)
        if first is not each:
            groups[key] = replace(first, copies=(*first.copies, each.body))
    return list(groups.values())


def carrier_of(uses: Mapping[str, Use]) -> str | None:
    """Return the name of the body that carries the coating: the first gel, else the first support,
    else the sensing surface itself; None if there is none of them.
    """
    roles = (Role.ELASTOMER, Role.SUPPORT, Role.SENSING_SURFACE)
    return next((name for role in roles for name, use in uses.items() if use is role), None)
