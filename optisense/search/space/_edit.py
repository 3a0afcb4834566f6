"""Set many numbers of a design at once.

`set_value` checks the whole design for each value; a cage of 27 control points has 81. Here the
positions of all values are looked up once, and then only the containers on the way to them are
rebuilt. Nothing is checked: the caller has tried the bounds, or checks the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel

from optisense.design import SensorDesign, get_value, parse_path

_LETTERS = {"x": 0, "y": 1, "z": 2, "r": 0, "g": 1, "b": 2}
"""Index of a coordinate or colour channel, by the letter that may stand for it in a path."""

Node = dict[str | int, "Node | int"]
"""Step down the design; a leaf is the index of a value in the given sequence."""


class Edit:
    """Positions of some values of a design, which are set together."""

    def __init__(self, design: SensorDesign, paths: Sequence[str]) -> None:
        """Look up all paths; DesignError if one names nothing in the design."""
        self.paths = tuple(paths)
        self._root: Node = {}
        for number, path in enumerate(paths):
            get_value(design, path)
            node, value = self._root, design
            *way, last = parse_path(path)
            for step in way:
                key = _key(value, step)
                value = _child(value, key)
                below = node.setdefault(key, {})
                assert isinstance(below, dict), f"'{path}' lies inside another path"
                node = below
            node[_key(value, last)] = number

    def apply(self, design: SensorDesign, values: Sequence[Any]) -> SensorDesign:
        """Return a design with these plain Python values, one for each path. It is unchecked, and
        shares everything else with the given design, which has the structure of that of the
        look-up.
        """
        if not self._root:
            return design
        edited: SensorDesign = _rebuilt(design, self._root, values)
        return edited


def _rebuilt(value: Any, node: Node, values: Sequence[Any]) -> Any:
    """Return a copy of the containers on the way to the values; everything else is shared."""
    if isinstance(value, BaseModel):
        update = {str(step): _below(getattr(value, str(step)), node[step], values) for step in node}
        return value.model_copy(update=update)
    if isinstance(value, dict):
        return {**value, **{step: _below(value[step], node[step], values) for step in node}}
    items = list(value)
    for step, below in node.items():
        items[int(step)] = _below(items[int(step)], below, values)
    return tuple(items) if isinstance(value, tuple) else items


def _below(value: Any, node: Node | int, values: Sequence[Any]) -> Any:
    return values[node] if isinstance(node, int) else _rebuilt(value, node, values)


def _key(container: Any, step: str | int) -> str | int:
    """Return the index of a letter of `_LETTERS` in a sequence, else the step itself."""
    if isinstance(container, list | tuple) and step in _LETTERS:
        return _LETTERS[str(step)]
    return step


def _child(container: Any, step: str | int) -> Any:
    if isinstance(container, BaseModel):
        return getattr(container, str(step))
    return container[step]
