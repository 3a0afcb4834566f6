"""Write a report of the picture, and shapes for the workshop."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core.engine import EngineError
from ..engine import handing, polls, session


class OPTISENSE_OT_report(bpy.types.Operator):
    """Write a page (HTML, one file) about the picture that was simulated last"""

    bl_idname = "optisense.report"
    bl_label = "Write Report"

    filepath: StringProperty(subtype="FILE_PATH")
    filter_glob: StringProperty(default="*.html", options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not polls.is_idle(cls, context):
            return False
        now = context.window_manager.optisense_picture
        if not now.image or now.is_draft or session.running() is None:
            cls.poll_message_set("Simulate a whole picture first")
            return False
        return True

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.filepath = str(Path.home() / f"{context.scene.optisense.title or 'sensor'}.html")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = Path(bpy.path.abspath(self.filepath)).resolve().with_suffix(".html")
        image = context.window_manager.optisense_picture.image

        def written(result: dict[str, Any]) -> None:
            session.state().note = f"Written to {result['file']}"
            session.state().written = result["file"]

        done = session.start_job(
            "Writing", "report", written, wait=bpy.app.background, image=image, file=str(path)
        )
        if not done:
            self.report({"ERROR"}, session.state().problem)
        return {"FINISHED"} if done else {"CANCELLED"}


class OPTISENSE_OT_export(bpy.types.Operator):
    """Write shapes, places of lights and a bill of materials for the workshop"""

    bl_idname = "optisense.export"
    bl_label = "Export for the Workshop"

    filepath: StringProperty(subtype="DIR_PATH")
    stl: BoolProperty(name="STL", default=True)
    obj: BoolProperty(name="OBJ")
    three_mf: BoolProperty(name="3MF")
    step: BoolProperty(name="STEP")

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls.may_ask(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.filepath = str(Path.home() / f"{context.scene.optisense.title or 'sensor'}-workshop")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        chosen = {"stl": self.stl, "obj": self.obj, "3mf": self.three_mf, "step": self.step}
        formats = [name for name, wanted in chosen.items() if wanted]
        if not formats:
            self.report({"ERROR"}, "Choose a format")
            return {"CANCELLED"}
        folder = str(Path(bpy.path.abspath(self.filepath)).resolve())

        def written(result: dict[str, Any]) -> None:
            session.state().note = f"{len(result['files'])} files in {folder}"
            session.state().written = folder

        try:
            design = handing.design(context.scene)
        except EngineError as error:
            session.say(error)
            self.report({"ERROR"}, error.text())
            return {"CANCELLED"}
        done = session.start_job(
            "Writing",
            "export",
            written,
            wait=bpy.app.background,
            design=design,
            to=folder,
            formats=formats,
        )
        if not done:
            self.report({"ERROR"}, session.state().problem)
        return {"FINISHED"} if done else {"CANCELLED"}


CLASSES = (OPTISENSE_OT_report, OPTISENSE_OT_export)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
