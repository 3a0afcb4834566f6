"""Write a report of the picture, and shapes for the workshop."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ..engine import handing, polls, session
from ..scene.paths import chosen, suggested


class OPTISENSE_OT_report(bpy.types.Operator):
    """Write a page (HTML, one file) about the picture that was simulated last"""

    bl_idname = "optisense.report"
    bl_label = "Write Report"

    filepath: StringProperty(name="File", description="The page to write", subtype="FILE_PATH")
    check_existing: BoolProperty(default=True, options={"HIDDEN"})
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
        self.filepath = suggested(context.scene, ".html")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = chosen(self, "a file")
        if path is None:
            return {"CANCELLED"}
        if path.is_dir():
            self.report({"ERROR"}, f"{path} is a folder; name a file in it")
            return {"CANCELLED"}
        if path.suffix.lower() not in (".html", ".htm"):
            path = path.with_name(f"{path.name}.html")
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

    filepath: StringProperty(name="Folder", description="Where to", subtype="DIR_PATH")
    stl: BoolProperty(name="STL", description="Triangles, for printing; in mm", default=True)
    obj: BoolProperty(name="OBJ", description="Triangles, for modelling programs; in mm")
    three_mf: BoolProperty(name="3MF", description="Triangles with their unit, for printing")
    step: BoolProperty(
        name="STEP", description="Solids, for CAD; needs the extra 'step' of the package"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return polls.may_ask(cls, context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.filepath = suggested(context.scene, "-workshop")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        wanted = {"stl": self.stl, "obj": self.obj, "3mf": self.three_mf, "step": self.step}
        formats = [name for name, is_wanted in wanted.items() if is_wanted]
        if not formats:
            self.report({"ERROR"}, "Choose a format")
            return {"CANCELLED"}
        target = chosen(self, "a folder")
        if target is None:
            return {"CANCELLED"}
        folder = str(target)

        def written(result: dict[str, Any]) -> None:
            session.state().note = f"{len(result['files'])} files in {folder}"
            session.state().written = folder

        design = handing.design_for(self, context.scene)
        if design is None:
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
