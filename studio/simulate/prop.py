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
from ..scene.results import OfScene
from .exposure import exposure_changed

SIZES = [
    ("160", "160 pixels", "Length of the longer side, for a quick look"),
    ("320", "320 pixels", "Length of the longer side"),
    ("640", "640 pixels", "Length of the longer side"),
    ("CAMERA", "As the camera", "The camera's own resolution"),
]


def _draft_changed(values: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    from .drafts import wanted

    wanted()


class OPTISENSE_PG_simulation(bpy.types.PropertyGroup):
    """Settings of pictures."""

    size: EnumProperty(
        name="Size", items=SIZES, default="320",
        description="Width of the picture; its height follows from the proportions of the camera",
    )  # fmt: skip
    noise: FloatProperty(
        name="Noise",
        description="Noise in per cent down to which the picture is simulated",
        min=0.5,
        max=100.0,
        default=5.0,
        precision=1,
    )
    auto_exposure: BoolProperty(
        name="Automatic exposure", default=True,
        description="Set the exposure of each picture by its brightness; otherwise it is fixed, "
        "so that pictures "
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
        description="Model of how the skin deforms under contacts",
    )  # fmt: skip
    seed: IntProperty(
        name="Seed", min=0, max=2**31 - 1,
        description="Seed of the noise: the same seed gives the same picture",
    )  # fmt: skip
    draft: BoolProperty(
        name="Draft while editing",
        description="Update a small, noisy picture while lights and cages are moved",
        update=_draft_changed,
    )


class OPTISENSE_PG_picture(OfScene, bpy.types.PropertyGroup):
    """Picture that is shown; never saved."""

    image: StringProperty(description="Name of the picture in the engine", options={"SKIP_SAVE"})
    shown: BoolProperty(options={"SKIP_SAVE"})
    is_draft: BoolProperty(options={"SKIP_SAVE"})
    is_relit: BoolProperty(options={"SKIP_SAVE"})
    is_stored: BoolProperty(
        description="Whether the picture is a draft from the last time that this sensor was open",
        options={"SKIP_SAVE"},
    )
    is_before: BoolProperty(
        description="Whether the picture shows the sensor that was open before",
        options={"SKIP_SAVE"},
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
