"""Design variables: parameters that change more of a design than single numbers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from optisense import library
from optisense.design import SensorDesign
from optisense.design.camera import ImagingModel
from optisense.design.lights import of_model

LONGEST_NAME = 64
"""Largest number of letters of the name of a light group that is made for lights of another type; a
longer one does not fit into tables.
"""


@dataclass(frozen=True)
class DesignVariable(ABC):
    """Base class of changes of a design by one parameter.

    Attributes:
        path: path by which the user names it.
        stage: order of application; variables of a lower stage act first: whole parts (0), then
            single numbers, then moves (2), and last changes of the list of light groups (3).
        numeric: whether its values are numbers; else they are names.
        shapes: whether it moves surfaces.
    """

    path: str
    stage: ClassVar[int] = 0
    numeric: ClassVar[bool] = False
    shapes: ClassVar[bool] = False

    @property
    def paths(self) -> list[str]:
        """Paths of all that it changes."""
        return [self.path]

    @property
    def values(self) -> list[str]:
        """Paths of the values or sections of a design that it changes."""
        return self.paths

    @abstractmethod
    def start(self, design: SensorDesign) -> float | str | None:
        """Return the value in a design: 0 for moves, else a name."""

    @abstractmethod
    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return a changed design, which shares everything else with the given one; OptiSenseError
        if the value does not fit, such as a name that is not in the library.
        """


class LibraryCoating(DesignVariable):
    """Replacement of the whole coating by one of the library."""

    def start(self, design: SensorDesign) -> str | None:
        """Return the name of the coating in the library, or None for one of the design's own."""
        return design.coating.library

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the coating of the library that `value` names."""
        if value == design.coating.library:
            return design
        return design.model_copy(update={"coating": library.coating(str(value))})


class LibraryCamera(DesignVariable):
    """Projection, field of view and aspect ratio of a camera of the library; the pose and the width
    of the picture stay.

    If the design's camera has a lens, a sensor or a processor that is not ideal, these are replaced
    by those of the library's camera.
    """

    def start(self, design: SensorDesign) -> str:
        """Return the name of the camera's model."""
        return design.camera.model

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the camera of the library that `value` names, in the same pose."""
        if value == design.camera.model:
            return design
        known = library.camera(str(value))
        size = known.size_at(design.camera.resolution[0])
        optics = {"projection": known.projection, "fov": known.fov, "resolution": size}
        camera = design.camera.model_copy(update={"model": str(value), **optics})
        if not design.camera.is_ideal:
            imaging = {field: getattr(known, field) for field in ImagingModel.model_fields}
            camera = camera.model_copy(update=imaging)
        return design.model_copy(update={"camera": camera})


@dataclass(frozen=True)
class PartMaterial(DesignVariable):
    """Material of a part; a material of the library is added to the design's own."""

    name: str

    def start(self, design: SensorDesign) -> str | None:
        """Return the name of the part's material, or None if it has none."""
        return design.parts[self.name].material

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the part of the material that `value` names."""
        materials = design.materials
        if value not in materials:
            materials = {**materials, str(value): library.material(str(value))}
        part = design.parts[self.name].model_copy(update={"material": str(value)})
        parts = {**design.parts, self.name: part}
        return design.model_copy(update={"parts": parts, "materials": materials})


@dataclass(frozen=True)
class GroupType(DesignVariable):
    """Type of the lights of one group, or of all groups; their flux stays."""

    group: str | None

    def start(self, design: SensorDesign) -> str | None:
        """Return the model of the groups' lights, or None if the groups have different ones."""
        models = {design.lights[name].model for name in self._groups(design)}
        return models.pop() if len(models) == 1 else None

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with lights of the model that `value` names."""
        lights = dict(design.lights)
        for name in self._groups(design):
            if lights[name].model != value:
                library.light(str(value))
                lights[name] = lights[name].model_copy(update=of_model(str(value)))
        return design.model_copy(update={"lights": lights})

    def _groups(self, design: SensorDesign) -> list[str]:
        return list(design.lights) if self.group is None else [self.group]


@dataclass(frozen=True)
class LightType(DesignVariable):
    """Type of one light. Lights of another type than their group's form a new group beside it."""

    group: str
    index: int
    stage: ClassVar[int] = 3

    def start(self, design: SensorDesign) -> str:
        """Return the model of the light's group."""
        return design.lights[self.group].model

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with this light of the model that `value` names."""
        return with_light_types(design, {(self.group, self.index): str(value)})


def with_light_types(design: SensorDesign, types: dict[tuple[str, int], str]) -> SensorDesign:
    """Return a design in which some lights, by group and index, are of other
    types of the library.
    """
    groups = {}
    for name, group in design.lights.items():
        wanted = [types.get((name, index), group.model) for index in range(len(group.lights))]
        if all(model == group.model for model in wanted):
            groups[name] = group
            continue
        for model in dict.fromkeys(wanted):
            chosen = [g for g, w in zip(group.lights, wanted, strict=True) if w == model]
            change: dict[str, Any] = {"lights": chosen}
            if model != group.model:
                library.light(model)
                change |= of_model(model)
            kept = name if model == wanted[0] else _free_name(f"{name}-{model}", design, groups)
            groups[kept] = group.model_copy(update=change)
    return design.model_copy(update={"lights": groups})


def _free_name(wanted: str, design: SensorDesign, taken: dict[str, Any]) -> str:
    name = wanted[:LONGEST_NAME]
    number = 2
    while name in design.lights or name in taken:
        tail = f"-{number}"
        name = wanted[: LONGEST_NAME - len(tail)] + tail
        number += 1
    return name
