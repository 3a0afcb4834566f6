"""A study from a stranger, or a damaged one: told by a sentence, and none of its code is run."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from itertools import product
from pathlib import Path

import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.errors import OptiSenseError, SearchError
from optisense.search import Plan, SearchSpace, Study, run_study
from optisense.search.space.constraints import UserRule
from optisense.search.study.trust import file_of, not_trusted, trust

CODE = """
from pathlib import Path
(Path(__file__).parent / "was-run").touch()

def score(evaluation):
    return evaluation.design.coating.specularity

def fine(design):
    return True
"""


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a finished study of another user, that user's code and state folder."""
    folder = tmp_path_factory.mktemp("theirs")
    mine = folder / "mine.py"
    mine.write_text(CODE)
    space = SearchSpace({"coating.specularity": (0.0, 1.0)}, [UserRule(f"{mine}:fine")])
    plan = Plan(space=space, goals=[f"{mine}:score"], method="random", budget=2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(folder / "state"))
        with closing(Study.create(folder / "study", ots.load("gelsight-mini-ideal"), plan)) as made:
            run_study(made)
    return folder


@pytest.fixture
def mine(theirs: Path) -> Path:
    return theirs / "mine.py"


@pytest.fixture
def study(theirs: Path, mine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of their study, as it comes to somebody else."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "my state"))
    was_run(mine)
    return Path(shutil.copytree(theirs / "study", tmp_path / "study"))


def was_run(file: Path) -> bool:
    """Whether the code was run since this was asked last."""
    mark = file.with_name("was-run")
    ran = mark.exists()
    mark.unlink(missing_ok=True)
    return ran


def optisense(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert "unexpected" not in result.output, result.output
    return result.exit_code, result.output


class TestCode:
    def test_is_not_run_by_looking(self, study: Path, mine: Path, tmp_path: Path) -> None:
        assert optisense("report", study, "--no-pictures", "--out", tmp_path / "page.html")[0] == 0
        assert optisense("apply", study, "--out", tmp_path / "better")[0] == 0
        with closing(Study.open(study)) as opened:
            assert len(opened.trials) == 3
        assert not was_run(mine)

    def test_is_not_run_by_going_on_unless_it_is_trusted(self, study: Path, mine: Path) -> None:
        code, said = optisense("search", "--resume", "--out", study, "--budget", 3)
        assert code == 2
        assert f"{mine}:score" in said and f"{mine}:fine" in said and "--trust" in said
        with closing(Study.open(study)) as opened, pytest.raises(SearchError, match="did not name"):
            run_study(opened, limit=3)
        assert not was_run(mine)
        half = optisense("search", "--resume", "--out", study, "-b", f"{mine}:score")
        assert half[0] == 2 and f"{mine}:fine" in half[1]
        code, said = optisense("search", "--resume", "--trust", "--out", study, "--budget", 3)
        assert code == 0, said
        assert was_run(mine)
        assert optisense("search", "--resume", "--out", study, "--budget", 4)[0] == 0

    def test_is_run_where_it_is_named_again(self, study: Path, mine: Path) -> None:
        code, said = optisense("search", "--resume", "--out", study, "--budget", 3,
                               "-b", f"{mine}:score", "--rule", f"{mine}:fine")  # fmt: skip
        assert code == 0, said

    def test_is_run_where_this_user_began_it(
        self, study: Path, theirs: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("XDG_STATE_HOME", str(theirs / "state"))
        assert optisense("search", "--resume", "--out", study, "--budget", 3)[0] == 0

    def test_another_name_or_content_is_another_file(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
        mine = tmp_path / "mine.py"
        mine.write_text(CODE)
        known = f"{mine}:score"
        trust([known])
        assert not_trusted([known, "aoap", "function:mine"]) == []
        copy = Path(shutil.copy(mine, tmp_path / "copy.py"))
        for other in (f"{mine}:fine", f"{copy}:score", "mine.py:score", str(mine)):
            assert not_trusted([other]) == [other]
        mine.write_text(CODE + "# edited\n")
        assert not_trusted([known]) == [known]
        assert file_of("rgb2normal") is None

    def test_asks_at_a_terminal(self, study: Path, mine: Path) -> None:
        """A real terminal, in which the user presses Enter, and then types yes."""
        import pty

        for answer, code in ((b"\n", 2), (b"yes\n", 0)):
            master, slave = pty.openpty()
            words = ["search", "--resume", "--out", str(study), "--budget", "3"]
            child = subprocess.Popen(
                [sys.executable, "-m", "optisense.cli", *words], stdin=slave, stdout=slave,
                stderr=slave, env={**os.environ, "COLUMNS": "200", "TERM": "dumb"},
            )  # fmt: skip
            os.close(slave)
            said = b""
            while b"Do you trust it" not in said:
                said += os.read(master, 4096)
            assert f"{mine}:score".encode() in said
            os.write(master, answer)
            try:
                while os.read(master, 4096):
                    pass
            except OSError:
                pass  # the terminal has gone with its last program
            assert child.wait() == code
            os.close(master)
        assert was_run(mine)


def spoilt(study: Path, statement: str, *values: object) -> None:
    with closing(sqlite3.connect(study / "trials.sqlite")) as db, db:
        db.execute(statement, values)


@pytest.mark.parametrize(
    ("column", "value"),
    [
        *product(["vector", "scores"], [b"1234567", b"", bytes(24), "text", 3]),
        *product(["gradient"], [b"1234567", "text", 3]),  # any number of whole values is one
    ],
)
def test_a_wrong_value_in_the_store_is_told(
    column: str, value: object, study: Path, tmp_path: Path
) -> None:
    spoilt(study, f"update trials set {column} = ? where number = 1", value)
    for words in (
        ["apply", study, "--out", tmp_path / "better"],
        ["report", study, "--no-pictures", "--out", tmp_path / "page.html"],
        ["search", "--resume", "--trust", "--out", study, "--budget", 3],
    ):
        code, said = optisense(*words)
        assert code == 2, said
        assert "trial 1 can't be read" in said and "trials.sqlite" in said


@pytest.mark.parametrize(
    "statement",
    [
        "update trials set parts = 'no json'",
        "update trials set parts = '[1]'",
        "update trials set parts = '{\"score\": 1}'",
        "update trials set generation = 'first' where number = 1",
        "update trials set seconds = 'long'",
        "update facts set value = '{'",
        "drop table trials",
        "drop table facts",
        "update fresh_scores set scores = x'00'",
        "update fresh_scores set conditions = '[1]'",
    ],
)
def test_any_other_damage_is_told(statement: str, study: Path, tmp_path: Path) -> None:
    spoilt(study, "insert into fresh_scores values (1, 7, ?, null, null)", bytes(8))
    spoilt(study, statement)
    assert optisense("apply", study, "--out", tmp_path / "better")[0] == 2


def test_a_store_that_is_cut_off_is_told(study: Path, tmp_path: Path) -> None:
    store = study / "trials.sqlite"
    content = store.read_bytes()
    for size in (0, 10, 100, 5000):
        store.write_bytes(content[:size])
        code, said = optisense("apply", study, "--out", tmp_path / "better")
        assert code in (1, 2), said


def test_a_store_that_is_a_link_is_not_written_through(study: Path, tmp_path: Path) -> None:
    store, elsewhere = study / "trials.sqlite", tmp_path / "elsewhere.sqlite"
    store.rename(elsewhere)
    store.symlink_to(elsewhere)
    before = elsewhere.read_bytes()
    code, said = optisense("search", "--resume", "--trust", "--out", study, "--budget", 3)
    assert code == 1 and "is a link" in said
    assert elsewhere.read_bytes() == before
    assert sorted(path.name for path in tmp_path.glob("elsewhere*")) == ["elsewhere.sqlite"]


def test_strange_settings_are_told(study: Path, tmp_path: Path) -> None:
    path = study / "study.json"
    good = json.loads(path.read_text())
    for key in good:
        for value in (None, 3, "text", [], {}, [[1]]):
            path.write_text(json.dumps({**good, key: value}))
            if value == good[key]:
                continue
            try:
                Study.open(study).close()
            except OptiSenseError:
                pass
            else:
                assert key in ("begun", "versions", "design")


def test_a_setting_of_a_newer_release_is_told(study: Path) -> None:
    path = study / "study.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "of_tomorrow": 1}))
    with pytest.raises(SearchError, match="'of_tomorrow' is not known") as caught:
        Study.open(study)
    assert "newer release" in str(caught.value.hint)
