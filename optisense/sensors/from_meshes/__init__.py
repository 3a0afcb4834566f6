"""Designs made of the user's own CAD files, by a recipe that states the role of each file.

`read_recipe` reads a recipe, `guess_recipe` makes one for a folder of CAD files, `save_recipe`
writes one, and `design_from_meshes` turns one into a design. `save_made` notes what was made, and
`changes_since_made` finds what was changed in it.
"""

from optisense.sensors.from_meshes._saving import (
    MADE_FILE,
    RECIPE_FILE,
    changes_since_made,
    save_made,
    save_recipe,
)
from optisense.sensors.from_meshes.building import FromMeshes, design_from_meshes
from optisense.sensors.from_meshes.guessing import guess_recipe
from optisense.sensors.from_meshes.recipe import Recipe, read_recipe

__all__ = [
    "MADE_FILE",
    "RECIPE_FILE",
    "FromMeshes",
    "Recipe",
    "changes_since_made",
    "design_from_meshes",
    "guess_recipe",
    "read_recipe",
    "save_made",
    "save_recipe",
]
