"""Properties of a design besides its objects: coating, materials, light groups."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .fields import HasFields, OPTISENSE_PG_field, kind_menu

USUAL_COATING = "flake"
"""Kind of a coating whose file names none."""


def rgb(name: str, description: str, **limits: Any) -> Any:
    """Return a property of three numbers for red, green and blue."""
    return FloatVectorProperty(name=name, description=description, size=3, precision=4, **limits)


class OPTISENSE_PG_coating(HasFields, bpy.types.PropertyGroup):
    """Coating of the sensing surface."""

    noun = "coating"
    library: StringProperty(
        name="Library", description="Coating of the library from which this one was made"
    )
    kind_name: StringProperty(options={"HIDDEN"}, default=USUAL_COATING)
    fields: CollectionProperty(type=OPTISENSE_PG_field)


class OPTISENSE_PG_material(HasFields, bpy.types.PropertyGroup):
    """Optical material of parts; parts refer to its name."""

    noun = "material"
    kind: EnumProperty(
        name="Kind", description="Optical model of the material", **kind_menu("material")
    )
    kind_name: StringProperty(options={"HIDDEN"}, default="absorber")
    fields: CollectionProperty(type=OPTISENSE_PG_field)


def _relight(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_relit:
        each()


when_relit: list[Callable[[], None]] = []
"""Callbacks for a change of a light group's flux or colour."""

when_reshaped: list[Callable[[bpy.types.Scene, bpy.types.PropertyGroup], None]] = []
"""Callbacks for a change of the kind or a number of a light group's lamps."""


def _show(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_group_hidden:
        each(group.id_data, group)
    _relight(group, context)


when_group_hidden: list[Callable[[bpy.types.Scene, bpy.types.PropertyGroup], None]] = []
"""Callbacks for the light of a group being hidden or shown."""


def _recolour(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    _redraw_group(group, context)
    _relight(group, context)


def _redraw_group(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .lamps import redraw

    redraw(group.id_data, group)


class OPTISENSE_PG_light_group(HasFields, bpy.types.PropertyGroup):
    """Lights of one type and colour; lights refer to its name."""

    noun = "emitter"
    model: StringProperty(name="Model", description="Lamp of the library")
    colour: rgb(
        "Colour",
        "Shares of R, G, B in the flux; only their ratios matter",
        min=0.0,
        max=1.0,
        subtype="COLOR",
        default=(1.0,) * 3,
        update=_recolour,
    )
    flux: FloatProperty(
        name="Flux", description="Radiant flux of each light, mW", min=0.0, max=1e6, default=1.0,
        precision=3, update=_relight,
    )  # fmt: skip
    emitter: EnumProperty(
        name="Lamp", description="Model of the light that each lamp of the group emits",
        **kind_menu("emitter", [("library", "Library", "As the library's light")]),
    )  # fmt: skip
    kind_name: StringProperty(options={"HIDDEN"}, default="library")
    fields: CollectionProperty(type=OPTISENSE_PG_field)
    shown: BoolProperty(
        name="Show", default=True, update=_show,
        description="Show the lights of the group and their light in the picture; the design is "
        "not changed",
    )  # fmt: skip
    drawn: StringProperty(
        description="Size of the lamps as the engine gives it, as JSON", options={"HIDDEN"}
    )

    def fields_changed(self) -> None:
        """Redraw the lamps."""
        for each in when_reshaped:
            each(self.id_data, self)


def _select_group(design: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_group_chosen:
        each(design.id_data, design.light_group_index)


when_group_chosen: list[Callable[[bpy.types.Scene, int], None]] = []
"""Callbacks with the index of the light group that was chosen in the list."""


class OPTISENSE_PG_design(bpy.types.PropertyGroup):
    """Design of a scene."""

    document: StringProperty(
        description="Design file as it was read, in full precision", options={"HIDDEN"}
    )
    folder: StringProperty(name="Folder", description="Folder in which the design is saved")
    is_saved: BoolProperty(options={"HIDDEN"})
    opening: StringProperty(
        description="Identifier of the opening of this sensor", options={"HIDDEN"}
    )
    title: StringProperty(name="Name", description="Name of the sensor", maxlen=200)
    description: StringProperty(
        name="Description", description="Description of the sensor in a line or two"
    )
    coating: PointerProperty(type=OPTISENSE_PG_coating)
    materials: CollectionProperty(type=OPTISENSE_PG_material)
    light_groups: CollectionProperty(type=OPTISENSE_PG_light_group)
    light_group_index: IntProperty(
        name="Light group", description="Selected light group; a click on a group selects its "
        "lights",
        options={"HIDDEN"}, update=_select_group,
    )  # fmt: skip

    @property
    def is_open(self) -> bool:
        """Whether the scene holds a design."""
        return bool(self.document)


PROPERTIES = {"Scene": {"optisense": OPTISENSE_PG_design}}
