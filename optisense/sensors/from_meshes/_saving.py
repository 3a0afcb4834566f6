"""Writer of a recipe and of what was made of it, so that a sensor can be made again of its CAD
files without losing what was changed in it since.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from optisense.design import SensorDesign, load_design
from optisense.design.difference import differences_from, notes, plain_differences
from optisense.design.yaml_writer import to_yaml
from optisense.errors import DesignError
from optisense.sensors.from_meshes.recipe import Recipe
from optisense.sensors.from_meshes.recipe_lights import FromTable
from optisense.sensors.from_meshes.recipe_parts import ShapeReference
from optisense.untrusted_files import is_file, read_json
from optisense.writing import write_json, write_text

RECIPE_FILE = "recipe.yaml"
"""File name of a design's recipe in its folder."""

MADE_FILE = "recipe-made.json"
"""File name of the summary of a design as its recipe made it, in the design's folder."""

HEAD = "How a sensor is made of CAD files. Lengths in mm, angles in degrees, powers in mW."


def save_recipe(recipe: Recipe, path: str | Path) -> None:
    """Write a recipe with a comment on each line; paths of files become relative to its new place.

    The file is written whole under a temporary name and then renamed.

    Raises:
        OutputError: the file can't be written.
    """
    path = Path(path)
    moved = recipe.model_copy(deep=True)
    for shape in _with_files(moved):
        if shape.file is not None:
            shape.file = _from(recipe.folder / shape.file, path.parent)
    write_text(path, to_yaml(moved, HEAD), "the recipe")


def save_made(folder: Path) -> None:
    """Write a summary of the design in a folder, from which `changes_since_made` finds later edits.

    Raises:
        OptiSenseError: the design can't be read, or the file can't be written.
    """
    write_json(folder / MADE_FILE, _summary(load_design(folder)), "the summary of the design")


def changes_since_made(folder: Path) -> list[str] | None:
    """Return the changes of the design in a folder since a recipe made it, one per line.

    Returns:
        None if the folder has no summary by `save_made`.

    Raises:
        OptiSenseError: the design or the summary can't be read.
    """
    path = folder / MADE_FILE
    if not is_file(path):
        return None
    made, design = read_json(path, DesignError), load_design(folder)
    try:
        words = plain_differences(made["words"], _words(design))
        return differences_from(made["numbers"], design) + words
    except (KeyError, TypeError, ValueError, AttributeError):
        raise DesignError(
            "the summary of the design as its recipe made it is damaged", where=str(path)
        ) from None


def _summary(design: SensorDesign) -> dict[str, Any]:
    return {"words": _words(design), "numbers": notes(design)}


def _words(design: SensorDesign) -> dict[str, Any]:
    """Return the values of a design that `notes` leaves out."""
    return design.model_dump(mode="json", include={"name", "description", "provenance"})


def _with_files(recipe: Recipe) -> list[ShapeReference | FromTable]:
    """Return all objects of a recipe that may name files."""
    shapes: list[ShapeReference | FromTable] = list(recipe.parts.values())
    shapes += [group.table for group in recipe.lights.values() if group.table is not None]
    shapes += [group.over for group in recipe.lights.values() if group.over is not None]
    if isinstance(recipe.camera.at, ShapeReference):
        shapes.append(recipe.camera.at)
    return shapes


def _from(file: Path, folder: Path) -> str:
    """Return a file's path relative to a folder; the absolute path for another drive."""
    try:
        return Path(os.path.relpath(os.path.realpath(file), os.path.realpath(folder))).as_posix()
    except ValueError:
        return Path(os.path.realpath(file)).as_posix()
