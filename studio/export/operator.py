"""Write a report of the picture, shapes for the workshop, and models for robot simulators."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..engine import polls, session
from ..engine.operators import ChoosingFile, refuse, start, start_with_design
from ..scene.paths import chosen, suggested


def _can_report(context: bpy.types.Context) -> bool:
    now = context.window_manager.optisense_picture
    is_whole = bool(now.image) and now.is_of(context.scene) and not now.is_draft
    return is_whole and session.running() is not None


class OPTISENSE_OT_report(polls.Checked, ChoosingFile, bpy.types.Operator):
    """Write a page (HTML, one file) about the picture that was simulated last"""

    bl_idname = "optisense.report"
    bl_label = "Write Report"

    filepath: StringProperty(
        name="File", description="File of the report, an HTML page", subtype="FILE_PATH"
    )
    check_existing: BoolProperty(default=True, options={"HIDDEN"})
    filter_glob: StringProperty(default="*.html", options={"HIDDEN"})

    checks = (polls.is_idle, polls.requires(_can_report, "Simulate a whole picture first"))

    def suggested(self, context: bpy.types.Context) -> str:
        return suggested(context.scene, ".html")

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = chosen(self, "a file")
        if path is None:
            return {"CANCELLED"}
        if path.is_dir():
            return refuse(self, f"{path} is a folder; name a file in it")
        if path.suffix.lower() not in (".html", ".htm"):
            path = path.with_name(f"{path.name}.html")
        image = context.window_manager.optisense_picture.image

        def written(result: dict[str, Any]) -> None:
            session.state().note = f"Written to {result['file']}"
            session.state().written = result["file"]

        return start(self, "Writing", "report", written, image=image, file=str(path))


def _export(
    operator: Any, context: bpy.types.Context, request: str, formats: list[str], **fields: Any
) -> set[str]:
    """Let the engine write files in these formats into the folder that the operator names."""
    if not formats:
        return refuse(operator, "Tick at least one file format")
    target = chosen(operator, "a folder")
    if target is None:
        return {"CANCELLED"}
    folder = str(target)

    def written(result: dict[str, Any]) -> None:
        session.state().note = "; ".join(
            [f"{len(result['files'])} files in {folder}", *result.get("notes", [])]
        )
        session.state().written = folder

    return start_with_design(
        operator, context, "Writing", request, written, to=folder, formats=formats, **fields
    )


class OPTISENSE_OT_export(polls.Asking, ChoosingFile, bpy.types.Operator):
    """Write shapes, places of lights and a bill of materials for the workshop"""

    bl_idname = "optisense.export"
    bl_label = "Export for the Workshop"

    filepath: StringProperty(
        name="Folder", description="Folder into which the files are written", subtype="DIR_PATH"
    )
    stl: BoolProperty(
        name="STL", description="Write triangle meshes in mm for 3D printing", default=True
    )
    obj: BoolProperty(name="OBJ", description="Write triangle meshes in mm for modelling programs")
    three_mf: BoolProperty(
        name="3MF", description="Write triangle meshes with their unit for 3D printing"
    )
    step: BoolProperty(
        name="STEP",
        description="Write solids for CAD programs; needs the extra 'step' of the package",
    )

    moulds: BoolProperty(
        name="Moulds", description="Write the moulds in which the gels are cast, too"
    )

    def suggested(self, context: bpy.types.Context) -> str:
        return suggested(context.scene, "-workshop")

    def execute(self, context: bpy.types.Context) -> set[str]:
        wanted = {"stl": self.stl, "obj": self.obj, "3mf": self.three_mf, "step": self.step}
        formats = [name for name, is_wanted in wanted.items() if is_wanted]
        return _export(self, context, "export", formats=formats, moulds=self.moulds)


class OPTISENSE_OT_export_robot(polls.Asking, ChoosingFile, bpy.types.Operator):
    """Write a model for robot simulators: meshes in metres, mass, frames of camera and skin"""

    bl_idname = "optisense.export_robot"
    bl_label = "Export for a Robot"

    filepath: StringProperty(
        name="Folder", description="Folder into which the files are written", subtype="DIR_PATH"
    )
    mujoco: BoolProperty(
        name="MuJoCo",
        description="Write a body with a camera and a touch sensor (MJCF)",
        default=True,
    )
    urdf: BoolProperty(
        name="URDF",
        description="Write links for the sensor, its camera and its skin, as ROS and others read",
        default=True,
    )
    mass: FloatProperty(
        name="Mass (g)",
        description="Mass of the whole sensor, g; with 0 it follows from the parts' densities",
        min=0.0,
        soft_max=1000.0,
        precision=1,
    )

    def suggested(self, context: bpy.types.Context) -> str:
        return suggested(context.scene, "-robot")

    def execute(self, context: bpy.types.Context) -> set[str]:
        formats = [name for name in ("mujoco", "urdf") if getattr(self, name)]
        if not formats:
            return refuse(self, "Tick at least one file format")
        mass = {"mass": self.mass} if self.mass > 0.0 else {}
        return _export(self, context, "export_robot", formats=formats, **mass)
