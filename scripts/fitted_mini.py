"""Fit the built-in `gelsight-mini` anew: python scripts/fitted_mini.py fit PHOTOS [FITTED]

or show it beside the photographs: python scripts/fitted_mini.py show PHOTOS

PHOTOS is a folder with the calibration pictures of GelSLAM (MIT; background.png, presses.csv and
the presses of balls of 6.31 and 9.5 mm). FITTED is a folder that `optisense calibrate` has made of
them already. Says how far the design is from the photographs before and after.
"""

from __future__ import annotations

import json
import sys
from datetime import date
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import optisense as ots
from optisense import library
from optisense.calibration import CalibrationSettings, calibrate, compare, read_photographs
from optisense.calibration.families import chosen_families
from optisense.design import SensorDesign, Status, get_value
from optisense.design.camera import ImagingModel
from optisense.design.yaml_writer import to_yaml
from optisense.library import CameraModel, Source
from optisense.library.storage import HEADS
from optisense.sensors._gelsight_mini import FITTED_CAMERA, FITTED_NUMBERS, unfitted_design

UNIT = "one GelSight Mini, calibration pictures of GelSLAM (commit e0ea7de, MIT)"
"""Origin of the photographs, for the source of each number."""

SHOWN = "d6p31_01.png", "d9p50_01.png"
"""Presses that are drawn: one of each ball; the fit has not seen the second."""

PHOTONS = 1_000_000
"""Photons of the drawn pictures, whose noise is then far below that of the photographs."""

PICTURE = Path(__file__).parent.parent / "docs" / "images" / "gelsight-mini-fitted.png"
"""File of the drawn pictures."""

FILE = Path(ots.__file__).parent / "sensors" / FITTED_NUMBERS
"""File of the fitted numbers, except those of the camera's processing."""

CAMERA_FILE = Path(ots.__file__).parent / "library" / "cameras" / f"{FITTED_CAMERA}.yaml"
"""File of the numbers of the camera's processing."""


def fitted_to(photographs: str) -> SensorDesign:
    """Return the design after a fit with the usual settings, with every third press held out and
    a known field of view."""
    found = calibrate(
        unfitted_design(),
        read_photographs(photographs),
        CalibrationSettings(families=chosen_families(["view"], ["edges"])),
        progress=lambda *told: print(told),
    )
    for name, side in (("before", found.before), ("after", found.after)):
        held = found.of_presses(side.realism, held_out=True)
        print(name, held.median("unexplained"), held.median("similarity"), held.background.ratio)
    return found.design


def plain(value: object) -> object:
    """Return a value as plain data with numbers of six digits, more than is known of them."""
    if hasattr(value, "model_dump"):
        value = value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def write(design: SensorDesign) -> None:
    """Write the fitted numbers and their sources: the camera's processing into the library, and the
    others beside the sensor.
    """
    lines = ["# Made by scripts/fitted_mini.py. Lengths in mm, angles in degrees, powers in mW."]
    fitted = {
        place: known.source
        for place, known in design.provenance.items()
        if known.status is Status.CALIBRATED
    }
    of_edges = next((text for place, text in fitted.items() if place.endswith(".faces")), "")
    for name, part in design.parts.items():
        if part.faces:  # the edges of several parts have one roughness
            fitted[f"parts.{name}.faces"] = of_edges
    values: dict[str, Any] = {}
    sources: dict[str, Source] = {}
    for place, text in fitted.items():
        value = plain(get_value(design, place))
        first, _, field = place.partition(".")
        if first == "camera" and field in ImagingModel.model_fields:
            values[field] = value
            sources[field] = Source(
                status=Status.CALIBRATED, source=f"{UNIT}, {text}", date=str(date.today().year)
            )
            continue
        source = json.dumps(f"{UNIT}, {text}", ensure_ascii=False)
        lines += [f"{place}:", f"  value: {json.dumps(value)}", f"  source: {source}"]
    FILE.write_text("\n".join(lines) + "\n", encoding="utf-8")
    known = library.entry("camera", FITTED_CAMERA)
    view = known.value.model_dump(mode="json", exclude_none=True)
    kept = {field: known.sources[field] for field in known.sources if field not in sources}
    value = CameraModel.model_validate(view | values)
    entry = known.model_copy(update={"value": value, "sources": kept | sources})
    CAMERA_FILE.write_text(to_yaml(entry, HEADS["camera"]), encoding="utf-8")


def show(photographs: str) -> None:
    """Draw photographs and the pictures of both Minis, as bright as the background."""
    read = read_photographs(photographs)
    names = [press.name for press in read.presses]
    some = read.subset([names.index(name) for name in SHOWN])
    columns = [("photographs", [some.background, *(press.picture for press in some.presses)])]
    for name in ("gelsight-mini-ideal", "gelsight-mini"):
        found = compare(ots.OpticalModel(ots.load(name)), some, photons=PHOTONS)
        pictures = [found.pictures.background, *found.pictures.presses]
        columns.append((name, [np.clip(np.round(p), 0, 255).astype(np.uint8) for p in pictures]))
        print(name, found.realism.background.ratio, found.realism.median("unexplained"))
    figure, axes = plt.subplots(len(SHOWN) + 1, 3, figsize=(9.6, 7.4), facecolor="white")
    for place, (name, pictures) in enumerate(columns):
        axes[0, place].set_title(name, fontsize=12)
        for row, picture in enumerate(pictures):
            axes[row, place].imshow(picture)
            axes[row, place].set_axis_off()
    figure.tight_layout(pad=0.4)
    figure.savefig(PICTURE, dpi=100)


if __name__ == "__main__":
    what, photographs, *done = sys.argv[1:]
    if what == "fit":
        write(ots.load(done[0]) if done else fitted_to(photographs))
    else:
        show(photographs)
