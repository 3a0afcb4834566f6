"""Paths for more than one value: moves of lights, parts and the camera, and parts of the library.

They look like other paths but lead to no single number of a design: `lights.GROUP.shift.x`,
`parts.PART.turn`, `lights.types`, `coating.library` and others of the table in docs/search.md.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection

from optisense.design import SensorDesign
from optisense.errors import DesignError, SearchError
from optisense.near import suggestion
from optisense.search.space.design_variables import (
    DesignVariable,
    GroupType,
    LibraryCamera,
    LibraryCoating,
    LightType,
    PartMaterial,
)
from optisense.search.space.rigid_moves import (
    CameraTurn,
    GroupTurn,
    LightShift,
    LightTurn,
    PartShift,
    PartTurn,
)

MOVES: dict[tuple[str, str], Callable[..., DesignVariable]] = {
    ("lights", "shift"): LightShift,
    ("lights", "turn"): GroupTurn,
    ("lights", "aim"): LightTurn,
    ("camera", "turn"): CameraTurn,
    ("parts", "shift"): PartShift,
    ("parts", "turn"): PartTurn,
}


def find_variables(design: SensorDesign, path: str) -> list[DesignVariable]:
    """Return the variables that a path names: none for an ordinary path, three for a vector."""
    move = re.fullmatch(
        r"(?:(lights|parts)\.([^.\[\]]+)|(camera))\.(shift|turn|aim)(?:\.([^.]+))?", path
    )
    if move is not None:
        section, name, camera, what, letter = move.groups()
        if what == "aim" and section != "lights":
            return []
        return _moves(design, path, section or camera, name or "", what, letter)
    single = re.fullmatch(
        r"lights\.([^.\[\]]+)\.lights\[(\d+)\]\.(shift|turn|model)(?:\.([xyz]))?", path
    )
    if single is not None:
        group, index, what, letter = single.groups()
        return _of_light(design, path, group, int(index), what, letter)
    if path == "coating.library":
        return [LibraryCoating(path)]
    if path == "camera.model":
        return [LibraryCamera(path)]
    if path == "lights.model":
        return [GroupType(path, None)]
    if path == "lights.types":
        return [
            LightType(f"lights.{name}.lights[{index}].model", name, index)
            for name, group in design.lights.items()
            for index in range(len(group.lights))
        ]
    part = re.fullmatch(r"parts\.([^.\[\]]+)\.material", path)
    if part is not None and part[1] in design.parts:
        return [PartMaterial(path, part[1])]
    lamps = re.fullmatch(r"lights\.([^.\[\]]+)\.model", path)
    if lamps is not None and lamps[1] in design.lights:
        return [GroupType(path, lamps[1])]
    return []


def _of_light(
    design: SensorDesign, path: str, group: str, index: int, what: str, letter: str | None
) -> list[DesignVariable]:
    _refuse_unknown(path, "lights", group, design.lights)
    count = len(design.lights[group].lights)
    if index >= count:
        raise DesignError(
            f"'{path}' does not exist: the group has {count} lights",
            hint=f"Indices run from 0 to {count - 1}",
        )
    if what == "model":
        return [LightType(path, group, index)]
    return _along_axes(LightShift if what == "shift" else LightTurn, path, letter, group, index)


def _moves(
    design: SensorDesign, path: str, section: str, name: str, what: str, letter: str | None
) -> list[DesignVariable]:
    if section == "camera" and what == "shift":
        raise SearchError(
            "the camera has no shift", where=path, hint="Vary camera.position.x instead"
        )
    if section != "camera":
        known: Collection[str] = design.parts if section == "parts" else design.lights
        _refuse_unknown(path, section, name, known)
    if letter is not None and letter not in ("x", "y", "z"):
        raise DesignError(f"'{path}' does not exist: there is no axis '{letter}'", hint="x, y or z")
    if section == "parts":
        for cage_name, cage in design.cages.items():
            if name in cage.parts:
                raise SearchError(
                    f"part '{name}' is moved by the cage '{cage_name}'",
                    where=path,
                    hint=f"Vary cages.{cage_name}.points",
                )
    return _along_axes(MOVES[section, what], path, letter, name)


def _along_axes(
    kind: Callable[..., DesignVariable], path: str, letter: str | None, name: str, *index: int
) -> list[DesignVariable]:
    """Return the moves along or about one axis, or all three without a letter."""
    if letter is not None:
        return [kind(path, name, "xyz".index(letter), *index)]
    return [kind(f"{path}.{each}", name, axis, *index) for axis, each in enumerate("xyz")]


def _refuse_unknown(path: str, section: str, name: str, known: Collection[str]) -> None:
    if name not in known:
        raise DesignError(
            f"'{path}' does not exist: '{section}' has no '{name}'",
            hint=suggestion(name, known, limit=20),
        )
