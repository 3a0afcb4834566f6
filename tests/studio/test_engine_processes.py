"""The engine's process: its death, its version, and programs that are no engine."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from waiting import until

from studio.core.engine import Engine, EngineError
from studio.engine import session
from studio.scene.gather import gather_document


def test_the_engine_may_die_midway(mini: Any) -> None:
    before = gather_document(mini)
    mini.optisense_simulation.noise = 0.5
    bpy.ops.optisense.simulate(wait=False)
    old = session.engine()
    old.kill()
    until(lambda: not session.is_busy(), problem_allowed=True)
    assert "ended unexpectedly" in session.state().problem
    assert gather_document(mini) == before
    assert bpy.ops.optisense.check() == {"FINISHED"}  # a new engine does it
    assert session.engine() is not old
    assert session.state().note == "The design is in order"


def test_no_engine_and_one_that_is_no_engine(
    mini: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(session, "_engine", None)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("OPTISENSE_ENGINE", "")
    with pytest.raises(RuntimeError, match="No engine was found"):
        bpy.ops.optisense.check()
    monkeypatch.setenv("OPTISENSE_ENGINE", str(tmp_path / "gone"))
    with pytest.raises(RuntimeError, match="can't be started"):
        bpy.ops.optisense.check()


def test_an_engine_that_ends_before_it_is_asked_is_told(
    mini: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    script = tmp_path / "broken.py"
    script.write_text("raise SystemExit('No module named optisense')\n")
    before = session._engine
    monkeypatch.setattr(session, "_engine", None)
    monkeypatch.setenv("OPTISENSE_ENGINE", f"{sys.executable} {script}")
    session.engine()
    until(lambda: session.running() is None, problem_allowed=True)
    assert session._tick() is None
    assert "ended unexpectedly" in session.state().problem
    assert "No module named optisense" in session.state().hint
    assert session.running() is None and bpy.ops.optisense.start_engine.poll()
    monkeypatch.undo()
    assert session._engine is before
    assert bpy.ops.optisense.check() == {"FINISHED"}


def test_a_defect_in_an_answer_does_not_stop_the_rest(
    mini: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(_: Any) -> None:
        raise KeyError("files")

    came: list[Any] = []
    engine = session.engine()
    engine.send("sensors", on_result=fails)
    engine.send("methods", on_result=came.append)
    until(lambda: session.state().problem, problem_allowed=True)
    assert "Unexpected KeyError" in session.state().problem
    until(lambda: came, problem_allowed=True)


def test_an_engine_of_another_version_says_so(tmp_path: Path) -> None:
    script = tmp_path / "other.py"
    script.write_text(
        "import json\n"
        "asked = json.loads(input())\n"
        "error = {'kind': 'ProtocolError', 'message': 'this engine speaks protocol 9, not '\n"
        "         + str(asked['protocol']), 'hint': 'Update the extension'}\n"
        "print(json.dumps({'id': asked['id'], 'ok': False, 'error': error}), flush=True)\n"
    )
    engine = Engine([sys.executable, str(script)], str(tmp_path))
    errors: list[EngineError] = []
    request = engine.send("warm", on_error=errors.append, design="gelsight-mini-ideal")
    engine.wait(request)
    assert "speaks protocol 9" in errors[0].message
    assert errors[0].hint == "Update the extension"
    engine.stop()


def test_a_program_that_never_answers_is_no_engine(
    scene: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    silent = tmp_path / "silent.py"
    silent.write_text("import sys\nfor line in sys.stdin:\n    print(line, flush=True)\n")
    for told, words, patience in (
        (f"{sys.executable} {silent}", "does not answer", 0.0),
        (f"{sys.executable} -c print(1)", "ended unexpectedly", np.inf),
    ):
        session.stop()
        monkeypatch.setattr("studio.core.engine.GREETING_SECONDS", patience)
        monkeypatch.setenv("OPTISENSE_ENGINE", told)
        for run in (
            lambda: bpy.ops.optisense.new(sensor="gelsight-mini-ideal"),
            lambda: bpy.ops.optisense.add_mesh(filepath=str(silent)),
        ):
            with pytest.raises(RuntimeError, match=words):
                run()
            assert not session.is_busy() and words in session.state().problem
            assert "preferences" in session.state().hint
    session.stop()
