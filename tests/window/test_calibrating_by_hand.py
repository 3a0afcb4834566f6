"""A press by force, and a sensor that is fitted to photographs, by mouse and keys.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from matplotlib.image import imsave

import optisense as ots

from .bench import Bench
from .test_by_hand import SIMULATE

CALIBRATE = 8
"""The panel's place in the sidebar; the first is 0."""

FORCE = 2.0
"""Force of a ball, N."""

CONTACT = "kinds('CONTACT')[0].optisense"
PICTURE = "manager.optisense_picture"
CALIBRATION = "manager.optisense_calibration"

FLUX, USUAL = 3.0, 2.1
"""Flux (mW) of the red lights of the real sensor, and of the design that is fitted to it."""

PLACES = {"a": (-4.0, 2.0), "b": (3.0, -2.0), "c": (0.5, 3.0)}
"""Surface coordinates (mm) of presses of balls of 6 mm, by the names of their photographs."""

EXPOSURE = 700.0
"""Exposure of the photographs, which makes them neither dark nor white."""


def photograph_real_sensor(folder: Path) -> None:
    """Write photographs of a Mini with brighter red lights, as a user takes them."""
    folder.mkdir()
    model = ots.OpticalModel(
        ots.set_value(ots.load("gelsight-mini-ideal"), "lights.red.flux", FLUX)
    )
    shots: dict[str, list[ots.Contact]] = {"background": []}
    for name, place in PLACES.items():
        shots[name] = [ots.Contact(ots.Sphere(3.0), at=place, depth=0.6)]
    for name, contacts in shots.items():
        image = model.render(contacts, resolution=(160, 120), photons=100_000)
        imsave(folder / f"{name}.png", image.picture(exposure=EXPOSURE))
    rows = "".join(f"{name}.png,6\n" for name in PLACES)
    (folder / "presses.csv").write_text(f"file,diameter\n{rows}", encoding="utf-8")


def test_a_ball_is_pressed_by_force(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    bench.new_sensor("gelsight-mini-ideal")
    bench.only(SIMULATE)
    bench.press("optisense.add_contact", across=0.75)
    bench.until("len(kinds('CONTACT')) == 1")
    bench.press("press_by", across=0.85)
    bench.until(f"{CONTACT}.press_by == 'FORCE'")
    bench.enter("force", f"{FORCE:g}")
    bench.until(f"{CONTACT}.force == {FORCE}")
    before = bench.see(f"{CONTACT}.depth")
    bench.press("optisense.simulate")
    bench.until(f"{PICTURE}.shown")
    bench.rest()
    line = bench.see(f"{PICTURE}.presses")
    assert f"{FORCE:g} N at " in line, line
    depth = float(line.partition(" N at ")[2].partition(" mm")[0])
    bench.until(f"abs({CONTACT}.depth - {depth}) < 0.01")
    assert depth > before, "the ball is drawn as deep as that force presses it"
    bench.bring("press_by", 0.3, across=0.6)
    bench.photograph("pressed-by-force")


def test_a_sensor_is_fitted_to_photographs(bench: Bench) -> None:
    photographs = bench.home / "photographs"
    photograph_real_sensor(photographs)
    bench.only(CALIBRATE)
    bench.enter("photos", str(photographs))
    bench.until(f"{CALIBRATION}.photos == {str(photographs)!r}")
    names = bench.see(
        "[each['name'] for each in part('engine.catalogue').entries('calibration_families')"
        " if each['usual']]"
    )
    for number, name in enumerate(names):
        if name != "powers":
            across = (0.25, 0.75)[number // ((len(names) + 1) // 2)]  # one column after the other
            bench.press(f'optisense.keep_family(family="{name}")', across=across)
    bench.until(f"len({CALIBRATION}.kept) == {len(names) - 1}")
    bench.press("optisense.calibrate")
    bench.until("state().busy == 'Calibrating'")
    bench.rest()
    bench.photograph("calibrated")
    lines = bench.see(f"{CALIBRATION}.result").splitlines()
    assert any(line.startswith("power of the red lights: 2.1 →") for line in lines), lines
    bench.press("optisense.open_calibrated", across=0.25)
    bench.until("scene().optisense.is_saved and not state().busy")
    folder = Path(bench.see("scene().optisense.folder"))
    lights = yaml.safe_load((folder / "design.yaml").read_text())["lights"]
    ratio = lights["red"]["flux"] / lights["green"]["flux"]
    assert ratio == pytest.approx(FLUX / USUAL, rel=0.1), "exposure scales all of them"
