"""From CAD files to the first picture, by mouse and keys, and how many of these that takes."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

import pytest

from .bench import Bench
from .test_by_hand import SIMULATE

PARTS = Path(__file__).parents[2] / "docs" / "examples" / "pad-sensor"
ASSETS = Path(__file__).parents[1] / "assets"
FILES = ("gel.stl", "window.stl", "housing.stl", "leds.stl", "lens.stl")

MOST_ACTIONS = 60
"""Clicks, keys and typed texts from the files to the first picture; 13 do, where no guess of what
a body is has to be corrected."""

SECONDS_OF_ACTION = 5.0
"""Seconds in which a person finds a control and uses it; for the handling that is told."""

BOX = (10.0, 8.0, 4.0)
"""Sides (mm) of the body in box.step."""

SHAPES = 1
"""Place of the panel Shapes in the sidebar; the first is 0."""

TABLE = 330
"""Pixels from the top of the sidebar to below the table of five bodies."""

NEW_SENSOR = 22
"""Pixels from the button *Open* up to the menu *New Sensor*."""


def copy_parts(bench: Bench) -> None:
    """Copy the five files to the home folder and to its documents, one of which the file browser
    shows first.
    """
    for place in (bench.home, bench.home / "Documents"):
        place.mkdir(exist_ok=True)
        for name in FILES:
            shutil.copy(PARTS / name, place)


def test_a_picture_from_cad_files_takes_few_actions(bench: Bench) -> None:
    copy_parts(bench)
    bench.greet()
    bench.open_tab()
    bench.until("bool(part('engine.catalogue').entries('sensors'))")
    before, began = bench.desktop.actions, time.monotonic()

    x, y = bench.find("optisense.open", across=0.25)
    bench.desktop.click(x, y - NEW_SENSOR)
    bench.see("1")
    bench.desktop.keys("End", "Return")
    mark_all_files(bench)
    bench.rest()
    found = "manager.optisense_cad.bodies"
    bench.until(f"len({found}) == {len(FILES)}")
    assert bench.see(f"{{each.name: each.use for each in {found}}}") == {
        "gel": "elastomer",
        "window": "support",
        "housing": "blocker",
        "leds": "lights",
        "lens": "camera",
    }
    bench.photograph("import", "UI", height=TABLE)
    bench.press("optisense.make_from_cad", across=0.4)
    bench.until("scene().optisense.is_open and not state().busy")
    bench.only(SIMULATE)
    bench.press("optisense.simulate")
    bench.until("manager.optisense_picture.shown and not manager.optisense_picture.is_draft")
    bench.rest()
    bench.photograph("cad-picture")

    actions = bench.desktop.actions - before
    waits = time.monotonic() - began
    handling = actions * SECONDS_OF_ACTION
    print(
        f"{actions} actions from CAD files to the first picture: {handling:.0f} s of handling, and "
        f"{waits:.0f} s in which the program works and this test looks for its buttons"
    )
    assert actions <= MOST_ACTIONS


BODIES = "manager.optisense_cad.bodies"
FILES_IN = "area('FILE_BROWSER').spaces.active"

DRAGS_ALL = 5
"""Version of Blender whose editor of files drags all marked files; that of 4.3 drags the one under
the pointer."""

ICON = (17, 39)
"""Pixels from the top left of an editor of files to the picture of the first one, by which marked
files are dragged."""


def test_files_that_are_dropped_on_the_view_are_read(bench: Bench) -> None:
    """From Blender's own editor of files; what another program drops comes the same way."""
    folder = bench.home / "dropped"
    folder.mkdir()
    for name in FILES[:3]:
        shutil.copy(PARTS / name, folder)
    bench.see("setattr(area('PROPERTIES'), 'ui_type', 'FILES')")
    bench.until(f"{FILES_IN}.params is not None")
    bench.see(f"setattr({FILES_IN}.params, 'directory', {str(folder)!r}.encode())")
    bench.see(f"setattr({FILES_IN}, 'show_region_toolbar', False)")
    bench.until("region('FILE_BROWSER', 'WINDOW').width > 100")
    left, top, width, height = bench.see("place('FILE_BROWSER', 'WINDOW')")
    bench.desktop.move(left + width / 2, top + height - 30)
    bench.drawn()
    bench.desktop.keys("a")
    x, y = left + ICON[0], top + ICON[1]
    bench.until("bool(chosen_file())")
    view = bench.see("place('VIEW_3D', 'WINDOW')")
    place = view[0] + 300, view[1] + 400
    bench.drag((x, y), (x + 60, y + 20), place, steps=12)
    bench.photograph("cad-dropped")
    bench.desktop.click(*place)  # Sensor from CAD Files: its entry is under the pointer
    uses = {"gel": "elastomer", "housing": "blocker", "window": "support"}
    if bench.see("bpy.app.version[0]") < DRAGS_ALL:
        del uses["housing"], uses["window"]
    bench.until(f"len({BODIES}) == {len(uses)}")
    bench.rest()
    assert bench.see(f"{{each.name: each.use for each in {BODIES}}}") == uses
    bench.only(0)
    bench.press("optisense.forget_cad", across=0.9)
    bench.until(f"not {BODIES}")


def test_the_folder_of_the_files_is_read(bench: Bench) -> None:
    bench.see("setattr(area('FILE_BROWSER'), 'ui_type', 'PROPERTIES')")
    bench.only(0)
    x, y = bench.find("optisense.open", across=0.25)
    bench.desktop.click(x, y - NEW_SENSOR)
    bench.see("1")
    bench.desktop.keys("End", "Return")
    bench.choose_file()
    bench.until(f"len({BODIES}) == {len(FILES)}")
    bench.rest()


def mark_all_files(bench: Bench) -> None:
    """Mark all files that are asked for, by the key A, and click on the button."""
    bench.files_shown()
    left, top, width, height = bench.see("place('FILE_BROWSER', 'WINDOW')")
    bench.desktop.click(left + width / 2, top + height - 20)
    bench.see("1")
    bench.desktop.keys("a")
    bench.see("1")
    bench.photograph("cad-files")
    left, top, width, height = bench.see("place('FILE_BROWSER', 'EXECUTE')")
    bench.desktop.click(left + width - 70, top + height / 2)
    bench.until("len(manager.windows) == 1")


def test_a_step_file_is_read(bench: Bench) -> None:
    shutil.copy(ASSETS / "box.step", bench.home)
    bench.only(SHAPES)
    bench.press("optisense.add_mesh")
    bench.choose_file("box.step")
    bench.rest()
    bench.until("len(bpy.data.collections['Reference'].objects) == 1")
    size = bench.see("list(bpy.data.collections['Reference'].objects[0].dimensions)")
    assert size == pytest.approx(BOX)
    bench.photograph("step-file")
