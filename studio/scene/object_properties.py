"""The role of an object in the design, and its properties."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
    StringProperty,
)

from . import kinds


def _camera_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .cameras import show

    show(values.id_data)


def _contact_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .contacts import redraw

    redraw(values.id_data)


def _role_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    values.id_data.color = kinds.LOOKS[values.role]


def _blend_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .cages import show_blend

    show_blend(values.id_data)


class OPTISENSE_PG_object(bpy.types.PropertyGroup):
    """Role of an object in the design, and its properties."""

    kind: EnumProperty(
        name="Kind", items=kinds.OBJECT_KINDS, description="What it is to the sensor"
    )
    key: StringProperty(name="Name", description="In the design file")
    order: IntProperty(description="Its place in the design file", options={"HIDDEN"})
    data: StringProperty(
        description="Its values as they were read, with their numbers in full", options={"HIDDEN"}
    )

    role: EnumProperty(
        name="Role", items=kinds.ROLES, update=_role_changed,
        description="What the part does in the sensor",
    )  # fmt: skip
    material: StringProperty(name="Material", description="What the part is made of")
    priority: IntProperty(
        name="Priority", description="Where solids overlap, the higher one counts",
        min=-1000, max=1000,
    )  # fmt: skip
    mesh_file: StringProperty(options={"HIDDEN"})
    is_caged: BoolProperty(description="A cage holds it where it is", options={"HIDDEN"})

    reference: EnumProperty(
        name="Reference", items=kinds.REFERENCES, description="What the mesh is for"
    )

    group: StringProperty(name="Group", description="The light group it belongs to")

    model: StringProperty(name="Model", description="The library camera it started from")
    projection: EnumProperty(
        name="Projection", items=kinds.PROJECTIONS, update=_camera_changed,
        description="How the lens maps angles to the picture",
    )  # fmt: skip
    fov: FloatProperty(
        name="Field of view", description="Degrees, across the image width", min=0.01, max=360.0,
        default=60.0, precision=3, update=_camera_changed,
    )  # fmt: skip
    pixels: IntVectorProperty(
        name="Resolution", description="Pixels, width and height", size=2, min=1, max=65536,
        default=(320, 240), update=_camera_changed,
    )  # fmt: skip

    blend: FloatProperty(
        name="Blend", description="A: 0 is C_min, 1 is C_max", min=0.0, max=1.0, precision=3,
        update=_blend_changed,
    )  # fmt: skip

    indenter: EnumProperty(
        name="Indenter", items=kinds.INDENTERS, update=_contact_changed,
        description="The shape of what presses",
    )  # fmt: skip
    radius: FloatProperty(
        name="Radius",
        description="mm, of the ball or cylinder",
        min=0.01,
        max=1000.0,
        default=1.5,
        update=_contact_changed,
    )
    length: FloatProperty(
        name="Length",
        description="mm, of the cylinder",
        min=0.01,
        max=1000.0,
        default=8.0,
        update=_contact_changed,
    )
    tilt: FloatVectorProperty(
        name="Tilt", description="Degrees about x and y", size=2, min=-80.0, max=80.0,
        update=_contact_changed,
    )  # fmt: skip
    size: FloatProperty(
        name="Size", description="mm, width of the plane", min=0.01, max=1000.0, default=8.0,
        update=_contact_changed,
    )  # fmt: skip
    file: StringProperty(
        name="Mesh", description="A file (OBJ, STL, PLY) whose lowest point touches first",
        subtype="FILE_PATH", update=_contact_changed,
    )  # fmt: skip
    shape: PointerProperty(
        type=bpy.types.Mesh, name="Shape", update=_contact_changed,
        description="The reference's shape, which presses where no file is named",
    )  # fmt: skip
    scale: FloatProperty(
        name="Scale", description="From the file's units to mm", min=1e-6, max=1e6, default=1.0,
        update=_contact_changed,
    )  # fmt: skip
    depth: FloatProperty(
        name="Depth", description="mm, how far it is pressed in", min=0.001, max=100.0,
        default=0.6, precision=3, update=_contact_changed,
    )  # fmt: skip
    rotation: FloatProperty(
        name="Rotation", description="Degrees about the outward normal", update=_contact_changed
    )
    press_by: EnumProperty(
        name="Press by", items=kinds.PRESSING, update=_contact_changed,
        description="What is given: how deep it is, or how hard it presses",
    )  # fmt: skip
    force: FloatProperty(
        name="Force", description="N, along the inward normal; it is drawn as if it were at the "
        "depth that was given last", min=0.001, max=1000.0, default=1.0, precision=3,
        update=_contact_changed,
    )  # fmt: skip
    shift: FloatVectorProperty(
        name="Shift", description="mm along the skin by which it is dragged after it was pressed "
        "in: the skin sticks to it as far as friction goes", size=2, min=-100.0, max=100.0,
        precision=3, update=_contact_changed,
    )  # fmt: skip
    twist: FloatProperty(
        name="Twist", description="Degrees about the outward normal by which it is turned after "
        "it was pressed in", min=-180.0, max=180.0, update=_contact_changed,
    )  # fmt: skip


PROPERTIES = {"Object": {"optisense": OPTISENSE_PG_object}}
