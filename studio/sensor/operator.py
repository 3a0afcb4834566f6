"""New, open, save, check."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty

from ..core.engine import EngineError
from ..engine import catalogue, handing, polls, session
from ..scene.paths import chosen, suggested
from .opening import open_source


class _Opens:
    """What new and open have in common."""

    def _open(
        self, context: bpy.types.Context, source: str, folder: str, *, wait: bool
    ) -> set[str]:
        try:
            done = open_source(context.scene, source, folder, wait=wait)
        except EngineError as error:
            session.say(error)
            done = False
        if not done:
            self.report({"ERROR"}, session.state().problem)
        return {"FINISHED"} if done else {"CANCELLED"}


class OPTISENSE_OT_new(_Opens, bpy.types.Operator):
    """Start from a built-in sensor, in place of the one in this scene"""

    bl_idname = "optisense.new"
    bl_label = "New Sensor"
    bl_options = {"REGISTER"}

    sensor: StringProperty(
        name="Sensor", description="The name of a built-in sensor", default="gelsight-mini"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls.is_idle(cls, context) and polls.in_object_mode(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return self._open(context, f"builtin:{self.sensor}", "", wait=False)

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self._open(context, f"builtin:{self.sensor}", "", wait=True)


class OPTISENSE_MT_new(bpy.types.Menu):
    """The built-in sensors"""

    bl_idname = "OPTISENSE_MT_new"
    bl_label = "New Sensor"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator_context = "INVOKE_DEFAULT"
        for name, title, description in catalogue.items("sensors"):
            row = self.layout.row()
            row.enabled = name != "NONE"
            row.operator(OPTISENSE_OT_new.bl_idname, text=description or title).sensor = name


class OPTISENSE_OT_open(_Opens, bpy.types.Operator):
    """Open the design.yaml of a sensor's folder, in place of the sensor in this scene"""

    bl_idname = "optisense.open"
    bl_label = "Open Sensor"
    bl_options = {"REGISTER"}

    filepath: StringProperty(
        name="File", description="A design.yaml, or its folder", subtype="FILE_PATH"
    )
    filter_glob: StringProperty(default="*.yaml", options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls.is_idle(cls, context) and polls.in_object_mode(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        design = context.scene.optisense
        if design.is_saved:
            self.filepath = str(Path(design.folder) / "design.yaml")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = chosen(self, "a design.yaml")
        if path is None:
            return {"CANCELLED"}
        folder = path.parent if path.suffix in (".yaml", ".yml") else path
        return self._open(context, str(folder), str(folder), wait=bpy.app.background)


class _Saves:
    """What save and save as have in common."""

    def _save(self, context: bpy.types.Context, folder: str) -> set[str]:
        scene = context.scene
        try:
            design = handing.design(scene)
        except EngineError as error:
            session.say(error)
            self.report({"ERROR"}, error.text())
            return {"CANCELLED"}
        name = scene.name
        own = scene.optisense.is_saved and Path(scene.optisense.folder) == Path(folder)

        def saved(result: dict[str, Any]) -> None:
            scene = bpy.data.scenes.get(name)
            if scene is not None:
                scene.optisense.folder = result["folder"]
                scene.optisense.is_saved = True
            session.state().note = f"Saved in {result['folder']}"

        wait = bpy.app.background
        done = session.start_job(
            "Saving", "save", saved, wait=wait, design=design, to=folder, only_new=not own
        )
        if not done:
            self.report({"ERROR"}, session.state().problem)
        return {"FINISHED"} if done else {"CANCELLED"}


class OPTISENSE_OT_save(_Saves, bpy.types.Operator):
    """Write the sensor to its folder"""

    bl_idname = "optisense.save"
    bl_label = "Save"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not polls.may_ask(cls, context):
            return False
        if not context.scene.optisense.is_saved:
            cls.poll_message_set("It has no folder yet: use Save As")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self._save(context, context.scene.optisense.folder)


class OPTISENSE_OT_save_as(_Saves, bpy.types.Operator):
    """Write the sensor to a new folder"""

    bl_idname = "optisense.save_as"
    bl_label = "Save As"

    filepath: StringProperty(
        name="Folder", description="That does not exist yet", subtype="DIR_PATH"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls.may_ask(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.filepath = suggested(context.scene)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        folder = chosen(self, "a folder")
        return {"CANCELLED"} if folder is None else self._save(context, str(folder))


class OPTISENSE_OT_check(bpy.types.Operator):
    """Find what is wrong without simulating; the object that it is about is selected"""

    bl_idname = "optisense.check"
    bl_label = "Check"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls.may_ask(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        def checked(result: dict[str, Any]) -> None:
            problems = result["problems"]
            if not problems:
                session.state().note = "The design is in order"
                return
            worst = next((p for p in problems if p["severity"] == "error"), problems[0])
            session.say(EngineError({"kind": "DesignError", **worst}))

        design = handing.design_for(self, context.scene)
        if design is None:
            return {"CANCELLED"}
        session.start_job("Checking", "check", checked, wait=bpy.app.background, design=design)
        return {"FINISHED"}


class OPTISENSE_OT_start_engine(bpy.types.Operator):
    """Start the engine, which makes pictures, scores and searches"""

    bl_idname = "optisense.start_engine"
    bl_label = "Start the Engine"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if session.running() is not None:
            cls.poll_message_set("It runs")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        session.restart()
        return {"FINISHED"}


class OPTISENSE_OT_cancel(bpy.types.Operator):
    """Give up what the engine is working on"""

    bl_idname = "optisense.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not session.is_busy():
            cls.poll_message_set("Nothing is going on")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        session.cancel_job()
        return {"FINISHED"}


CLASSES = (
    OPTISENSE_OT_new,
    OPTISENSE_MT_new,
    OPTISENSE_OT_open,
    OPTISENSE_OT_save,
    OPTISENSE_OT_save_as,
    OPTISENSE_OT_check,
    OPTISENSE_OT_start_engine,
    OPTISENSE_OT_cancel,
)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
