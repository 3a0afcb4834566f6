"""Writer of a recipe, so that a sensor can be made of its CAD files again."""

from __future__ import annotations

import os
from pathlib import Path

from optisense.design.yaml_writer import to_yaml
from optisense.sensors.from_meshes.recipe import Recipe
from optisense.sensors.from_meshes.recipe_lights import FromTable
from optisense.sensors.from_meshes.recipe_parts import ShapeReference
from optisense.writing import write_text

RECIPE_FILE = "recipe.yaml"
"""File name of a design's recipe in its folder."""

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
