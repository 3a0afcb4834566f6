"""New, open, save, check."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty

from ..core.engine import EngineError
from ..engine import catalogue, design_transfer, polls, session
from ..engine.operators import ChoosingFile, Starting, fail, report_error, start
from ..scene.drawings import ignored_edits
from ..scene.paths import chosen, suggested
from ..scene.subject import Subject
from .opening import digests, open_empty, open_source, saved_in


class _Opens:
    """Base of the operators that open a sensor."""

    def _open(
        self, context: bpy.types.Context, source: str, folder: str, *, wait: bool
    ) -> set[str]:
        try:
            done = open_source(context.scene, source, folder, wait=wait)
        except EngineError as error:
            return fail(self, error)
        return {"FINISHED"} if done else report_error(self, session.state().problem)


class OPTISENSE_OT_new(polls.Replacing, _Opens, Starting, bpy.types.Operator):
    """Start from a built-in sensor, in place of the one in this scene"""

    bl_idname = "optisense.new"
    bl_label = "New Sensor"
    bl_options = {"REGISTER"}

    sensor: StringProperty(
        name="Sensor", description="Name of a built-in sensor", default="gelsight-mini"
    )

    def start(self, context: bpy.types.Context, *, wait: bool) -> set[str]:
        return self._open(context, f"builtin:{self.sensor}", "", wait=wait)


class OPTISENSE_OT_new_empty(polls.Replacing, bpy.types.Operator):
    """Start a sensor of your own: no part, no light and no camera yet; references stay"""

    bl_idname = "optisense.new_empty"
    bl_label = "Empty"
    bl_options = {"REGISTER"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            catalogue.learn_kinds()
            document = session.ask_and_wait("empty")["data"]
        except EngineError as error:
            return fail(self, error)
        open_empty(context.scene, design_transfer.without_nulls(document))
        return {"FINISHED"}


class OPTISENSE_MT_new(bpy.types.Menu):
    """The built-in sensors"""

    bl_label = "New Sensor"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator_context = "INVOKE_DEFAULT"
        for name, title, description in catalogue.items("sensors"):
            row = self.layout.row()
            row.enabled = name != "NONE"
            row.operator(OPTISENSE_OT_new.bl_idname, text=description or title).sensor = name
        self.layout.separator()
        self.layout.operator(OPTISENSE_OT_new_empty.bl_idname, icon="FILE_NEW")
        self.layout.operator("optisense.cad_files", text="From CAD Files ...", icon="IMPORT")


class OPTISENSE_OT_open(polls.Replacing, _Opens, ChoosingFile, bpy.types.Operator):
    """Open the design.yaml of a sensor's folder, in place of the sensor in this scene"""

    bl_idname = "optisense.open"
    bl_label = "Open Sensor"
    bl_options = {"REGISTER"}

    filepath: StringProperty(
        name="File",
        description="File design.yaml, or the folder that contains it",
        subtype="FILE_PATH",
    )
    filter_glob: StringProperty(default="*.yaml", options={"HIDDEN"})

    def suggested(self, context: bpy.types.Context) -> str:
        design = context.scene.optisense
        return str(Path(design.folder) / "design.yaml") if design.is_saved else self.filepath

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = chosen(self, "a design.yaml")
        if path is None:
            return {"CANCELLED"}
        folder = path.parent if path.suffix in (".yaml", ".yml") else path
        return self._open(context, str(folder), str(folder), wait=bpy.app.background)


class _Saves:
    """Base of the operators that save a sensor."""

    def _save(self, context: bpy.types.Context, folder: str) -> set[str]:
        scene = context.scene
        try:
            design = design_transfer.design(scene)
        except EngineError as error:
            return fail(self, error)
        subject = Subject(scene)
        own = scene.optisense.is_saved and Path(scene.optisense.folder) == Path(folder)

        known = {"digest": digests[folder]} if own and folder in digests else {}

        def saved(result: dict[str, Any]) -> None:
            if result.get("digest"):
                digests[result["folder"]] = result["digest"]
            scene = subject.scene
            if scene is not None:
                saved_in(scene, result["folder"])
            session.state().note = f"Saved in {result['folder']}"

        wait = bpy.app.background
        return start(
            self, "Saving", "save", saved, subject=subject, wait=wait, design=design, to=folder,
            only_new=not own, **known,
        )  # fmt: skip


class OPTISENSE_OT_save(polls.Checked, _Saves, bpy.types.Operator):
    """Write the sensor to its folder"""

    bl_idname = "optisense.save"
    bl_label = "Save"

    checks = (
        *polls.ASKING,
        polls.requires(
            lambda c: c.scene.optisense.is_saved, "This sensor has no folder yet: use Save As"
        ),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self._save(context, context.scene.optisense.folder)


class OPTISENSE_OT_save_as(polls.Asking, _Saves, ChoosingFile, bpy.types.Operator):
    """Write the sensor to a new folder"""

    bl_idname = "optisense.save_as"
    bl_label = "Save As"

    filepath: StringProperty(
        name="Folder",
        description="New folder for the design; it must not exist yet",
        subtype="DIR_PATH",
    )

    def suggested(self, context: bpy.types.Context) -> str:
        return suggested(context.scene)

    def execute(self, context: bpy.types.Context) -> set[str]:
        folder = chosen(self, "a folder")
        return {"CANCELLED"} if folder is None else self._save(context, str(folder))


class OPTISENSE_OT_check(polls.Asking, bpy.types.Operator):
    """Check the design without simulating it; the object with the worst problem is selected"""

    bl_idname = "optisense.check"
    bl_label = "Check"

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            design = design_transfer.design(context.scene)
        except EngineError as error:
            return fail(self, error)
        subject = Subject(context.scene)
        # Other warnings may follow from edits that are ignored.
        ignored = ignored_edits(context.scene)

        def checked(result: dict[str, Any]) -> None:
            problems = [*ignored, *result["problems"]]
            if not problems:
                session.state().note = "The design is in order"
                return
            worst = next((p for p in problems if p["severity"] == "error"), problems[0])
            session.say(EngineError({"kind": "DesignError", **worst}), subject)

        session.start_job(
            "Checking", "check", checked, subject=subject, wait=bpy.app.background, design=design
        )
        return {"FINISHED"}  # the panels show what is wrong with the design


class OPTISENSE_OT_start_engine(polls.Checked, bpy.types.Operator):
    """Start the engine, which makes pictures, scores and searches"""

    bl_idname = "optisense.start_engine"
    bl_label = "Start the Engine"

    checks = (polls.requires(lambda c: session.running() is None, "The engine is running already"),)

    def execute(self, context: bpy.types.Context) -> set[str]:
        session.restart()
        return {"FINISHED"}


class OPTISENSE_OT_cancel(polls.Checked, bpy.types.Operator):
    """Cancel the job that the engine is working on"""

    bl_idname = "optisense.cancel"
    bl_label = "Cancel"

    checks = (polls.requires(lambda c: session.is_busy(), "No job is running"),)

    def execute(self, context: bpy.types.Context) -> set[str]:
        session.cancel_job()
        return {"FINISHED"}
