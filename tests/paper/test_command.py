"""`python -m paper`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paper import EXPERIMENTS, Unit
from paper.__main__ import app

runner = CliRunner()


def test_without_a_name_it_lists_all() -> None:
    result = runner.invoke(app, [])
    assert result.exit_code == 0
    for name in (*EXPERIMENTS, "all"):
        assert name in result.stdout


def test_an_unknown_name_is_told_with_the_nearest(tmp_path: Path) -> None:
    result = runner.invoke(app, ["sveltemirror", "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "no experiment 'sveltemirror'" in result.stderr
    assert "svelte-mirror" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_told_before_any_work(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    for options in (["--out", str(file)], ["--page", str(file / "page.md")]):
        if "--page" in options:
            options += ["--out", str(tmp_path / "out")]
        result = runner.invoke(app, ["speed", *options])
        assert result.exit_code != 0
        assert "error:" in result.stderr
    assert not (tmp_path / "out" / "units").exists()


def test_no_seeds_make_no_sense() -> None:
    assert runner.invoke(app, ["speed", "--seeds", "0"]).exit_code == 2


def test_all_are_prepared_in_one_go_and_lines_tell_where_there_is_no_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from optisense.search.executors.pool import ProcessPool

    asked: list[str] = []

    def fail(unit: Unit, folder: Path) -> None:
        asked.append(unit.label)
        if unit.alone:  # all that is asked first and shares the machine has been asked
            raise KeyboardInterrupt
        kept_failure(unit, folder)

    monkeypatch.setattr("paper.bench.work_out", fail)
    monkeypatch.setattr("optisense.cli.progress.LOG_EVERY", 0.0)
    monkeypatch.setattr(ProcessPool, "__init__", lambda *_: pytest.fail("one process is asked for"))
    command = ["all", "--quick", "--workers", "1", "--out", str(tmp_path)]
    result = runner.invoke(app, command)
    assert result.exit_code == 130
    for words in ("cylinder, specularity", "light design", "resin 0", "CMA-ES", "tasks on", "tip"):
        assert any(words in label for label in asked)
    assert f"all {len(asked) - 1}/" in result.stderr


def kept_failure(unit: Unit, folder: Path) -> None:
    """As `work_out` does where the work fails."""
    record = {"values": {}, "failure": "made up", "seconds": 1.0, "processor_seconds": 1.0}
    path = folder / "units" / f"{unit.key}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps({**record, "pictures": []}))


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from paper import unit

    done = []
    real = unit.work_out

    def second_is_stopped(each: unit.Unit, folder: Path) -> None:
        if done:
            raise KeyboardInterrupt
        done.append(each.key)
        real(each, folder)

    monkeypatch.setattr("paper.bench.work_out", second_is_stopped)
    command = ["svelte-mirror", "--quick", "--seeds", "1", "--workers", "1"]
    result = runner.invoke(app, [*command, "--out", str(tmp_path)])
    assert result.exit_code == 130
    assert "the same command continues" in result.stderr
    assert [path.stem for path in (tmp_path / "units").glob("*.json")] == done
