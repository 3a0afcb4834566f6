"""Paths for more than one value: a whole group of lights moved, a part from the library.

They look like other paths but lead to no single number of a design:

| path | what it does |
|---|---|
| `lights.GROUP.shift.x` | moves all lights of a group along x, y or z, mm |
| `lights.GROUP.turn.x` | turns a group about an axis through its middle, degrees |
| `camera.turn.x` | turns the camera about its own right (x), up (y) or viewing axis (z), degrees |
| `parts.PART.shift.x` | moves a part, mm |
| `parts.PART.turn.x` | turns a part about an axis through the middle of its box, degrees |
| `lights.model` | the type of all lights |
| `lights.GROUP.model` | the type of the lights of a group |
| `lights.GROUP.lights[0].model` | the type of one light |
| `coating.library`, `camera.model` | a whole coating or camera of the library |
| `parts.PART.material` | a material of the design or of the library |
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense import library
from optisense.design import SensorDesign
from optisense.design.near import suggestion
from optisense.errors import DesignError, SearchError
from optisense.geometry import TriangleMesh

FloatArray = NDArray[np.float64]

LONGEST_NAME = 64


@dataclass(frozen=True)
class Handle(ABC):
    """Something that one parameter changes in a design.

    Attributes:
        path: what the user calls it.
        stage: handles of a lower stage act first: whole parts (0), then single numbers, then
            moves (2), and last what changes the list of light groups (3).
        numeric: whether it takes numbers, else names.
        shapes: whether it moves surfaces.
    """

    path: str
    stage: ClassVar[int] = 0
    numeric: ClassVar[bool] = False
    shapes: ClassVar[bool] = False

    @abstractmethod
    def start(self, design: SensorDesign) -> float | str | None:
        """What it is in a design: 0 for moves, else a name."""

    @abstractmethod
    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """A changed design; only the rest is shared with the given one.

        Raises:
            OptiSenseError: the value does not fit.
        """


@dataclass(frozen=True)
class _Move(Handle):
    """A number of mm or degrees along one axis; 0 leaves all as it is."""

    name: str
    axis: int
    stage: ClassVar[int] = 2
    numeric: ClassVar[bool] = True

    def start(self, design: SensorDesign) -> float:
        return 0.0


class GroupShift(_Move):
    """Moves all lights of a group along an axis of the design."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        return _with_poses(design, self.name, np.eye(3), _along(self.axis, value))


class GroupTurn(_Move):
    """Turns all lights of a group about an axis of the design through their middle."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        lights = design.lights[self.name].lights
        middle = np.mean([light.position for light in lights], axis=0)
        turn = rotation(_along(self.axis, 1.0), value)
        return _with_poses(design, self.name, turn, middle - turn @ middle)


class CameraTurn(_Move):
    """Turns the camera about one of its own axes: right, up, viewing direction."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        turn = rotation(design.camera.axes()[self.axis], value)
        camera = design.camera.model_copy(
            update={
                "direction": _triple(turn @ np.array(design.camera.direction)),
                "up": _triple(turn @ np.array(design.camera.up)),
            }
        )
        return design.model_copy(update={"camera": camera})


class PartShift(_Move):
    """Moves a part along an axis of the design."""

    shapes: ClassVar[bool] = True

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        return _with_mesh(design, self.name, np.eye(3), _along(self.axis, value))


class PartTurn(_Move):
    """Turns a part about an axis of the design through the middle of its box."""

    shapes: ClassVar[bool] = True

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        middle = design.meshes[self.name].bounds.mean(axis=0)
        turn = rotation(_along(self.axis, 1.0), value)
        return _with_mesh(design, self.name, turn, middle - turn @ middle)


class LibraryCoating(Handle):
    """The whole coating, from the library."""

    def start(self, design: SensorDesign) -> str | None:
        return design.coating.library

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        if value == design.coating.library:
            return design
        return design.model_copy(update={"coating": library.coating(str(value))})


class LibraryCamera(Handle):
    """Projection, field of view and resolution of a camera of the library; the pose stays."""

    def start(self, design: SensorDesign) -> str:
        return design.camera.model

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        if value == design.camera.model:
            return design
        known = library.camera(str(value))
        optics = {"projection": known.projection, "fov": known.fov, "resolution": known.resolution}
        camera = design.camera.model_copy(update={"model": str(value), **optics})
        return design.model_copy(update={"camera": camera})


@dataclass(frozen=True)
class PartMaterial(Handle):
    """What a part is made of; a material of the library joins the design's own."""

    name: str

    def start(self, design: SensorDesign) -> str | None:
        return design.parts[self.name].material

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        materials = design.materials
        if value not in materials:
            materials = {**materials, str(value): library.material(str(value))}
        part = design.parts[self.name].model_copy(update={"material": str(value)})
        parts = {**design.parts, self.name: part}
        return design.model_copy(update={"parts": parts, "materials": materials})


@dataclass(frozen=True)
class GroupType(Handle):
    """The type of the lights of one group, or of all groups; their flux stays."""

    group: str | None

    def start(self, design: SensorDesign) -> str | None:
        models = {design.lights[name].model for name in self._groups(design)}
        return models.pop() if len(models) == 1 else None

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        lights = dict(design.lights)
        for name in self._groups(design):
            if lights[name].model != value:
                library.light(str(value))
                change = {"model": str(value), "emitter": None}
                lights[name] = lights[name].model_copy(update=change)
        return design.model_copy(update={"lights": lights})

    def _groups(self, design: SensorDesign) -> list[str]:
        return list(design.lights) if self.group is None else [self.group]


@dataclass(frozen=True)
class LightType(Handle):
    """The type of one light: lights of another type than their group's form a group beside it."""

    group: str
    index: int
    stage: ClassVar[int] = 3

    def start(self, design: SensorDesign) -> str:
        return design.lights[self.group].model

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        return with_light_types(design, {(self.group, self.index): str(value)})


def with_light_types(design: SensorDesign, types: dict[tuple[str, int], str]) -> SensorDesign:
    """A design in which some lights, by group and index, are of other types.

    Raises:
        LibraryError: the library has no such light; names the near match.
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
                change |= {"model": model, "emitter": None}
            kept = name if model == wanted[0] else _free_name(f"{name}-{model}", design, groups)
            groups[kept] = group.model_copy(update=change)
    return design.model_copy(update={"lights": groups})


def find_handles(design: SensorDesign, path: str) -> list[Handle]:
    """The handles that a path names: none for an ordinary path, three for a whole vector.

    Raises:
        SearchError, DesignError: it looks like a handle but names nothing in the design.
    """
    move = re.fullmatch(
        r"(?:(lights|parts)\.([^.\[\]]+)|(camera))\.(shift|turn)(?:\.([^.]+))?", path
    )
    if move is not None:
        section, name, camera, what, letter = move.groups()
        return _moves(design, path, section or camera, name or "", what, letter)
    if path == "coating.library":
        return [LibraryCoating(path)]
    if path == "camera.model":
        return [LibraryCamera(path)]
    if path == "lights.model":
        return [GroupType(path, None)]
    part = re.fullmatch(r"parts\.([^.\[\]]+)\.material", path)
    if part is not None and part[1] in design.parts:
        return [PartMaterial(path, part[1])]
    group = re.fullmatch(r"lights\.([^.\[\]]+)\.model", path)
    if group is not None and group[1] in design.lights:
        return [GroupType(path, group[1])]
    light = re.fullmatch(r"lights\.([^.\[\]]+)\.lights\[(\d+)\]\.model", path)
    if light is not None and light[1] in design.lights:
        count = len(design.lights[light[1]].lights)
        if int(light[2]) >= count:
            raise DesignError(
                f"'{path}' leads nowhere: the group has {count} lights",
                hint=f"Indices run from 0 to {count - 1}",
            )
        return [LightType(path, light[1], int(light[2]))]
    return []


def rotation(axis: FloatArray, degrees: float) -> FloatArray:
    """(3, 3): the right-handed turn about an axis (Rodrigues' formula)."""
    x, y, z = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def _moves(
    design: SensorDesign, path: str, section: str, name: str, what: str, letter: str | None
) -> list[Handle]:
    if section == "camera" and what == "shift":
        raise SearchError("the camera has a position to move", where=path, hint="camera.position.x")
    known: set[str] = {"lights": set(design.lights), "parts": set(design.parts)}.get(section, set())
    if section != "camera" and name not in known:
        raise DesignError(
            f"'{path}' leads nowhere: '{section}' has no '{name}'",
            hint=suggestion(name, known, limit=20),
        )
    if letter is not None and letter not in ("x", "y", "z"):
        raise DesignError(f"'{path}' leads nowhere: there is no axis '{letter}'", hint="x, y or z")
    if section == "parts":
        for cage_name, cage in design.cages.items():
            if name in cage.parts:
                raise SearchError(
                    f"part '{name}' is moved by the cage '{cage_name}'",
                    where=path,
                    hint=f"Vary cages.{cage_name}.points",
                )
    kind: Callable[[str, str, int], Handle] = {
        ("lights", "shift"): GroupShift,
        ("lights", "turn"): GroupTurn,
        ("camera", "turn"): CameraTurn,
        ("parts", "shift"): PartShift,
        ("parts", "turn"): PartTurn,
    }[section, what]
    if letter is not None:
        return [kind(path, name, "xyz".index(letter))]
    return [kind(f"{path}.{each}", name, axis) for axis, each in enumerate("xyz")]


def _with_poses(
    design: SensorDesign, group: str, turn: FloatArray, shift: FloatArray
) -> SensorDesign:
    moved = [
        light.model_copy(
            update={
                "position": _triple(turn @ np.array(light.position) + shift),
                "direction": _triple(turn @ np.array(light.direction)),
                "up": None if light.up is None else _triple(turn @ np.array(light.up)),
            }
        )
        for light in design.lights[group].lights
    ]
    changed = design.lights[group].model_copy(update={"lights": moved})
    return design.model_copy(update={"lights": {**design.lights, group: changed}})


def _with_mesh(
    design: SensorDesign, part: str, turn: FloatArray, shift: FloatArray
) -> SensorDesign:
    mesh: TriangleMesh = design.meshes[part]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, shift
    moved = design.copy()
    moved.meshes[part] = mesh.transformed(matrix)
    return moved


def _free_name(wanted: str, design: SensorDesign, taken: dict[str, Any]) -> str:
    name = wanted[:LONGEST_NAME]
    number = 2
    while name in design.lights or name in taken:
        tail = f"-{number}"
        name = wanted[: LONGEST_NAME - len(tail)] + tail
        number += 1
    return name


def _along(axis: int, length: float) -> FloatArray:
    vector = np.zeros(3)
    vector[axis] = length
    return vector


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
