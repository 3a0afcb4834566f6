"""Choose, preview, apply, edit and keep materials."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty, StringProperty

from ..core import schema
from ..core.engine import EngineError
from ..engine import catalogue, design_transfer, polls, session
from ..engine.operators import fail, refuse, start
from ..scene.build import add_material, set_coating
from ..scene.gather import coating_values, free_name, material_values
from . import gallery

KEEPING = "Keeping the material"
"""Title under which messages are shown beside the button that was pressed."""

_active = ""
"""Name of the active part whose selection was followed last; empty for none."""


def _materials(values: Any, context: bpy.types.Context | None) -> catalogue.Items:
    return gallery.items("material")


def _coatings(values: Any, context: bpy.types.Context | None) -> catalogue.Items:
    return gallery.items("coating")


class OPTISENSE_PG_material_choice(bpy.types.PropertyGroup):
    """Chosen entry of the library, and its preview."""

    kind: EnumProperty(
        name="For",
        items=[
            ("material", "Parts", "Optical materials"),
            ("coating", "Sensing surface", "Coatings"),
        ],
        description="Kind of library entries to choose from",
        options={"SKIP_SAVE"},
    )
    material: EnumProperty(
        name="Material",
        items=_materials,
        description="Material of the library",
        options={"SKIP_SAVE"},
    )
    coating: EnumProperty(
        name="Coating", items=_coatings, description="Coating of the library", options={"SKIP_SAVE"}
    )
    preview: StringProperty(description="File of the preview picture", options={"SKIP_SAVE"})
    previewed: StringProperty(
        description="Name of the entry in the preview picture", options={"SKIP_SAVE"}
    )

    @property
    def entry(self) -> str:
        """Name of the chosen entry in the library; empty while the library is not loaded."""
        name = self.material if self.kind == "material" else self.coating
        return "" if name == "NONE" else name


def _choice(context: bpy.types.Context) -> OPTISENSE_PG_material_choice:
    return context.window_manager.optisense_material


_chosen = polls.requires(lambda c: _choice(c).entry, "The library is not loaded yet")


def _is_for_a_coating(context: bpy.types.Context) -> bool:
    """Return whether the sensing surface is selected, or the chosen entry is no coating."""
    return _choice(context).kind != "coating" or any(_are_coated(context))


def _is_for_a_material(context: bpy.types.Context) -> bool:
    """Return whether a part but the sensing surface is selected, or the entry is no material."""
    return _choice(context).kind != "material" or not all(_are_coated(context))


def _are_coated(context: bpy.types.Context) -> list[bool]:
    parts = polls.picked(context, "PART")
    return [each.optisense.role == "sensing_surface" for each in parts]


def _part(context: bpy.types.Context) -> bpy.types.PropertyGroup | None:
    """Return the properties of the active part, or None."""
    active = context.active_object
    is_part = active is not None and active.optisense.kind == "PART"
    return active.optisense if is_part else None


def _is_made_of_something(context: bpy.types.Context) -> bool:
    own = _part(context)
    return own.role == "sensing_surface" or own.material in context.scene.optisense.materials


class OPTISENSE_OT_preview_material(polls.Checked, bpy.types.Operator):
    """Draw the chosen material"""

    bl_idname = "optisense.preview_material"
    bl_label = "Preview Material"

    checks = (_chosen, polls.is_idle)

    def execute(self, context: bpy.types.Context) -> set[str]:
        choice = _choice(context)
        entry = choice.entry

        def drawn(result: dict[str, Any]) -> None:
            choice = _choice(bpy.context)
            choice.preview = result["files"]["picture"]
            choice.previewed = entry
            session.redraw()

        title = "Drawing the material"
        return start(self, title, "preview", drawn, kind=choice.kind, entry=entry, name="material")


class OPTISENSE_OT_material_pictures(polls.Checked, bpy.types.Operator):
    """Draw pictures of all library entries of this kind, to choose from"""

    bl_idname = "optisense.material_pictures"
    bl_label = "Show Pictures"

    checks = (
        _chosen,
        polls.requires(
            lambda c: gallery.missing(_choice(c).kind), "All pictures are drawn, or are being drawn"
        ),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        gallery.draw_missing(_choice(context).kind)
        return {"FINISHED"}


class OPTISENSE_OT_apply_material(polls.Checked, bpy.types.Operator):
    """Assign the chosen material to the selected parts, or the coating to the sensing surface"""

    bl_idname = "optisense.apply_material"
    bl_label = "Apply to Selected"
    bl_options = {"REGISTER", "UNDO"}

    checks = (
        polls.has_design,
        _chosen,
        polls.selecting("PART", what="a part"),
        polls.requires(_is_for_a_coating, "Select the sensing surface: coatings are for it only"),
        polls.requires(_is_for_a_material, "The sensing surface takes a coating, not a material"),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        choice = _choice(context)
        name = choice.entry
        try:
            catalogue.learn_kinds()
            entry = session.ask_and_wait("entry", kind=choice.kind, entry=name)["entry"]
        except EngineError as error:
            return fail(self, error)
        values = design_transfer.without_nulls(entry["value"])
        design = context.scene.optisense
        if choice.kind == "coating":
            set_coating(context.scene, {"library": name, **values})
            return {"FINISHED"}
        parts = [
            each
            for each in context.selected_objects
            if each.optisense.kind == "PART" and each.optisense.role != "sensing_surface"
        ]
        for part in parts:
            fitting = schema.materials_of(part.optisense.role)
            if values["kind"] not in fitting:
                self.report(
                    {"ERROR"},
                    f"'{part.optisense.key}' ({part.optisense.role.replace('_', ' ')}) needs a "
                    f"material of kind {' or '.join(fitting)}; {name} is a {values['kind']}",
                )
                return {"CANCELLED"}
        add_material(design, name, values)
        for part in parts:
            part.optisense.material = name
        return {"FINISHED"}


class OPTISENSE_OT_keep_material(polls.Checked, bpy.types.Operator):
    """Keep the material of the active part (or the coating) in the library, as your own"""

    bl_idname = "optisense.keep_material"
    bl_label = "Save as My Own"

    name: StringProperty(
        name="Name", default="my-material",
        description="Letters, digits, - and _; no entry of the library may have this name",
    )  # fmt: skip
    description: StringProperty(
        name="Description", description="One line that is shown in the lists"
    )
    source: StringProperty(
        name="Source of its numbers", default="chosen by hand",
        description="Where the numbers come from: a datasheet, a paper or a measurement",
    )  # fmt: skip

    checks = (
        *polls.ASKING,
        polls.requires(_part, "Select a part first"),
        polls.requires(_is_made_of_something, "This part has no material"),
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self, width=400)

    def execute(self, context: bpy.types.Context) -> set[str]:
        own = context.active_object.optisense
        if own.role == "sensing_surface":
            kind, values = "coating", coating_values(context.scene)
            values.pop("library", None)
        else:
            kind = "material"
            values = material_values(context.scene.optisense.materials[own.material])
        name = free_name(self.name, (), "")
        if not name:
            return refuse(self, "The name needs a letter from A to Z, or a digit")
        now = session.state()
        now.about, now.problem, now.hint, now.note = KEEPING, "", "", ""
        try:
            session.ask_and_wait(
                "library_add",
                kind=kind,
                entry=name,
                value=values,
                description=self.description or name,
                source=self.source,
            )
        except EngineError as error:
            return fail(self, error, KEEPING)
        begun = gallery.is_begun(kind)
        gallery.forget(kind, name)

        def listed() -> None:
            if begun:  # the others have pictures
                gallery.draw_missing(kind)

        catalogue.refresh_library(session.engine(), kind, listed)
        now.note = f"'{name}' is in your library"
        return {"FINISHED"}


@bpy.app.handlers.persistent
def _follow(scene: bpy.types.Scene, *_: object) -> None:
    """Offer coatings once the sensing surface is selected, and materials once another part is."""
    global _active
    own = _part(bpy.context) if bpy.context.view_layer else None
    name = own.id_data.name if own is not None and own.id_data.select_get() else ""
    if own is not None and name not in ("", _active):
        kind = "coating" if own.role == "sensing_surface" else "material"
        _choice(bpy.context).kind = kind
    _active = name


PROPERTIES = {"WindowManager": {"optisense_material": OPTISENSE_PG_material_choice}}
HOOKS = ((bpy.app.handlers.depsgraph_update_post, _follow),)
