"""Sensor from the user's CAD files: a table with the use of each body, which the user confirms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty

from ..core.engine import EngineError
from ..engine import polls, session
from ..engine.layout import labelled, show_job
from ..engine.operators import fail, start
from ..scene.kinds import ROLES
from ..scene.paths import absolute
from ..scene.subject import scene_of
from .opening import new_stage, open_stage, tell_opened
from .workspace import show_sidebar

READING, MAKING = "Reading the files", "Making the sensor"
FORMATS = "*.obj;*.stl;*.ply;*.step;*.stp"

USES = [
    *ROLES,
    ("lights", "Lights", "A light on each of its faces that point to the gel"),
    ("camera", "Camera", "The camera's pupil is in its middle"),
    ("nothing", "Left out", "No part of the sensor"),
]

NAMES = 0.6
"""Share of a line of the table that name and size of a body take; the rest is its use."""

UNITS = [
    (name, name, f"Lengths in the files are in {words}")
    for name, words in (
        ("mm", "millimetres"), ("cm", "centimetres"), ("m", "metres"), ("inch", "inches"),
        ("mil", "thousandths of an inch"), ("um", "micrometres"),
    )
]  # fmt: skip


class OPTISENSE_PG_body(bpy.types.PropertyGroup):
    """Body of the files; its name is that of the part that it becomes."""

    use: EnumProperty(name="Use", items=USES, description="Function of this body in the sensor")
    size: StringProperty(description="Size of the body in words", options={"HIDDEN"})


class OPTISENSE_PG_cad(bpy.types.PropertyGroup):
    """Files of which a sensor is to be made; never saved."""

    bodies: CollectionProperty(type=OPTISENSE_PG_body)
    files: StringProperty(description="Paths of the files, one a line", options={"HIDDEN"})
    units: EnumProperty(
        name="Units", items=UNITS, description="Unit of the lengths in files that do not state it"
    )
    has_units: BoolProperty(description="Whether all files state their units", options={"HIDDEN"})


def now() -> bpy.types.PropertyGroup:
    """Return the files in the table."""
    return bpy.context.window_manager.optisense_cad


class ChoosingFiles:
    """Base of operators that ask for one or several CAD files of a folder, or for the folder; files
    that were dropped on the 3D view are not asked for.
    """

    filepath: StringProperty(
        name="File", description="CAD file to read", subtype="FILE_PATH", options={"SKIP_SAVE"}
    )
    directory: StringProperty(
        name="Folder",
        description="Folder of the selected files",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement,
        name="Files",
        description="Selected files of the folder",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default=FORMATS, options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.directory and self.files:  # they were dropped
            show_sidebar(context)
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def paths(self) -> list[str]:
        """Return the absolute paths that were chosen."""
        names = [each.name for each in self.files if each.name]
        if self.directory and names:
            return [str(absolute(str(Path(self.directory) / name))) for name in names]
        return [str(absolute(self.filepath or self.directory))]


class OPTISENSE_OT_cad_files(polls.Replacing, ChoosingFiles, bpy.types.Operator):
    """Make a sensor of CAD files (STEP, STL, OBJ, PLY): select all of them, or open their folder"""

    bl_idname = "optisense.cad_files"
    bl_label = "Sensor from CAD Files"
    bl_options = {"REGISTER"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        paths = self.paths()
        # The panel with the table may be closed, and the pointer elsewhere: files were dropped.
        self.report({"INFO"}, "Check the use of each body in the panel Sensor")

        def read(result: dict[str, Any]) -> None:
            found = now()
            found.bodies.clear()
            found.files = "\n".join(paths)
            found.has_units = all(each["own_units"] for each in result["bodies"])
            found.units = result["units"]
            for each in result["bodies"]:
                row = found.bodies.add()
                row.name, row.use = each["name"], each["use"]
                row.size = " x ".join(f"{length:.3g}" for length in each["size"])
            session.redraw()

        return start(self, READING, "cad", read, files=paths, name="cad")


class _Dropped:
    """Base of the handlers of CAD files that are dropped on the 3D view."""

    bl_file_extensions = FORMATS.replace("*", "")

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"


class OPTISENSE_FH_new(_Dropped, bpy.types.FileHandler):
    bl_idname = "OPTISENSE_FH_new"
    bl_label = "OptiSense: A Sensor of These Parts"
    bl_import_operator = OPTISENSE_OT_cad_files.bl_idname


class OPTISENSE_FH_reference(_Dropped, bpy.types.FileHandler):
    bl_idname = "OPTISENSE_FH_reference"
    bl_label = "OptiSense: References for This Sensor"
    bl_import_operator = "optisense.add_mesh"

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return super().poll_drop(context) and context.scene.optisense.is_open


class OPTISENSE_OT_make_from_cad(polls.Replacing, bpy.types.Operator):
    """Make the sensor of these bodies, with default lights and a default camera at first"""

    bl_idname = "optisense.make_from_cad"
    bl_label = "Make the Sensor"
    bl_options = {"REGISTER"}

    checks = (
        *polls.Replacing.checks,
        polls.requires(lambda c: c.window_manager.optisense_cad.bodies, "Choose CAD files first"),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        found, number, wait = now(), context.scene.session_uid, bpy.app.background
        try:
            stage = new_stage()
        except EngineError as error:
            return fail(self, error, MAKING)
        fields: dict[str, Any] = {} if found.has_units else {"units": found.units}

        def made(result: dict[str, Any]) -> None:
            scene = scene_of(number)
            if scene is None:
                return
            now().bodies.clear()
            notes = result["notes"]

            def tell(scene: bpy.types.Scene, draft: str | None) -> None:
                tell_opened(scene, draft)
                session.state().note = "; ".join(notes) or session.state().note

            open_stage(scene, stage, wait=wait, then=tell)

        return start(
            self,
            MAKING,
            "from_cad",
            made,
            files=found.files.split("\n"),
            uses={each.name: each.use for each in found.bodies},
            to=str(stage),
            **fields,
        )


class OPTISENSE_OT_forget_cad(bpy.types.Operator):
    """Discard these files without making a sensor"""

    bl_idname = "optisense.forget_cad"
    bl_label = "Cancel"

    def execute(self, context: bpy.types.Context) -> set[str]:
        now().bodies.clear()
        return {"FINISHED"}


def draw(layout: bpy.types.UILayout) -> None:
    """Draw the table: each body with its size in the units of the files, and its use."""
    show_job(layout, READING, MAKING)
    found = now()
    if not found.bodies or session.is_busy():
        return
    box = layout.box()
    box.label(text="Use of each body", icon="IMPORT")
    column = box.column(align=True)
    for each in found.bodies:
        row = column.split(factor=NAMES, align=True)
        row.label(text=f"{each.name}  {each.size}")
        row.prop(each, "use", text="")
    if not found.has_units:
        labelled(box).prop(found, "units")
    row = box.row(align=True)
    row.operator("optisense.make_from_cad", icon="CHECKMARK")
    row.operator("optisense.forget_cad", text="", icon="X")


PROPERTIES = {"WindowManager": {"optisense_cad": OPTISENSE_PG_cad}}
