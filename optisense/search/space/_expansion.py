"""Expansion of a user's paths into single parameters: paths are looked up, and those of vectors,
cages and wildcards are split.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from pydantic import BaseModel

from optisense.design import Cage, SensorDesign, get_value, parse_path
from optisense.design.cage import as_array
from optisense.design.colour import NAMED_COLOURS
from optisense.errors import DesignError, SearchError
from optisense.search.space._control_points import (
    as_dicts,
    as_points,
    mean_share,
    point_parameters,
    shares_of,
    span_of,
    with_form,
)
from optisense.search.space._variable_paths import find_variables
from optisense.search.space.design_variables import DesignVariable
from optisense.search.space.parameters import (
    Around,
    CagePoints,
    Choice,
    Continuous,
    Integer,
    Parameter,
    Specification,
    Target,
    Together,
    within,
)
from optisense.search.space.rigid_moves import GroupMoves, GroupTurn, LightShift, LightTurn

RGB_FIELDS = (
    "colour", "reflectance", "eta", "k", "dispersion", "absorption", "extinction", "transmittance",
)  # fmt: skip


def expand(
    design: SensorDesign, path: str, spec: Specification
) -> tuple[SensorDesign, list[Parameter]]:
    """Return the single parameters for one path, and the design, changed in form and not in shape
    where needed: a cage given by its points gets a blend if the blend varies. The error for a path
    that names nothing, or that can't be varied like this, suggests another.
    """
    if isinstance(spec, Together):
        return _together(design, path, spec)
    if "*" in path:
        found: list[Parameter] = []
        for each in starred(design, path):
            design, added = expand(design, each, spec)
            found += added
        return design, found
    try:
        variables = find_variables(design, path)
        if variables:
            return design, [_of_variable(design, variable, spec, path) for variable in variables]
        steps = parse_path(path)
        if len(steps) > 2 and steps[0] == "cages" and steps[2] in ("points", "blend"):
            axes = steps[3:]
            if not axes:
                return _of_cage(design, str(steps[1]), str(steps[2]), path, spec)
            if len(axes) == 1 and axes[0] in ("x", "y", "z"):
                whole, chosen = path.rpartition(".")[0], replace(as_points(spec), axes=str(axes[0]))
                design, found = _of_cage(design, str(steps[1]), str(steps[2]), whole, chosen)
                return design, [replace(each, asked=path) for each in found]
        if isinstance(spec, CagePoints):
            raise SearchError(
                "the options of control points do not apply to this path",
                hint="Vary cages.NAME.points",
            )
        single = _of_value(path, _present(design, path), spec)
        return design, [replace(each, asked=path) for each in single]
    except SearchError as error:
        raise SearchError(error.message, where=error.where or path, hint=error.hint) from None


def _present(design: SensorDesign, path: str) -> Any:
    """Return the value at a path; the error where there is none also names the moves of lights and
    parts.
    """
    try:
        return get_value(design, path)
    except DesignError as error:
        section, _, rest = path.partition(".")
        moves = {"lights": "shift, turn and aim move lights", "parts": "shift and turn move a part"}
        if section not in moves or "." not in rest:
            raise
        hint = f"{error.hint or ''}; {moves[section]}".removeprefix("; ")
        raise DesignError(error.message, where=error.where, hint=hint) from None


def starred(design: SensorDesign, path: str) -> list[str]:
    """Return the paths that match one with a wildcard: `lights.*.colour`, `lights.lg*.flux`."""
    section, _, rest = path.partition(".")
    pattern, _, leaf = rest.partition(".")
    sections: dict[str, Collection[str]] = {
        "lights": design.lights,
        "parts": design.parts,
        "materials": design.materials,
        "cages": design.cages,
    }
    names = sections.get(section)
    if names is None or "*" in leaf or not leaf:
        raise SearchError(
            "a * stands for names of lights, parts, materials or cages",
            where=path,
            hint="Write it like lights.*.colour",
        )
    chosen = [name for name in names if fnmatchcase(name, pattern)]
    if not chosen:
        raise SearchError(
            f"'{section}' has no name like '{pattern}'",
            where=path,
            hint="Known: " + ", ".join(names) if names else None,
        )
    return [f"{section}.{name}.{leaf}" for name in chosen]


def _together(
    design: SensorDesign, path: str, spec: Together
) -> tuple[SensorDesign, list[Parameter]]:
    """Return parameters that each set the same number of all names that a star stands for."""
    if "*" not in path:
        raise SearchError(
            "only values of a path with a * vary together", where=path, hint="Remove /together"
        )
    members: list[list[Parameter]] = []
    for each in starred(design, path):
        design, added = expand(design, each, spec.range)
        members.append(added)
    section, pattern = path.split(".")[:2]
    one_by_one = SearchError(
        "these values have different ranges, or can't be varied together",
        where=path,
        hint="Give LOW:HIGH or options for values or moves of lights, or vary them one by one",
    )
    if section == "cages" or len({len(each) for each in members}) > 1:
        raise one_by_one
    found = []
    for same in zip(*members, strict=True):
        first = same[0]
        moves = tuple(each.variable for each in same if each.variable is not None)
        movable = all(isinstance(each, LightShift | LightTurn | GroupTurn) for each in moves)
        if not movable or any(each.kind != first.kind for each in same):
            raise one_by_one
        name = f"{section}.{pattern}.{first.name.split('.', 2)[2]}"
        targets = tuple(target for each in same for target in each.targets)
        variable = GroupMoves(name, moves) if moves else None
        found.append(replace(first, name=name, targets=targets, variable=variable, asked=path))
    return design, found


def _of_variable(
    design: SensorDesign, variable: DesignVariable, spec: Specification, asked: str
) -> Parameter:
    now = variable.start(design)
    if variable.numeric:
        if isinstance(spec, Around):
            spec = spec.about(0.0)
        if not isinstance(spec, Continuous):
            raise SearchError("this parameter takes a range of numbers", hint="Give two bounds")
        assert isinstance(now, float)
        return Parameter(variable.path, spec, within(now, spec), variable=variable, asked=asked)
    if not isinstance(spec, Choice):
        raise SearchError(
            "this parameter takes names to choose from", hint="Give them as NAME,NAME,..."
        )
    return Parameter(variable.path, spec, _number_of(now, spec), variable=variable, asked=asked)


def _of_value(path: str, value: Any, spec: Specification) -> list[Parameter]:
    """Return the parameters of an ordinary path: one value, or two or three numbers of a vector."""
    if isinstance(spec, Choice):
        spec = _colours_read(path, spec)
        return [Parameter(path, spec, _number_of(value, spec), (Target(path),))]
    if isinstance(value, bool | str) or value is None:
        raise SearchError(
            f"the value {value!r} is not a number", hint="Give options: NAME,NAME,..."
        )
    if isinstance(value, tuple):
        letters = _letters(path, len(value))
        return [
            each
            for letter, item in zip(letters, value, strict=True)
            for each in _of_value(f"{path}{letter}", item, spec)
        ]
    if isinstance(value, BaseModel | list | dict):
        raise SearchError(
            "this is a section, not a number",
            hint=f"Name a number in it, such as {_example(path, value)}",
        )
    kind = _bounds(value, spec)
    start = within(float(value), kind)
    return [Parameter(path, kind, start, (Target(path),))]


def _bounds(value: float, spec: Specification) -> Continuous | Integer:
    """Return bounds for a number; integer bounds for an integer."""
    assert not isinstance(spec, Choice | CagePoints | Together)
    whole = isinstance(value, int)
    if isinstance(spec, Around):
        spec = spec.about(float(value))
    if isinstance(spec, Continuous) and whole:
        if spec.low != round(spec.low) or spec.high != round(spec.high):
            raise SearchError(
                f"the value is a whole number, and the bounds {spec.low:g} and {spec.high:g} "
                "must be, too"
            )
        return Integer(round(spec.low), round(spec.high))
    return spec


def _of_cage(
    design: SensorDesign, name: str, field: str, path: str, spec: Specification
) -> tuple[SensorDesign, list[Parameter]]:
    cage: Cage = get_value(design, f"cages.{name}")
    given = as_points(spec)
    if field == "blend":
        if cage.c_min is None or cage.c_max is None:
            raise SearchError(
                f"the cage '{name}' has no c_min and c_max to blend",
                hint=f"Add both to the design, or vary cages.{name}.points",
            )
        gridded = isinstance(spec, Continuous) and spec.steps is not None
        if not isinstance(spec, CagePoints) and (isinstance(cage.blend, float) or gridded):
            share = cage.blend if isinstance(cage.blend, float) else mean_share(cage)
            ready = with_form(design, name, points=[], blend=share)
            return ready, [replace(each, asked=path) for each in _of_value(path, share, spec)]
        shares = shares_of(cage)
        ready = with_form(design, name, points=[], blend=as_dicts(shares))
        return ready, point_parameters(cage, path, shares, given, free=span_of(cage) != 0.0)
    if cage.blend is not None:
        design = with_form(design, name, blend=None, points=as_dicts(cage.current_points()))
    points = as_array(design.cages[name].points)
    return design, point_parameters(cage, path, points, given, mirror=np.array(cage.box))


def _colours_read(path: str, spec: Choice) -> Choice:
    """Replace names of colours by values, if the path is that of a colour."""
    if not path.endswith(".colour"):
        return spec
    initials = {name[0]: name for name in NAMED_COLOURS}  # R, G, B and W
    options = []
    for option in spec.options:
        if isinstance(option, str):
            name = initials.get(option.lower(), option.lower())
            if name not in NAMED_COLOURS:
                raise SearchError(
                    f"there is no colour '{option}'", hint="Known: " + ", ".join(NAMED_COLOURS)
                )
            options.append(NAMED_COLOURS[name])
        else:
            options.append(option)
    return Choice(options, spec.labels)


def _number_of(value: object, spec: Choice) -> float:
    """Return the index of a value among the options; 0 if it is not one of them."""
    return float(spec.options.index(value)) if value in spec.options else 0.0


def _letters(path: str, count: int) -> list[str]:
    if count == 3:
        name = path.rsplit(".", 1)[-1]
        return [f".{letter}" for letter in ("rgb" if name in RGB_FIELDS else "xyz")]
    return [f"[{index}]" for index in range(count)]


def _example(path: str, value: Any) -> str:
    """Return an example of a path inside a section."""
    if isinstance(value, list):
        return f"{path}[0]"
    names = list(type(value).model_fields) if isinstance(value, BaseModel) else list(value)
    return f"{path}.{names[-1]}" if names else path
