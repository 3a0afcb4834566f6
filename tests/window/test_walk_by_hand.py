"""The walk of docs/studio.md, "A sensor of your own in 15 minutes", step by step as it is written,
by mouse and keys, and the time that it takes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import yaml

from .bench import Bench
from .test_by_hand import LIGHTS, SIMULATE
from .test_cad_by_hand import FILES, NEW_SENSOR, SECONDS_OF_ACTION, copy_parts, mark_all_files
from .test_rows_by_hand import EVALUATE, LIGHTS_OF, NAME, POSES

MINUTES = 15
"""Minutes of the whole walk, at the pace of a person."""

READING = 10.0
"""Seconds in which a person reads a step of the page and looks at its picture."""

PICTURE = "manager.optisense_picture"
TOLD = "part('looks.footprint').in_words(scene())"
SHARE = f"float({TOLD}.split('%')[1].split()[-1])"
"""Share of the picture that shows skin, per cent."""

PIXELS = "round(sum(list(bpy.data.images['OptiSense picture'].pixels)[::97]), 4)"
"""A number that is another one for another picture."""

SECONDS: list[tuple[float, float]] = []
"""Seconds of a person, and of the engine's processors, in each step so far."""


def engine_seconds(bench: Bench) -> float:
    """The processor time of the engine; 0 before it has started."""
    pid = bench.see("getattr(part('engine.session').running(), 'pid', 0)")
    if not pid:
        return 0.0
    spent = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
    return sum(map(int, spent)) / os.sysconf("SC_CLK_TCK")


@contextmanager
def step(bench: Bench, what: str) -> Iterator[None]:
    """Note and print the time of a step: a person's at a fixed pace, and the engine's, which other
    programs on this machine do not change.
    """
    actions, before = bench.desktop.actions, engine_seconds(bench)
    yield
    actions = bench.desktop.actions - actions
    SECONDS.append((READING + actions * SECONDS_OF_ACTION, engine_seconds(bench) - before))
    person, engine = SECONDS[-1]
    print(f"{what}: {actions} actions, {person:.0f} s of a person, {engine:.1f} s of the engine")


def test_files_become_a_sensor(bench: Bench) -> None:
    copy_parts(bench)
    bench.greet()
    bench.open_tab()
    with step(bench, "1, the files are chosen"):
        bench.press("optisense.workspace")
        bench.until("window().workspace.name == 'OptiSense'")
        bench.until("region('VIEW_3D', 'UI').active_panel_category == 'OptiSense'")
        bench.until("bool(part('engine.catalogue').entries('sensors'))")
        x, y = bench.find("optisense.open", across=0.25)
        bench.desktop.click(x, y - NEW_SENSOR)
        bench.see("1")
        bench.desktop.keys("End", "Return")
        mark_all_files(bench)
        bench.rest()
        bench.until(f"len(manager.optisense_cad.bodies) == {len(FILES)}")
    with step(bench, "2, the table is confirmed"):
        bench.press("optisense.make_from_cad", across=0.4)
        bench.until("scene().optisense.is_open and not state().busy")
        bench.until(f"{PICTURE}.shown")
    bench.photograph("walk-sensor")


def test_a_row_of_lights_is_moved_and_the_picture_follows(bench: Bench) -> None:
    group = bench.see("scene().optisense.light_groups[0].name")
    with step(bench, "3, a row is moved and snapped"):
        bench.only(SIMULATE)
        bench.press("draft", across=0.1)
        bench.only(LIGHTS)
        _, y = bench.find("flux", across=0.6)
        left, _, width, _ = bench.sidebar()
        bench.desktop.click(left + NAME * width, y)
        bench.until(f"all(each.select_get() for each in {LIGHTS_OF.format(group)})")
        row, shown = bench.see(POSES.format(group)), bench.see(PIXELS)
        bench.press("optisense.snap_row", across=0.25)
        bench.until(f"{POSES.format(group)}[0] != {row[0]!r}")
        bench.until(f"{PIXELS} != {shown!r}")
    bench.photograph("walk-row")


def test_the_camera_is_moved_until_the_skin_fills_its_picture(bench: Bench) -> None:
    with step(bench, "4, the camera is moved"):
        bench.only(0)
        bench.press("footprint", across=0.1)
        bench.until(f"'of its pixels see skin' in {TOLD}")
        before = bench.see(SHARE)
        camera = bench.see("kinds('CAMERA')[0].name")
        bench.desktop.click(
            *bench.see(f"on_screen(bpy.data.objects[{camera!r}].matrix_world.translation)")
        )
        bench.until(f"bpy.context.view_layer.objects.active.name == {camera!r}")
        bench.desktop.keys("g", "z", "2", "Return")
        bench.until(f"'of its pixels see skin' in {TOLD} and {SHARE} > {before}")
    bench.photograph("walk-footprint")
    assert bench.see(f"{TOLD}.split('%')[0].split()[-1]") == "100", "the whole skin is still seen"


def test_it_is_checked_simulated_and_scored(bench: Bench) -> None:
    with step(bench, "5, the sensor is checked"):
        bench.press("optisense.check")
        bench.until("not state().busy and bool(state().note)")
        bench.rest()
    with step(bench, "6, a ball is pressed in and simulated"):
        bench.only(SIMULATE)
        bench.press("optisense.add_contact", across=0.75)
        bench.until("len(kinds('CONTACT')) == 1")
        bench.press("optisense.simulate")
        bench.until(f"{PICTURE}.shown and not {PICTURE}.is_draft")
        bench.rest()
    bench.photograph("walk-picture")
    pixels = "list(bpy.data.images['OptiSense picture'].pixels)"
    assert bench.see(f"sum({pixels}) / len({pixels})") > 0.3, "opacity alone gives 0.25"
    with step(bench, "7, it is evaluated and saved"):
        bench.only(EVALUATE)
        bench.tick("aoap")
        bench.press("optisense.evaluate")
        bench.until("len(manager.optisense_evaluation.scores) == 1")
        bench.rest()
        bench.photograph("walk-score")
        bench.only(0)
        bench.press("optisense.save_as", across=0.85)
        bench.choose_file()
        bench.until("scene().optisense.is_saved")
        bench.rest()
    folder = bench.home / bench.see("scene().optisense.title")
    written = yaml.safe_load((folder / "design.yaml").read_text())
    assert written["parts"] and written["lights"]
    person, engine = (sum(each) for each in zip(*SECONDS, strict=True))
    print(f"the whole walk: {person:.0f} s of a person, {engine:.0f} s of the engine's processors")
    assert person < 60 * MINUTES
