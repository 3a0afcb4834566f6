"""Files and folders as users name them, with spaces, dots, umlauts and beside the .blend file."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import bpy
import pytest

from studio.core.engine import PROTOCOL, EngineError
from studio.engine import session
from studio.engine.preferences import engine_command
from studio.scene.paths import absolute, suggested


def test_files_are_named_after_the_sensor(mini: Any) -> None:
    home = Path.home()
    for title, name in [
        ("mini v1.2", "mini v1.2"),
        ("größe 2", "größe 2"),
        ("../a/b: c", "a-b- c"),
        ("...", "sensor"),
        ("x" * 200, "x" * 100),
    ]:
        mini.optisense.title = title
        assert Path(suggested(mini, ".html")) == home / f"{name}.html"


def test_paths_are_relative_to_the_blend_file_or_home(mini: Any, tmp_path: Path) -> None:
    assert absolute("//study 1") == absolute("study 1") == Path.home() / "study 1"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "my sensör.blend"))
    assert absolute("//study 1") == absolute(" study 1") == tmp_path / "study 1"
    assert absolute("//../x") == tmp_path.parent / "x"
    assert absolute(str(tmp_path / "y")) == tmp_path / "y"


def test_a_report_keeps_the_dots_of_its_name(mini: Any, tmp_path: Path) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert bpy.ops.optisense.report(filepath=str(tmp_path / "mini v1.2")) == {"FINISHED"}
    assert [each.name for each in tmp_path.iterdir()] == ["mini v1.2.html"]


def test_nothing_is_written_where_nothing_was_named(mini: Any, tmp_path: Path) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    mini.optisense_search.study = str(tmp_path / "study")
    for name in ("report", "export", "export_robot", "save_as", "open", "keep_variant", "add_mesh"):
        with pytest.raises(RuntimeError, match="Name a"):
            getattr(bpy.ops.optisense, name)(filepath=" ")
    folder = tmp_path / "pages"
    folder.mkdir()
    with pytest.raises(RuntimeError, match="is a folder"):
        bpy.ops.optisense.report(filepath=str(folder))
    assert list(tmp_path.iterdir()) == [folder] and not list(folder.iterdir())


def test_an_own_objective_lies_beside_the_blend_file(mini: Any, tmp_path: Path) -> None:
    goal = tmp_path / "my goal.py"
    goal.write_text("def shine(evaluation):\n    return evaluation.design.coating.specularity\n")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mini.blend"))
    bpy.context.window_manager.optisense_evaluation.own = "my goal.py:shine"
    found = bpy.context.window_manager.optisense_found
    search = bpy.context.scene.optisense_search
    found.objective_choice = "OWN"
    assert search.objective == "my goal.py:shine"
    search.method, search.study = "grid", "study 1"
    bpy.ops.optisense.vary(label="specularity", text="coating.specularity=0.1,0.7,0.3")
    assert bpy.ops.optisense.search() == {"FINISHED"}
    assert found.best == "0.7" and (tmp_path / "study 1" / "design").is_dir()
    cube = bpy.data.objects.new("mine", bpy.data.meshes.new("mine"))
    cube.optisense.kind = "REFERENCE"
    bpy.context.scene.collection.objects.link(cube)
    assert bpy.ops.optisense.apply_best() == {"FINISHED"}
    assert bpy.context.scene.optisense.coating.value("specularity") == pytest.approx(0.7)
    assert "mine" in bpy.context.scene.objects  # a better sensor is made of the same references


def test_the_engine_may_be_named_without_quotes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    program = tmp_path / "my tools" / "optisense"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\n")
    for told in (str(program), f"{program} engine", f"'{program}' engine"):
        monkeypatch.setenv("OPTISENSE_ENGINE", told)
        assert engine_command() == [str(program), "engine"]
    other = program.with_name("front end")
    other.write_text("#!/bin/sh\n")
    monkeypatch.setenv("OPTISENSE_ENGINE", str(other))
    assert engine_command() == [str(other)]


def test_a_new_engine_knows_no_picture_of_the_one_before(mini: Any, tmp_path: Path) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    session.engine().kill()
    session.engine().wait(session.engine().send("sensors"))
    assert not bpy.ops.optisense.report.poll()
    mini.optisense.light_groups[0].flux = 0.0
    assert "Simulate again" in session.state().note


def test_blender_does_not_wait_for_an_engine_that_hangs(
    mini: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hello = {"protocol": PROTOCOL, "client": "a test", "folder": str(tmp_path)}
    running = session.ask_and_wait("hello", **hello)["pid"]
    os.kill(running, signal.SIGSTOP)
    try:
        with monkeypatch.context() as impatient:
            impatient.setattr(session, "PATIENCE", 0.2)
            with pytest.raises(EngineError, match="has not answered 'entry'"):
                session.ask_and_wait("entry", kind="camera", entry="gelsight-mini")
    finally:
        os.kill(running, signal.SIGCONT)
    assert session.ask_and_wait("entry", kind="camera", entry="gelsight-mini")["entry"]
