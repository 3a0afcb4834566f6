"""What a design holds besides objects: coating, materials, light groups."""

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

from . import kinds

NAME_LENGTH = 64


def rgb(name: str, description: str, **limits: Any) -> Any:
    """Three numbers for red, green and blue."""
    return FloatVectorProperty(name=name, description=description, size=3, precision=4, **limits)


class OPTISENSE_PG_coating(bpy.types.PropertyGroup):
    """The coating of the sensing surface."""

    library: StringProperty(name="Library", description="The library coating it started from")
    reflectance: rgb(
        "Reflectance", "Diffuse reflectance", min=0.0, max=1.0, subtype="COLOR", default=(0.5,) * 3
    )
    eta: rgb("Index, real", "Metal flake: real part of the index", min=1e-6, default=(1.0,) * 3)
    k: rgb("Index, imaginary", "Metal flake: imaginary part of the index", min=0.0)
    specularity: FloatProperty(
        name="Specularity",
        description="0 is diffuse paint, 1 is mirror-like",
        min=0.0,
        max=1.0,
        precision=3,
    )


class OPTISENSE_PG_material(bpy.types.PropertyGroup):
    """An optical material of parts; its name is what parts refer to."""

    kind: EnumProperty(
        name="Kind", items=kinds.MATERIAL_KINDS, description="What it does with light"
    )
    ior: FloatProperty(
        name="Refractive index", min=1.0, max=4.0, default=1.5, precision=4,
        description="Of all colours alike: 1 is air, 1.41 silicone, 1.49 acrylic",
    )  # fmt: skip
    roughness: FloatProperty(
        name="Roughness", description="GGX alpha; 0 is smooth", min=0.0, max=1.0, precision=3
    )
    has_dispersion: BoolProperty(
        name="Index for R, G, B", description="It is kept with the material"
    )
    dispersion: rgb(
        "Index at R, G, B", "Kept with the material, and not used",
        min=1.0, max=4.0, default=(1.5,) * 3,
    )  # fmt: skip
    eta: rgb("Index, real", "At R, G, B", min=1e-6, default=(1.0,) * 3)
    k: rgb("Index, imaginary", "At R, G, B", min=0.0)
    reflectance: rgb(
        "Reflectance", "Of R, G, B", min=0.0, max=1.0, subtype="COLOR", default=(0.5,) * 3
    )


def _relight(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for each in when_relit:
        each()


when_relit: list[Callable[[], None]] = []
"""Called when the flux or colour of a light group changes."""


def _recolour(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    _redraw_group(group, context)
    _relight(group, context)


def _redraw_group(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .lamps import redraw

    redraw(group.id_data, group)


class OPTISENSE_PG_light_group(bpy.types.PropertyGroup):
    """Lights of one type and colour; its name is what lights refer to."""

    model: StringProperty(name="Model", description="A light of the library")
    colour: rgb(
        "Colour",
        "How the flux is shared among R, G, B; only ratios count",
        min=0.0,
        max=1.0,
        subtype="COLOR",
        default=(1.0,) * 3,
        update=_recolour,
    )
    flux: FloatProperty(
        name="Flux", description="mW, radiant flux of each light", min=0.0, max=1e6, default=1.0,
        precision=3, update=_relight,
    )  # fmt: skip
    emitter: EnumProperty(
        name="Lamp", items=kinds.EMITTERS, update=_redraw_group,
        description="How each light of the group radiates",
    )  # fmt: skip
    shape: EnumProperty(
        name="Window", items=kinds.WINDOWS, update=_redraw_group,
        description="The shape of what emits",
    )  # fmt: skip
    size: FloatVectorProperty(
        name="Size", description="mm, of the window", size=2, min=1e-4, default=(2.0, 2.0),
        precision=3, update=_redraw_group,
    )  # fmt: skip
    file: StringProperty(
        name="IES file", subtype="FILE_PATH",
        description="In the design's folder, or anywhere else: Save copies it to there",
    )  # fmt: skip
    beam: FloatProperty(
        name="Beam", description="Degrees up to which a spot is full", min=0.01, max=90.0,
        default=30.0, update=_redraw_group,
    )  # fmt: skip
    cutoff: FloatProperty(
        name="Cut-off", description="Degrees where a spot's light ends", min=0.01, max=90.0,
        default=45.0, update=_redraw_group,
    )  # fmt: skip
    library_window: StringProperty(options={"HIDDEN"})


class OPTISENSE_PG_design(bpy.types.PropertyGroup):
    """The design of a scene."""

    document: StringProperty(
        description="The design file as it was read, with its numbers in full", options={"HIDDEN"}
    )
    folder: StringProperty(name="Folder", description="Where the design is saved")
    is_saved: BoolProperty(options={"HIDDEN"})
    title: StringProperty(name="Name", description="Of the sensor", maxlen=200)
    description: StringProperty(name="Description", description="Of the sensor, in a line or two")
    coating: PointerProperty(type=OPTISENSE_PG_coating)
    materials: CollectionProperty(type=OPTISENSE_PG_material)
    light_groups: CollectionProperty(type=OPTISENSE_PG_light_group)
    light_group_index: IntProperty(options={"HIDDEN"})

    @property
    def is_open(self) -> bool:
        """Whether the scene holds a design."""
        return bool(self.document)


CLASSES = (
    OPTISENSE_PG_coating,
    OPTISENSE_PG_material,
    OPTISENSE_PG_light_group,
    OPTISENSE_PG_design,
)


def register() -> None:
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.optisense = PointerProperty(type=OPTISENSE_PG_design)


def unregister() -> None:
    del bpy.types.Scene.optisense
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
