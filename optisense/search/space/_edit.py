"""Set many numbers of a design at once.

`set_value` checks the whole design for each value; a cage of 27 control points has 81. Here all
paths are looked up once, and then only the containers on the way to the values are rebuilt. Nothing
is checked: the caller has tried the bounds, or checks the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel

from optisense.design import SensorDesign, get_value, parse_path
from optisense.design.addressing import key_of

Node = dict[str | int, "Node | int"]
"""Steps down the design; a leaf is the index of a value in the given sequence."""


class Edit:
    """Positions of some values of a design, which are set together."""

    def __init__(self, design: SensorDesign, paths: Sequence[str]) -> None:
        """Look up all paths; DesignError if one names nothing in the design."""
        self._root: Node = {}
        for number, path in enumerate(paths):
            get_value(design, path)
            node = self._root
            *way, last = parse_path(path)
            for step in way:
                below = node.setdefault(step, {})
                assert isinstance(below, dict), f"'{path}' lies inside another path"
                node = below
            node[last] = number

    def apply(self, design: SensorDesign, values: Sequence[Any]) -> SensorDesign:
        """Return a design with these plain Python values, one for each path. It is unchecked, and
        shares everything else with the given design, which has the structure of the one
        in which the paths were looked up.
        """
        if not self._root:
            return design
        edited: SensorDesign = _rebuilt(design, self._root, values)
        return edited


def _rebuilt(value: Any, node: Node | int, values: Sequence[Any]) -> Any:
    """Return the value of a leaf, or a copy of a container with other values in it."""
    if isinstance(node, int):
        return values[node]
    if isinstance(value, BaseModel):
        inner = {str(step): below for step, below in node.items()}
        return value.model_copy(
            update={name: _rebuilt(getattr(value, name), inner[name], values) for name in inner}
        )
    items: Any = dict(value) if isinstance(value, dict) else list(value)
    for step, below in node.items():
        key = key_of(value, step)
        items[key] = _rebuilt(items[key], below, values)
    return tuple(items) if isinstance(value, tuple) else items
