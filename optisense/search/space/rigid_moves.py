"""Design variables that shift and turn lights, parts and the camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.design.posing import moved, with_camera_turned, with_lights
from optisense.geometry import TriangleMesh
from optisense.geometry.rotations import rotation
from optisense.search.space.design_variables import DesignVariable


@dataclass(frozen=True)
class _Move(DesignVariable):
    """Move along or about one axis, mm or degrees; 0 changes nothing."""

    name: str
    axis: int
    stage: ClassVar[int] = 2
    numeric: ClassVar[bool] = True

    def start(self, design: SensorDesign) -> float:
        """Return 0, the value of every move in the starting design."""
        return 0.0


class _GroupMove(_Move):
    """Move of all lights of a group."""

    @property
    def values(self) -> list[str]:
        """Paths of the values or sections of a design that it changes."""
        return [f"lights.{self.name}.lights"]


class GroupShift(_GroupMove):
    """Shift of all lights of a group along an axis of the design."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the group shifted by `value` mm."""
        return with_lights(design, self.name, partial(moved, shift=_along(self.axis, value)))


class GroupTurn(_GroupMove):
    """Turn of all lights of a group about an axis of the design through their middle."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the group turned by `value` degrees."""
        lights = design.lights[self.name].lights
        middle = np.mean([light.position for light in lights], axis=0)
        turn = rotation(_along(self.axis, 1.0), value)
        move = partial(moved, shift=middle - turn @ middle, turn=turn)
        return with_lights(design, self.name, move)


class GroupAim(_GroupMove):
    """Turn of each light of a group about an axis of the design through its own position."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with each light of the group turned by `value` degrees."""
        for index in range(len(design.lights[self.name].lights)):
            design = LightTurn(self.path, self.name, self.axis, index).apply(design, value)
        return design


@dataclass(frozen=True)
class LightShift(_Move):
    """Shift of one light along an axis of the design."""

    index: int

    @property
    def values(self) -> list[str]:
        """Paths of the values or sections of a design that it changes."""
        return [f"lights.{self.name}.lights[{self.index}]"]

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the light shifted by `value` mm."""
        move = partial(moved, shift=_along(self.axis, value))
        return with_lights(design, self.name, move, only=self.index)


@dataclass(frozen=True)
class LightTurn(_Move):
    """Turn of one light about an axis of the design through its position."""

    index: int

    @property
    def values(self) -> list[str]:
        """Paths of the values or sections of a design that it changes."""
        return [f"lights.{self.name}.lights[{self.index}]"]

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the light turned by `value` degrees."""
        place = np.array(design.lights[self.name].lights[self.index].position)
        turn = rotation(_along(self.axis, 1.0), value)
        move = partial(moved, shift=place - turn @ place, turn=turn)
        return with_lights(design, self.name, move, only=self.index)


class CameraTurn(_Move):
    """Turn of the camera about one of its own axes: right, up, viewing direction."""

    @property
    def values(self) -> list[str]:
        """Paths of the values or sections of a design that it changes."""
        return ["camera.direction", "camera.up"]

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the camera turned by `value` degrees."""
        return with_camera_turned(self.axis, design, value)


@dataclass(frozen=True)
class GroupMoves(DesignVariable):
    """The same move of several groups of lights."""

    members: tuple[DesignVariable, ...]
    stage: ClassVar[int] = 2
    numeric: ClassVar[bool] = True

    @property
    def paths(self) -> list[str]:
        """Paths of all moves."""
        return [each.path for each in self.members]

    def start(self, design: SensorDesign) -> float:
        """Return 0, the value of every move in the starting design."""
        return 0.0

    @property
    def values(self) -> list[str]:
        """Paths of the values or sections of a design that it changes."""
        return [path for each in self.members for path in each.values]

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with all groups moved by `value`, mm or degrees."""
        for each in self.members:
            design = each.apply(design, value)
        return design


class _PartMove(_Move):
    """Move of a part."""

    shapes: ClassVar[bool] = True

    @property
    def values(self) -> list[str]:
        """Paths of the values or sections of a design that it changes."""
        return [f"parts.{self.name}"]


class PartShift(_PartMove):
    """Shift of a part along an axis of the design."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the part shifted by `value` mm."""
        return _with_mesh(design, self.name, np.eye(3), _along(self.axis, value))


class PartTurn(_PartMove):
    """Turn of a part about an axis of the design through the middle of its bounding box."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the part turned by `value` degrees."""
        middle = design.meshes[self.name].bounds.mean(axis=0)
        turn = rotation(_along(self.axis, 1.0), value)
        return _with_mesh(design, self.name, turn, middle - turn @ middle)


def _with_mesh(
    design: SensorDesign, part: str, turn: FloatArray, shift: FloatArray
) -> SensorDesign:
    mesh: TriangleMesh = design.meshes[part]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, shift
    moved = design.copy()
    moved.meshes[part] = mesh.transformed(matrix)
    return moved


def _along(axis: int, length: float) -> FloatArray:
    vector = np.zeros(3)
    vector[axis] = length
    return vector
