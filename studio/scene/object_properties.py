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
    from .contacts import hold_contacts

    values.id_data.color = kinds.LOOKS[values.role]
    if values.role == "sensing_surface":
        for scene in values.id_data.users_scene:
            hold_contacts(scene)


def _blend_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .cages import show_blend

    show_blend(values.id_data)


class OPTISENSE_PG_object(bpy.types.PropertyGroup):
    """Role of an object in the design, and its properties."""

    kind: EnumProperty(
        name="Kind", items=kinds.OBJECT_KINDS, description="Kind of object in the sensor"
    )
    key: StringProperty(name="Name", description="Name of the object in the design file")
    source: StringProperty(
        description="Name in the design file as it was read of the part of which this one is a "
        "copy; empty for other objects",
        options={"HIDDEN"},
    )
    order: IntProperty(description="Position of the object in the design file", options={"HIDDEN"})
    data: StringProperty(
        description="Values as they were read, in full precision", options={"HIDDEN"}
    )

    role: EnumProperty(
        name="Role", items=kinds.ROLES, update=_role_changed,
        description="Function of the part in the sensor",
    )  # fmt: skip
    material: StringProperty(name="Material", description="Material of the part")
    priority: IntProperty(
        name="Priority", description="Where two solids overlap, the material of the one with the "
        "higher priority is used",
        min=-1000, max=1000,
    )  # fmt: skip
    mesh_file: StringProperty(options={"HIDDEN"})
    is_caged: BoolProperty(description="Whether the part is in a cage", options={"HIDDEN"})

    reference: EnumProperty(name="Reference", items=kinds.REFERENCES, description="Use of the mesh")

    group: StringProperty(name="Group", description="Light group of the light")

    model: StringProperty(
        name="Model", description="Camera of the library from which this one was made"
    )
    projection: EnumProperty(
        name="Projection", items=kinds.PROJECTIONS, update=_camera_changed,
        description="Projection of the lens: how it maps angles to the picture",
    )  # fmt: skip
    fov: FloatProperty(
        name="Field of view",
        description="Angle of view across the width of the picture, degrees",
        min=0.01,
        max=360.0,
        default=60.0,
        precision=3,
        update=_camera_changed,
    )
    pixels: IntVectorProperty(
        name="Resolution",
        description="Width and height of the picture, pixels",
        size=2,
        min=1,
        max=65536,
        default=(320, 240),
        update=_camera_changed,
    )

    blend: FloatProperty(
        name="Blend",
        description="Weight A of the blend: 0 is the shape C_min, 1 the shape C_max",
        min=0.0,
        max=1.0,
        precision=3,
        update=_blend_changed,
    )

    indenter: EnumProperty(
        name="Indenter", items=kinds.INDENTERS, update=_contact_changed,
        description="Shape of the indenter",
    )  # fmt: skip
    radius: FloatProperty(
        name="Radius",
        description="Radius of the ball or cylinder, mm",
        min=0.01,
        max=1000.0,
        default=1.5,
        update=_contact_changed,
    )
    length: FloatProperty(
        name="Length",
        description="Length of the cylinder, mm",
        min=0.01,
        max=1000.0,
        default=8.0,
        update=_contact_changed,
    )
    tilt: FloatVectorProperty(
        name="Tilt",
        description="Rotation of the plane about x and y, degrees",
        size=2,
        min=-80.0,
        max=80.0,
        update=_contact_changed,
    )
    size: FloatProperty(
        name="Size", description="Width of the plane, mm", min=0.01, max=1000.0, default=8.0,
        update=_contact_changed,
    )  # fmt: skip
    file: StringProperty(
        name="Mesh", description="File of the indenter (OBJ, STL, PLY); its lowest point touches "
        "first",
        subtype="FILE_PATH", update=_contact_changed,
    )  # fmt: skip
    shape: PointerProperty(
        type=bpy.types.Mesh, name="Shape", update=_contact_changed,
        description="Mesh of the indenter if no file is given",
    )  # fmt: skip
    scale: FloatProperty(
        name="Scale",
        description="Factor from the units of the file to mm",
        min=1e-6,
        max=1e6,
        default=1.0,
        update=_contact_changed,
    )
    depth: FloatProperty(
        name="Depth",
        description="Depth to which the indenter is pressed in, mm",
        min=0.001,
        max=100.0,
        default=0.6,
        precision=3,
        update=_contact_changed,
    )
    rotation: FloatProperty(
        name="Rotation",
        description="Rotation of the indenter about the outward normal, degrees",
        update=_contact_changed,
    )
    press_by: EnumProperty(
        name="Press by", items=kinds.PRESSING, update=_contact_changed,
        description="Whether the depth or the force of the contact is given",
    )  # fmt: skip
    force: FloatProperty(
        name="Force",
        description="Force along the inward normal, N; the next picture shows the depth that it "
        "gives",
        min=0.001,
        max=1000.0,
        default=1.0,
        precision=3,
        update=_contact_changed,
    )
    shift: FloatVectorProperty(
        name="Shift",
        description="Distance by which the indenter is moved along the skin after "
        "it was pressed "
        "in: the skin sticks to it as far as friction goes",
        size=2,
        min=-100.0,
        max=100.0,
        precision=3,
        update=_contact_changed,
    )
    twist: FloatProperty(
        name="Twist",
        description="Angle in degrees by which the indenter is rotated about the "
        "outward normal after "
        "it was pressed in",
        min=-180.0,
        max=180.0,
        update=_contact_changed,
    )


PROPERTIES = {"Object": {"optisense": OPTISENSE_PG_object}}
