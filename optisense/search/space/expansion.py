"""Expansion of a user's paths into single parameters: paths are looked up, and those of vectors,
cages and wildcards are split.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from pydantic import BaseModel

from optisense.design import Cage, SensorDesign, Share, get_value, parse_path, set_value
from optisense.design.cage import as_array
from optisense.design.colour import NAMED_COLOURS
from optisense.errors import SearchError
from optisense.search.space.design_variables import DesignVariable
from optisense.search.space.parameters import (
    Around,
    CagePoints,
    Choice,
    Continuous,
    Integer,
    Single,
    Specification,
)
from optisense.search.space.variable_paths import find_variables

RGB_FIELDS = (
    "colour", "reflectance", "eta", "k", "dispersion", "absorption", "extinction", "transmittance",
)  # fmt: skip

SYMMETRY_TOLERANCE = 1e-4
"""Largest difference between mirror images in a symmetric cage, as a share of its box or as a blend
share; it allows for rounded numbers in files.
"""


@dataclass(frozen=True)
class Target:
    """Value that follows a parameter: `scale` times the parameter plus `offset` (choices: as they
    are).
    """

    path: str
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Parameter:
    """Single number or name that a search may change.

    Attributes:
        name: dotted path of the parameter; unique in a space.
        kind: bounds or options.
        start: value in the design, as a coordinate (see `BoundSpace`), within the bounds.
        targets: values of the design that follow the parameter; empty if it has a variable.
        variable: design variable that it changes, if it changes more than values.
        asked: path as the user gave it.
    """

    name: str
    kind: Single
    start: float
    targets: tuple[Target, ...] = ()
    variable: DesignVariable | None = None
    asked: str = ""


def expand(
    design: SensorDesign, path: str, spec: Specification
) -> tuple[SensorDesign, list[Parameter]]:
    """Return the single parameters for one path.

    Returns:
        The design and the parameters. The design is changed in form, not in shape, where needed: a
        cage given by its points gets a blend if the blend varies.

    Raises:
        DesignError: the path names nothing in the design; the message suggests a similar name.
        SearchError: the path can't be varied like this.
    """
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
            raise SearchError("these are no control points", hint="Vary cages.NAME.points")
        single = _of_value(path, get_value(design, path), spec)
        return design, [replace(each, asked=path) for each in single]
    except SearchError as error:
        raise SearchError(error.message, where=error.where or path, hint=error.hint) from None


def starred(design: SensorDesign, path: str) -> list[str]:
    """Return the paths that match one with a wildcard: `lights.*.colour`, `lights.lg*.flux`.

    Raises:
        SearchError: the wildcard is not in a name, or matches none.
    """
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
            "a star stands for names of lights, parts, materials or cages",
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


def _of_variable(
    design: SensorDesign, variable: DesignVariable, spec: Specification, asked: str
) -> Parameter:
    now = variable.start(design)
    if variable.numeric:
        if isinstance(spec, Around):
            spec = spec.about(0.0)
        if not isinstance(spec, Continuous):
            raise SearchError("this takes a range of numbers", hint="Give LOW:HIGH")
        assert isinstance(now, float)
        return Parameter(variable.path, spec, _within(now, spec), variable=variable, asked=asked)
    if not isinstance(spec, Choice):
        raise SearchError("this takes names to choose from", hint="Give them as NAME,NAME,...")
    return Parameter(variable.path, spec, _number_of(now, spec), variable=variable, asked=asked)


def _of_value(path: str, value: Any, spec: Specification) -> list[Parameter]:
    """Return the parameters for an ordinary path: one value, or the two or three numbers of a
    vector.
    """
    if isinstance(spec, Choice):
        spec = _colours_read(path, spec)
        return [Parameter(path, spec, _number_of(value, spec), (Target(path),))]
    if isinstance(value, bool | str) or value is None:
        raise SearchError(
            f"the value there, {value!r}, is no number", hint="Give options: NAME,NAME,..."
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
    start = _within(float(value), kind)
    return [Parameter(path, kind, start, (Target(path),))]


def _bounds(value: float, spec: Specification) -> Continuous | Integer:
    """Return bounds for a number; integer bounds for an integer."""
    assert not isinstance(spec, Choice | CagePoints)
    whole = isinstance(value, int)
    if isinstance(spec, Around):
        spec = spec.about(float(value))
    if isinstance(spec, Continuous) and whole:
        if spec.low != round(spec.low) or spec.high != round(spec.high):
            raise SearchError(
                f"the value there is a whole number, {spec.low:g} and {spec.high:g} are not both"
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
            share = cage.blend if isinstance(cage.blend, float) else _mean_share(cage)
            ready = _with_blend(design, name, share)
            return ready, [replace(each, asked=path) for each in _of_value(path, share, spec)]
        shares = _shares(cage)
        ready = _with_blend(design, name, [Share(x=x, y=y, z=z) for x, y, z in shares.tolist()])
        return ready, _points(cage, path, shares, given, free=_span(cage) != 0.0)
    if cage.blend is not None:
        points = cage.current_points()
        change = {"blend": None, "points": _as_dicts(points)}
        design = set_value(design, f"cages.{name}", {**cage.model_dump(mode="json"), **change})
    points = as_array(design.cages[name].points)
    return design, _points(cage, path, points, given, mirror=np.array(cage.box))


def as_points(spec: Specification) -> CagePoints:
    """Return bounds or a reach for all control points, unless single points are given already.

    Raises:
        SearchError: the specification is a choice or an integer.
    """
    if isinstance(spec, CagePoints):
        return spec
    if isinstance(spec, Choice | Integer):
        raise SearchError("control points take a range of numbers", hint="Give LOW:HIGH")
    return CagePoints(spec)


def _points(
    cage: Cage,
    path: str,
    now: np.ndarray,
    spec: CagePoints,
    mirror: np.ndarray | None = None,
    free: np.ndarray | None = None,
) -> list[Parameter]:
    """Return parameters for the coordinates of control points (N, 3).

    Args:
        mirror: box (2, 3), mm, across whose middle coordinates are mirrored; None for blend shares,
            which are not.
        free: coordinates (N, 3) that have an effect, bool.
    """
    count = len(now)
    chosen = range(count) if spec.points is None else spec.points
    for index in chosen:
        if not 0 <= index < count:
            raise SearchError(f"there is no point {index}", hint=f"0 to {count - 1} are there")
    free = np.ones((count, 3), dtype=bool) if free is None else free
    images = _images(cage, spec.symmetry)
    plane = "xyz".index(spec.symmetry) if spec.symmetry else -1
    if spec.symmetry:
        _check_symmetric(cage, now, images, plane, mirror, spec.symmetry)
    found = []
    for index in dict.fromkeys(min(index, int(images[index])) for index in chosen):
        image = int(images[index])
        for axis in (k for k in range(3) if "xyz"[k] in spec.axes):
            mirrored = axis == plane and mirror is not None
            if not free[index, axis] or (axis == plane and image == index):
                continue  # a point in the plane of symmetry stays in it
            target = f"{path}[{index}].{'xyz'[axis]}"
            targets = [Target(target)]
            if image != index:
                offset = float(mirror[:, axis].sum()) if mirrored and mirror is not None else 0.0
                other = f"{path}[{image}].{'xyz'[axis]}"
                targets.append(Target(other, -1.0 if mirrored else 1.0, offset))
            value = float(now[index, axis])
            bounds = spec.range.about(value) if isinstance(spec.range, Around) else spec.range
            if isinstance(spec.range, Around) and mirror is None:
                bounds = Continuous(max(0.0, bounds.low), min(1.0, bounds.high), bounds.steps)
            start = _within(value, bounds)
            found.append(Parameter(target, bounds, start, tuple(targets), asked=path))
    if not found:
        raise SearchError("nothing is left to vary here", hint="Name other points or axes")
    return found


def _images(cage: Cage, symmetry: str | None) -> np.ndarray:
    """Return the index of each control point's mirror image, (N,), or its own index without
    symmetry.
    """
    lattice = np.arange(int(np.prod(cage.resolution))).reshape(cage.resolution)
    return (np.flip(lattice, "xyz".index(symmetry)) if symmetry else lattice).reshape(-1)


def _check_symmetric(
    cage: Cage,
    now: np.ndarray,
    images: np.ndarray,
    plane: int,
    mirror: np.ndarray | None,
    name: str,
) -> None:
    box = np.array(cage.box)
    checked = [("points", now, float(np.ptp(box, axis=0).max()))]
    if mirror is None:  # then the ends of the blend must be mirror images too
        assert cage.c_min is not None and cage.c_max is not None
        size = checked.pop()[2]
        checked = [("c_min", as_array(cage.c_min), size), ("c_max", as_array(cage.c_max), size)]
    for label, points, size in checked:
        image = points[images].copy()
        image[:, plane] = box[:, plane].sum() - image[:, plane]
        apart = np.abs(image - points).max(axis=1)
        if apart.max() > SYMMETRY_TOLERANCE * size:
            worst = int(apart.argmax())
            raise SearchError(
                f"the cage's {label} are not symmetric along {name}: points {worst} and "
                f"{images[worst]} are {apart.max():.3g} mm from being mirror images",
                hint="Search without symmetry, or make the shape symmetric first",
            )


def _shares(cage: Cage) -> np.ndarray:
    """Return the present blend share of each coordinate between c_min and c_max, (N, 3); 0 where
    both are equal.
    """
    if isinstance(cage.blend, list):
        return as_array(cage.blend)
    if cage.blend is not None:
        return np.full((len(cage.c_min or []), 3), float(cage.blend))
    span = _span(cage)
    way = as_array(cage.points) - as_array(cage.c_min or [])
    shares = np.divide(way, span, out=np.zeros_like(way), where=span != 0.0)
    return np.asarray(np.clip(shares, 0.0, 1.0))


def _mean_share(cage: Cage) -> float:
    moving = _span(cage) != 0.0
    return float(_shares(cage)[moving].mean()) if moving.any() else 0.0


def _span(cage: Cage) -> np.ndarray:
    return as_array(cage.c_max or []) - as_array(cage.c_min or [])


def _with_blend(design: SensorDesign, name: str, blend: float | list[Share]) -> SensorDesign:
    """Return the design with its cage given by `blend` instead of points."""
    plain = blend if isinstance(blend, float) else [share.model_dump() for share in blend]
    cage = design.cages[name].model_dump(mode="json")
    return set_value(design, f"cages.{name}", {**cage, "points": [], "blend": plain})


def _as_dicts(points: np.ndarray) -> list[dict[str, float]]:
    return [{"x": x, "y": y, "z": z} for x, y, z in points.tolist()]


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


def _within(value: float, kind: Single) -> float:
    assert not isinstance(kind, Choice)
    return min(max(value, float(kind.low)), float(kind.high))


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
