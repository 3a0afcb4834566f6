"""Design variables that shift and turn lights, parts and the camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.design.lights import Light
from optisense.design.posing import moved, with_camera_turned, with_lights
from optisense.geometry.rotations import rotation
from optisense.search.space.design_variables import DesignVariable


class _Move(DesignVariable):
    """Move by a number of mm or degrees; 0 changes nothing."""

    stage: ClassVar[int] = 2
    numeric: ClassVar[bool] = True

    def start(self, design: SensorDesign) -> float:
        """Return 0, the value of every move in the starting design."""
        return 0.0


@dataclass(frozen=True)
class _AxisMove(_Move):
    """Move along or about one axis."""

    name: str
    axis: int

    @property
    def _direction(self) -> FloatArray:
        """Direction (3,) of the axis."""
        return np.eye(3)[self.axis]


@dataclass(frozen=True)
class _LightMove(_AxisMove):
    """Move of one light of a group, or of all if `index` is None."""

    index: int | None = None

    @property
    def values(self) -> list[str]:
        place = "" if self.index is None else f"[{self.index}]"
        return [f"lights.{self.name}.lights{place}"]


class LightShift(_LightMove):
    """Shift of lights along an axis of the design."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the lights shifted by `value` mm."""
        move = partial(moved, shift=value * self._direction)
        return with_lights(design, self.name, move, only=self.index)


class LightTurn(_LightMove):
    """Turn of each light about an axis of the design through its own position."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with each of the lights turned by `value` degrees."""
        turn = rotation(self._direction, value)

        def turned(light: Light) -> Light:
            place = np.array(light.position)
            return moved(light, place - turn @ place, turn)

        return with_lights(design, self.name, turned, only=self.index)


class GroupTurn(_LightMove):
    """Turn of all lights of a group about an axis of the design through their middle."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the group turned by `value` degrees."""
        lights = design.lights[self.name].lights
        middle = np.mean([light.position for light in lights], axis=0)
        turn = rotation(self._direction, value)
        move = partial(moved, shift=middle - turn @ middle, turn=turn)
        return with_lights(design, self.name, move)


@dataclass(frozen=True)
class GroupMoves(_Move):
    """The same move of several groups of lights."""

    members: tuple[DesignVariable, ...]

    @property
    def paths(self) -> list[str]:
        return [each.path for each in self.members]

    @property
    def values(self) -> list[str]:
        return [path for each in self.members for path in each.values]

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with all groups moved by `value`, mm or degrees."""
        for each in self.members:
            design = each.apply(design, value)
        return design


class CameraTurn(_AxisMove):
    """Turn of the camera about one of its own axes: right, up, viewing direction."""

    @property
    def values(self) -> list[str]:
        return ["camera.direction", "camera.up"]

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the camera turned by `value` degrees."""
        return with_camera_turned(self.axis, design, value)


class _PartMove(_AxisMove):
    """Move of a part."""

    shapes: ClassVar[bool] = True

    @property
    def values(self) -> list[str]:
        return [f"parts.{self.name}"]

    def _moved(self, design: SensorDesign, turn: FloatArray, shift: FloatArray) -> SensorDesign:
        """Return the design with the part turned by a matrix (3, 3) and shifted by (3,), mm."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turn, shift
        changed = design.copy()
        changed.meshes[self.name] = design.meshes[self.name].transformed(matrix)
        return changed


class PartShift(_PartMove):
    """Shift of a part along an axis of the design."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the part shifted by `value` mm."""
        return self._moved(design, np.eye(3), value * self._direction)


class PartTurn(_PartMove):
    """Turn of a part about an axis of the design through the middle of its bounding box."""

    def apply(self, design: SensorDesign, value: Any) -> SensorDesign:
        """Return the design with the part turned by `value` degrees."""
        middle = design.meshes[self.name].bounds.mean(axis=0)
        turn = rotation(self._direction, value)
        return self._moved(design, turn, middle - turn @ middle)
