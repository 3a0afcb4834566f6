"""Access to any value of a design by a dotted path.

Grammar: names and list indices, as in `coating.specularity`, `lights.red.flux`,
`cages.skin.points[13].z`. The three numbers of a triple can also be named: `.x .y .z` of a vector,
`.r .g .b` of a colour.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel

from optisense.design.fields import Steps
from optisense.design.lights import of_model
from optisense.design.sensor_design import SensorDesign, dotted, refuse_no_design, same_mesh
from optisense.errors import DesignError
from optisense.near import suggestion

_STEP = re.compile(r"(?:^|\.)(?P<name>[A-Za-z0-9_][A-Za-z0-9_-]*)|\[(?P<index>\d{1,9})\]")
_LETTERS = {"x": 0, "y": 1, "z": 2, "r": 0, "g": 1, "b": 2}
"""Index of a coordinate or colour channel, by the letter that may stand for it in a path."""


def get_value(design: SensorDesign, path: str) -> Any:
    """Return the value at `path`: a number, text, vector (tuple), list or a whole section.

    Raises:
        DesignError: the path is malformed or names nothing; the message suggests a similar name.
    """
    refuse_no_design(design)
    value: Any = design
    steps = parse_path(path)
    for count, step in enumerate(steps):
        value = _child(value, step, path, steps[:count])
    return value


def set_value(design: SensorDesign, path: str, value: object) -> SensorDesign:
    """Return a new, checked design with `value` at `path`; the given design is not changed.

    Sources of this value, of values in it and of values that hold it are dropped from the
    provenance if they are other ones then. Another `model` of a light group replaces the group's
    own `emitter`; to keep or change that, give it to `set_values` too.

    Raises:
        DesignError: the path names nothing, or the value does not fit there.
    """
    return set_values(design, {path: value})


def set_values(design: SensorDesign, values: Mapping[str, object]) -> SensorDesign:
    """Return a new design with all these values by their paths, checked once with all of them.

    Sources of values that are other ones then are dropped from the provenance; see `set_value`.

    Raises:
        DesignError: a path names nothing, or the values do not fit there.
    """
    refuse_no_design(design)
    data = design._data()
    models = {
        f"lights.{group}.model"
        for group in design.lights
        if not any(path.startswith(f"lights.{group}.emitter") for path in values)
    }
    for path, value in values.items():
        get_value(design, path)  # raises an error that suggests a similar name
        target: Any = data
        *way, last = parse_path(path)
        for step in way:
            target = target[key_of(target, step)]
        plain: Any = _plain(value)
        key = key_of(target, last)
        if path in models and target[key] != plain:
            target.update(of_model(plain))
        else:
            target[key] = plain
    edited = design._replaced(data, where=", ".join(values))
    for path in changed_paths(design, edited, design.provenance):
        edited.provenance.pop(path, None)
    return edited


def changed_paths(before: SensorDesign, after: SensorDesign, paths: Iterable[str]) -> list[str]:
    """Return the paths at which a value of one design is another one in a second design, or is in
    one of them only. A part has another value if its mesh is another one.
    """
    return [
        path
        for path in paths
        if found_at(before, path) != found_at(after, path) or not _same_part(before, after, path)
    ]


def found_at(design: SensorDesign, path: str) -> tuple[Any, ...]:
    """Return the value at a path as a tuple of one; an empty tuple if the path names nothing."""
    try:
        return (get_value(design, path),)
    except DesignError:
        return ()


def _same_part(before: SensorDesign, after: SensorDesign, path: str) -> bool:
    """Return False if the path names a part that has another mesh in the second design."""
    section, _, name = path.partition(".")
    return section != "parts" or same_mesh(before.meshes.get(name), after.meshes.get(name))


def parse_path(path: str) -> Steps:
    """Split a path into names and indices.

    Raises:
        DesignError: the path is malformed.
    """
    steps: list[str | int] = []
    position = 0
    while position < len(path):
        match = _STEP.match(path, position)
        if match is None or (position == 0 and match["name"] is None):
            break
        steps.append(match["name"] if match["index"] is None else int(match["index"]))
        position = match.end()
    if not steps or position < len(path):
        raise DesignError(
            f"'{path}' is not a path to a value",
            hint="Write it like lights.red.flux or cages.skin.points[13].z",
        )
    return tuple(steps)


def _child(value: Any, step: str | int, path: str, done: Steps) -> Any:
    here = f"'{dotted(done)}'" if done else "the design"
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        if step in fields:
            return getattr(value, str(step))
        known = list(fields)
    elif isinstance(value, dict):
        if step in value:
            return value[step]
        known = list(value)
    elif isinstance(value, list | tuple):
        key = key_of(value, step)
        if isinstance(key, int):
            if key < len(value):
                return value[key]
            hint = f"Indices run from 0 to {len(value) - 1}" if len(value) else None
            if not len(value) and done[:1] == ("cages",):
                hint = "The points of this cage follow from its blend: change that, or settle it"
            raise DesignError(
                f"'{path}' does not exist: {here} has {len(value)} entries", hint=hint
            )
        known = ["x", "y", "z"] if len(value) == 3 else []
    else:
        raise DesignError(
            f"'{path}' does not exist: {here} is a single value",
            hint=f"End the path at {here}",
        )
    missing = f"{here} has no '{step}'"
    raise DesignError(
        missing if path == step else f"'{path}' does not exist: {missing}",
        hint=suggestion(str(step), known, limit=20),
    )


def key_of(container: Any, step: str | int) -> str | int:
    """Return the key or index of `step`; x, y, z and r, g, b stand for 0, 1, 2 in a triple."""
    if isinstance(container, list | tuple) and len(container) == 3 and step in _LETTERS:
        return _LETTERS[str(step)]
    return step


def _plain(value: object) -> object:
    """Return models and NumPy numbers and arrays as plain Python values."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    to_list = getattr(value, "tolist", None)  # NumPy scalars and arrays
    if callable(to_list):
        return to_list()
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value
