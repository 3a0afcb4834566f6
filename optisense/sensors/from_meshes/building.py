"""Builder of the design of a recipe: files are read, contacts closed, lights and camera placed."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from optisense import library
from optisense.design import (
    Camera,
    LightGroup,
    Material,
    Part,
    Provenance,
    Role,
    SensorDesign,
    Status,
)
from optisense.design.check import OPAQUE_ROLES
from optisense.design.materials import kinds_for
from optisense.design.parts import TRANSPARENT_SOLIDS
from optisense.design.problems import design_error
from optisense.errors import DesignError, LibraryError, MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.plane_cuts import cut_along_planes
from optisense.geometry.repair import narrow_openings, refuse_bad_sheet, repaired
from optisense.geometry.step import SUFFIXES
from optisense.sensors.from_meshes._part_poses import laid_on, resting_order
from optisense.sensors.from_meshes._placement import (
    check_places,
    place_camera,
    place_lights,
    view_note,
)
from optisense.sensors.from_meshes._recipe_state import RecipeState
from optisense.sensors.from_meshes._touching import lay_on_elastomer, look_inward, settle_contacts
from optisense.sensors.from_meshes.files import refuse_odd_units
from optisense.sensors.from_meshes.recipe import Recipe, read_recipe
from optisense.sensors.from_meshes.surfaces import chosen

USUAL_MATERIAL = {
    Role.ELASTOMER: "silicone-xp565",
    Role.SUPPORT: "acrylic",
    Role.MIRROR: "mirror-silver",
}
"""Materials of parts for which the recipe names none; they are marked as assumed."""

MOST_CUT = 200_000
"""Largest number of triangles of a part that is cut by `cut_every`: eight times that of the largest
part of a built-in sensor."""


@dataclass
class FromMeshes:
    """Design made of CAD files.

    Attributes:
        design: design, ready to be saved and rendered.
        notes: repairs, moves, choices and unusual findings, one sentence each.
    """

    design: SensorDesign
    notes: list[str] = field(default_factory=list)


def design_from_meshes(recipe: Recipe | str | Path) -> FromMeshes:
    """Make a design of CAD files.

    Args:
        recipe: a recipe, or the path of a recipe file.

    Raises:
        SetupError: a file is a STEP file, but the extra for it is missing.
        MeshError: a file is missing or has no usable shape; the message names the part, the place
            and the remedy in the CAD tool.
        DesignError: the recipe does not fit the shapes.
        LibraryError: a material, coating, light or camera is not in the library.
    """
    if not isinstance(recipe, Recipe):
        recipe = read_recipe(recipe)
    builder = _Builder(recipe)
    return FromMeshes(builder.build(), builder.notes)


class _Builder(RecipeState):
    """Steps of the construction, in their order."""

    def build(self) -> SensorDesign:
        """Return the design; the steps add their notes to `notes`."""
        materials = self._materials()
        self._read_parts()
        contacts = settle_contacts(self.recipe, self.solids())
        self.meshes.update(contacts.meshes)
        self.notes += contacts.notes
        self._pick_faces()
        self._lay_skins()
        camera = place_camera(self)
        groups = {
            name: place_lights(self, name, choice) for name, choice in self.recipe.lights.items()
        }
        check_places(self, camera, groups)
        design = self._imaged(self._design(materials, contacts.priorities, camera, groups))
        design.meshes.update({name: self.meshes[name] for name in self.recipe.parts})
        seen = view_note(design)
        self.notes += [] if seen is None else [seen]
        for name in self.of(Role.INDENTER):
            self.notes.append(
                f"{name} is kept for reference and not pressed into the gel. Press it with "
                f"--contact mesh:DIR/meshes/{name}.obj@0,0:DEPTH"
            )
        return design

    # ---- shapes

    def _read_parts(self) -> None:
        """Load and repair every part that has a file of its own."""
        parts = self.recipe.parts
        for name, part in parts.items():
            if part.file is not None:
                self.meshes[name] = self.load(part, self.label(name))
        for name in resting_order(parts):
            below = parts[name].on
            assert below is not None  # else it would not rest
            self.meshes[name] = laid_on(self.meshes[name], self.meshes[below], parts[name])
        sized = {
            self.label(name): mesh
            for name, mesh in self.meshes.items()
            if not (parts[name].file or "").lower().endswith(SUFFIXES)
        }
        gels = {self.label(name) for name in self.of(Role.ELASTOMER)}
        self.notes += refuse_odd_units(sized, self.recipe.units, gels)
        for name, mesh in self.meshes.items():
            part, where = self.recipe.parts[name], self.label(name)
            solid = part.role in TRANSPARENT_SOLIDS and part.towards is None
            try:
                mended, notes = repaired(mesh, name, closed=solid)
            except MeshError as error:
                raise MeshError(error.message, where=where, hint=error.hint) from None
            if part.role in OPAQUE_ROLES and part.towards is None:
                gaps = narrow_openings(mended.welded())
                if gaps is not None:
                    notes.append(
                        f"it is a sheet without mass, as it has {gaps}; if it is to be solid, "
                        "close the opening in the CAD tool"
                    )
            self.notes += [f"{name}: {note}" for note in notes]
            mended = mended if part.towards is None else self._chosen(name, mended)
            self.meshes[name] = self._cut(name, mended)
            source = ", body ".join([f"CAD file {part.file}", *part.solids])
            if part.on is not None:
                source += f", laid on {part.on}"
            elif part.mirror or part.turn or part.move:
                source += ", moved as the recipe says"
            self.provenance[f"parts.{name}"] = Provenance(status=Status.SOURCED, source=source)

    def _cut(self, name: str, mesh: TriangleMesh) -> TriangleMesh:
        """Return a mesh with its triangles cut as the recipe wants those of a part.

        Raises:
            DesignError: there would be too many of them.
        """
        spacing = self.recipe.parts[name].cut_every
        if spacing is None:
            return mesh
        try:
            return cut_along_planes(mesh, spacing, MOST_CUT)
        except MeshError as error:
            raise DesignError(
                f"part '{name}': {error.message}",
                where=self.recipe.where("parts", name, "cut_every"),
                hint="Choose a larger cut_every",
            ) from None

    def _pick_faces(self) -> None:
        """Make the parts that are faces of other parts, on the same vertices."""
        for name, part in self.recipe.parts.items():
            if part.faces_of is not None:
                self.meshes[name] = self._chosen(name, self.meshes[part.faces_of])
                self.provenance[f"parts.{name}"] = Provenance(
                    status=Status.DERIVED, source=f"faces of {part.faces_of}"
                )

    def _chosen(self, name: str, mesh: TriangleMesh) -> TriangleMesh:
        """Return the faces of a mesh that the recipe selects for a part."""
        result, notes = chosen(mesh, self.recipe.parts[name], self.label(name))
        self.notes += [f"{name}: {note}" for note in notes]
        return result

    def _refuse_bad(self, name: str, sheet: TriangleMesh) -> None:
        """Refuse a bad solid, as when it is read from a file."""
        try:
            refuse_bad_sheet(sheet, name)
        except MeshError as error:
            raise MeshError(error.message, where=self.label(name), hint=error.hint) from None

    def _lay_skins(self) -> None:
        """Lay the sensing surfaces on the faces of the gel, with normals into it."""
        gels = {n: self.meshes[n] for n in self.of(Role.ELASTOMER)}
        eye = self.recipe.camera.at
        seen_from = np.array(eye) if isinstance(eye, tuple) else None
        for name in self.of(Role.SENSING_SURFACE):
            part, skin = self.recipe.parts[name], self.meshes[name]
            if skin.is_closed:
                raise DesignError(
                    f"part '{name}' is a closed solid; a sensing surface is only its coated side",
                    where=self.label(name),
                    hint="Select the faces with towards: +z (or another side), if needed with "
                    "tangent: true",
                )
            if part.faces_of is None or part.faces_of not in self.solids():
                self._refuse_bad(name, skin)
            notes: list[str] = []
            if part.faces_of is None and gels:
                skin, notes = lay_on_elastomer(name, skin, gels, self.recipe.join)
            if part.faces_of is not None:
                skin = skin.flipped()  # a solid's normals point out of it
            else:
                skin, turned = look_inward(name, skin, self.solids(), seen_from)
                notes += turned
            self.meshes[name] = skin
            self.notes += notes
        if not gels:
            self.notes.append(
                "no part is an elastomer: light reaches the sensing surface through air"
            )

    # ---- the design

    def _materials(self) -> dict[str, Material]:
        """Return the materials of all parts, from the library."""
        used: dict[str, Material] = {}
        for name, part in self.recipe.parts.items():
            material = part.material or USUAL_MATERIAL.get(part.role)
            if material is None:
                continue
            self.check_known("material", material, "parts", name, "material")
            used[material] = library.material(material)
            if part.role not in used[material].roles:
                fitting = kinds_for(part.role)
                raise DesignError(
                    f"part '{name}' ({part.role.value}) can't be made of '{material}', which is "
                    f"a {used[material].kind}",
                    where=self.recipe.where("parts", name, "material"),
                    hint="Choose a material of kind " + " or ".join(fitting)
                    if fitting
                    else "Leave its material out; the coating covers this part",
                )
            if part.material is None:
                self.provenance[f"parts.{name}.material"] = Provenance(
                    status=Status.ASSUMED, source="usual for such a part; the recipe names none"
                )
        self.check_known("coating", self.recipe.coating, "coating")
        return used

    def _design(
        self,
        materials: dict[str, Material],
        priorities: dict[str, int],
        camera: Camera,
        groups: dict[str, LightGroup],
    ) -> SensorDesign:
        """Return the design of the finished parts, lights and camera, without their meshes."""
        coating = library.coating(self.recipe.coating)
        if self.recipe.specularity is not None:
            if "specularity" not in type(coating).model_fields:
                raise DesignError(
                    f"a coating of kind '{coating.kind}' has no specularity",
                    where=self.recipe.where("specularity"),
                    hint="Leave it out",
                )
            setattr(coating, "specularity", self.recipe.specularity)  # noqa: B010
        parts = {
            name: Part(
                role=part.role,
                mesh=f"meshes/{name}.obj",
                material=part.material or USUAL_MATERIAL.get(part.role),
                priority=priorities.get(name, part.priority or 0),
            )
            for name, part in self.recipe.parts.items()
        }
        try:
            return SensorDesign(
                name=self.recipe.name,
                description=self.recipe.description or "made of CAD files",
                coating=coating,
                materials=materials,
                parts=parts,
                lights=groups,
                camera=camera,
                provenance=self.provenance,
            )
        except ValidationError as error:
            raise design_error(error, {}, where=f"recipe of '{self.recipe.name}'") from None

    def _imaged(self, design: SensorDesign) -> SensorDesign:
        """Return the design with the imaging of the library's camera if the recipe wants it.

        Raises:
            LibraryError: the library has no such data on the camera.
        """
        if not self.recipe.camera.imaging:
            return design
        try:
            return library.with_imaging(design, self.recipe.camera.model)
        except LibraryError as error:
            raise LibraryError(
                error.message,
                where=self.recipe.where("camera", "imaging"),
                hint="Leave imaging out, or choose a camera with such data",
            ) from None
