"""Properties of the simulation: its settings and its result."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    StringProperty,
)

from ..scene import kinds
from .exposing import exposure_changed

SIZES = [
    ("160", "160 pixels", "Of the longer side: a quick look"),
    ("320", "320 pixels", "Of the longer side"),
    ("640", "640 pixels", "Of the longer side"),
    ("CAMERA", "As the camera", "The camera's own resolution"),
]


def _draft_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .drafts import wanted

    wanted()


class OPTISENSE_PG_simulation(bpy.types.PropertyGroup):
    """Settings of pictures."""

    size: EnumProperty(
        name="Size", items=SIZES, default="320",
        description="Of the picture; it keeps the camera's proportions",
    )  # fmt: skip
    noise: FloatProperty(
        name="Noise", description="Per cent; simulate until no more is left", min=0.5, max=100.0,
        default=5.0, precision=1,
    )  # fmt: skip
    auto_exposure: BoolProperty(
        name="Automatic exposure", default=True,
        description="As bright as fits into the picture; off keeps it as it is, so that pictures "
        "can be compared",
        update=exposure_changed,
    )  # fmt: skip
    exposure: FloatProperty(
        name="Exposure", min=1e-6, max=1e9, default=30.0,
        description="Factor from radiance to the brightness of the picture",
        update=exposure_changed,
    )  # fmt: skip
    skin: EnumProperty(
        name="Skin", items=kinds.SKINS, default="elastic",
        description="How the skin gives way to contacts",
    )  # fmt: skip
    seed: IntProperty(
        name="Seed", min=0, max=2**31 - 1,
        description="Of the noise: the same seed gives the same picture",
    )  # fmt: skip
    draft: BoolProperty(
        name="Draft while editing",
        description="Update a small, noisy picture while lights and cages are moved",
        update=_draft_changed,
    )


class OPTISENSE_PG_picture(bpy.types.PropertyGroup):
    """Picture that is shown; never saved."""

    image: StringProperty(description="The engine's name of it", options={"SKIP_SAVE"})
    shown: BoolProperty(options={"SKIP_SAVE"})
    is_draft: BoolProperty(options={"SKIP_SAVE"})
    is_relit: BoolProperty(options={"SKIP_SAVE"})
    is_before: BoolProperty(
        description="It is a picture of the sensor that was open before", options={"SKIP_SAVE"}
    )
    summary: StringProperty(options={"SKIP_SAVE"})
    presses: StringProperty(
        description="Force and pressure of each contact, one a line", options={"SKIP_SAVE"}
    )
    file: StringProperty(options={"SKIP_SAVE"})


PROPERTIES = {
    "Scene": {"optisense_simulation": OPTISENSE_PG_simulation},
    "WindowManager": {"optisense_picture": OPTISENSE_PG_picture},
}
