"""Designs made of the user's own CAD files, by a recipe that states the role of each file.

`read_recipe` reads a recipe, `guess_recipe` makes one for a folder of CAD files, `save_recipe`
writes one, and `design_from_meshes` turns one into a design.
"""

from optisense.sensors.from_meshes._saving import RECIPE_FILE, save_recipe
from optisense.sensors.from_meshes.building import FromMeshes, design_from_meshes
from optisense.sensors.from_meshes.guessing import guess_recipe
from optisense.sensors.from_meshes.recipe import Recipe, read_recipe

__all__ = [
    "RECIPE_FILE",
    "FromMeshes",
    "Recipe",
    "design_from_meshes",
    "guess_recipe",
    "read_recipe",
    "save_recipe",
]
