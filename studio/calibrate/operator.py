"""Fit the sensor to photographs of the real one, and open the fitted design."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from ..core.engine import EngineError
from ..core.search_parameters import listed
from ..engine import catalogue, polls, session
from ..engine.operators import fail, refuse, start_with_design
from ..scene.paths import absolute, suggested
from ..sensor.opening import open_source

TITLE = "Calibrating"


def _families(values: Any, context: bpy.types.Context | None) -> list[tuple[str, str, str, int]]:
    global _items
    rows = catalogue.entries("calibration_families")
    _items = [
        (row["name"], row["name"].capitalize(), f"Fit the {row['words']}", 1 << number)
        for number, row in enumerate(rows)
    ]
    return _items


_items: list[tuple[str, str, str, int]] = []


class OPTISENSE_PG_calibration(bpy.types.PropertyGroup):
    """Settings of a calibration, and the result of the last one."""

    photos: StringProperty(
        name="Photographs", subtype="DIR_PATH", options={"SKIP_SAVE"},
        description="A folder with background.png and presses.csv (file and diameter of the ball "
        "in mm), one of the gs_sdk tools, or one with Taxim's dataPack.npz",
    )  # fmt: skip
    kept: EnumProperty(
        name="Keep", items=_families, options={"ENUM_FLAG", "SKIP_SAVE"},
        description="Groups of numbers that the fit leaves as they are in the design",
    )  # fmt: skip
    added: EnumProperty(
        name="Also", items=_families, options={"ENUM_FLAG", "SKIP_SAVE"},
        description="Groups of numbers of the sensor's body that the fit changes, too",
    )  # fmt: skip
    fit: StringProperty(
        name="Also Fit", options={"SKIP_SAVE"},
        description="Other numbers that the fit changes, with their ranges, separated "
        "by commas, such as coating.specularity=0:0.4",
    )  # fmt: skip
    hold_out: StringProperty(
        name="Hold Out", options={"SKIP_SAVE"},
        description="File names of presses that test the result instead of being fitted, separated "
        "by commas; every third press if empty",
    )  # fmt: skip
    ball: FloatProperty(
        name="Ball (mm)", min=0.0, max=1000.0, precision=2, options={"SKIP_SAVE"},
        description="Diameter of the ball in mm if presses.csv does not give it; with 0, the file "
        "is used",
    )  # fmt: skip
    as_labelled: BoolProperty(
        name="Trust Labels", options={"SKIP_SAVE"},
        description="Use the contact positions of presses.csv unchanged; otherwise each contact "
        "is searched for near its position",
    )  # fmt: skip
    rounds: IntProperty(
        name="Rounds", min=1, max=20, default=4, options={"SKIP_SAVE"},
        description="Number of rounds of rendering and fitting",
    )  # fmt: skip
    photons: FloatProperty(
        name="Photons (M)", min=0.01, soft_max=50.0, max=10_000.0, default=3.0, precision=2,
        options={"SKIP_SAVE"},
        description="Millions of photons of the last round; the others have 0.3 times as many",
    )  # fmt: skip
    seed: IntProperty(
        name="Seed", min=0, max=2**31 - 1, options={"SKIP_SAVE"},
        description="Seed of the photons: the same seed gives the same light",
    )  # fmt: skip
    shows_more: BoolProperty(
        name="More Options", options={"SKIP_SAVE"},
        description="Show the options that few calibrations need",
    )  # fmt: skip
    result: StringProperty(
        description="Summary of the calibration, one statement a line", options={"SKIP_SAVE"}
    )
    folder: StringProperty(description="Folder of the fitted design", options={"SKIP_SAVE"})
    page: StringProperty(
        description="File of the report about the calibration", options={"SKIP_SAVE"}
    )


def _values(context: bpy.types.Context) -> OPTISENSE_PG_calibration:
    return context.window_manager.optisense_calibration


class OPTISENSE_OT_keep_family(bpy.types.Operator):
    """Let the calibration change these numbers, or keep those of the design"""

    bl_idname = "optisense.keep_family"
    bl_label = "May Change"

    family: StringProperty(
        name="Numbers", description="Group of numbers to add to the fit, or to leave out"
    )

    @classmethod
    def description(cls, context: bpy.types.Context, values: bpy.types.OperatorProperties) -> str:
        words = {row["name"]: row["words"] for row in catalogue.entries("calibration_families")}
        found = words.get(values.family)
        return f"Let the calibration fit the {found}" if found else str(cls.__doc__)

    def execute(self, context: bpy.types.Context) -> set[str]:
        values = _values(context)
        rows = {each["name"]: each for each in catalogue.entries("calibration_families")}
        if self.family not in rows:
            return refuse(self, f"There is no group of numbers '{self.family}' to fit")
        if rows[self.family]["usual"]:
            values.kept = set(values.kept) ^ {self.family}
        else:
            values.added = set(values.added) ^ {self.family}
        return {"FINISHED"}


class OPTISENSE_OT_calibrate(polls.Checked, bpy.types.Operator):
    """Fit the sensor to the photographs; the fitted design goes to a folder of its own"""

    bl_idname = "optisense.calibrate"
    bl_label = "Calibrate"

    checks = (
        *polls.ASKING,
        polls.requires(lambda c: _values(c).photos, "Choose the folder of the photographs first"),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        values = _values(context)
        photos = absolute(values.photos)
        if not photos.is_dir():
            return refuse(self, f"{photos} is no folder; choose the folder of the photographs")
        to = Path(suggested(context.scene, "-calibrated"))
        if to.exists():
            numbers = (to.with_name(f"{to.name}-{number}") for number in range(2, 1000))
            to = next(each for each in numbers if not each.exists())
        values.result = values.folder = values.page = ""
        ball = {"ball": round(values.ball, 4)} if values.ball > 0.0 else {}
        return start_with_design(
            self, context, TITLE, "calibrate", _take, photos=str(photos), to=str(to),
            keep=sorted(values.kept), also=sorted(values.added), fit=listed(values.fit),
            hold_out=listed(values.hold_out), as_labelled=values.as_labelled, rounds=values.rounds,
            photons=round(values.photons * 1e6), seed=values.seed, **ball,
        )  # fmt: skip


def _take(result: dict[str, Any]) -> None:
    values = _values(bpy.context)
    values.folder, values.page = result["folder"], result["page"]
    values.result = "\n".join(words(result))
    session.state().note = f"The fitted design is in {result['folder']}"
    session.state().written = result["page"]


def words(result: dict[str, Any]) -> list[str]:
    """Return the result of a calibration as lines of text: the verdict, the share of the presses'
    energy that is not explained, and each fitted number before and after with its uncertainty.
    """
    before, after = (100.0 * each for each in result["unexplained"])
    held = "presses held out" if result["held_out"] else "fitted presses"
    lines = [result["verdict"]]
    lines.append(f"Not explained of {held}: {before:.0f} % before, {after:.0f} % after")
    for row in result["numbers"]:
        doubt = "" if row["determined"] else ", not determined"
        start = "none" if row["before"] is None else f"{row['before']:.4g}"
        lines.append(
            f"{row['words']}: {start} → {row['after']:.4g} ± "
            f"{row['uncertainty']:.2g} {row['unit']}".rstrip()
            + doubt
        )
    return lines


class OPTISENSE_OT_open_calibrated(polls.Checked, bpy.types.Operator):
    """Open the design that was fitted, in place of this one"""

    bl_idname = "optisense.open_calibrated"
    bl_label = "Open Fitted"

    checks = (polls.is_idle, polls.requires(lambda c: _values(c).folder, "Calibrate first"))

    def execute(self, context: bpy.types.Context) -> set[str]:
        folder = _values(context).folder
        try:
            open_source(context.scene, folder, folder, wait=bpy.app.background)
        except EngineError as error:
            return fail(self, error)
        return {"FINISHED"}


PROPERTIES = {"WindowManager": {"optisense_calibration": OPTISENSE_PG_calibration}}
