"""State that the steps from a recipe to a design share."""

from __future__ import annotations

from optisense import library
from optisense.design import Provenance, Role
from optisense.errors import LibraryError, MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.repair import repaired
from optisense.sensors.from_meshes._part_poses import posed
from optisense.sensors.from_meshes.files import CadFiles
from optisense.sensors.from_meshes.recipe import Recipe
from optisense.sensors.from_meshes.recipe_parts import ShapeReference


class RecipeState:
    """Recipe, and the results of the steps so far.

    Attributes:
        recipe: recipe of the design.
        files: its CAD files.
        meshes: meshes of the parts, mm.
        provenance: sources of numbers, by dotted path.
        notes: repairs, moves, choices and unusual findings, one sentence each.
    """

    def __init__(self, recipe: Recipe) -> None:
        """Begin with a recipe of which no file is read yet."""
        self.recipe = recipe
        self.files = CadFiles(recipe.folder)
        self.meshes: dict[str, TriangleMesh] = {}
        self.provenance: dict[str, Provenance] = {}
        self.notes: list[str] = []

    def load(self, shape: ShapeReference, where: str) -> TriangleMesh:
        """Return the mesh of a file in its final position, mm; `where` names it in messages.

        Raises:
            SetupError: the file is a STEP file, but the extra for it is missing.
            MeshError: the file is missing or has no usable mesh.
            DesignError: the body or the unit of the shape does not fit the file.
        """
        try:
            return posed(self.files.load(shape, self.recipe.units or "mm", where), shape)
        except MeshError as error:
            place = f"{where}: {error.where}" if error.where else where
            if error.where and f"({shape.file})" in where:  # the place names the file again
                place = where.replace(f"({shape.file})", f"({error.where})")
            raise MeshError(error.message, where=place, hint=error.hint) from None

    def check_known(self, kind: str, name: str, *path: str) -> None:
        """Raise LibraryError with the line of a path in the recipe if the library has no entry of a
        kind, such as 'light', and name.
        """
        try:
            library.entry(kind, name)
        except LibraryError as error:
            where = error.where or self.recipe.where(*path)
            raise LibraryError(error.message, where=where, hint=error.hint) from None

    def label(self, name: str) -> str:
        """Return a part's name and file for messages."""
        part = self.recipe.parts[name]
        return f"part {name} ({part.file or f'faces of {part.faces_of}'})"

    def of(self, role: Role) -> list[str]:
        """Return the names of the parts with a role."""
        return [name for name, part in self.recipe.parts.items() if part.role is role]

    def solids(self) -> dict[str, TriangleMesh]:
        """Return the transparent solids by name, rigid ones first."""
        return {
            name: self.meshes[name]
            for role in (Role.SUPPORT, Role.ELASTOMER)
            for name in self.of(role)
            if name in self.meshes and self.recipe.parts[name].towards is None
        }

    def reference(self, shape: ShapeReference, where: str) -> TriangleMesh:
        """Return the welded mesh, mm, to which lights or the camera refer; `where` is for
        messages."""
        if shape.faces_of is not None:
            return self.meshes[shape.faces_of]
        mesh, _ = repaired(self.load(shape, where), where, closed=False)
        return TriangleMesh(mesh.vertices, mesh.faces)
