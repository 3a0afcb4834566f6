"""One process at a time writes to a folder, and nothing that it did not make is removed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from optisense.errors import FolderInUseError, OutputError
from optisense.folders import LOCK_FILE, FolderLock, Holder, begun, held, hold, holder_of

KILLED = """
import os, signal, sys
from pathlib import Path
from optisense.folders import FolderLock
folder = Path(sys.argv[1])
lock = FolderLock(folder)
lock.will_make(["a.txt", "inner/b.txt", "inner/deep/c.txt"])
for name in ("inner", "inner/deep"):
    (folder / name).mkdir()
for name in ("a.txt", "inner/b.txt"):
    (folder / name).write_text("half")
(folder / f"inner/.c.{os.getpid()}-0123abcd.txt").write_text("ha")
if "whole" in sys.argv:
    lock.is_whole()
os.kill(os.getpid(), signal.SIGKILL)
"""


def killed(folder: Path, *words: str) -> None:
    """Let a process be killed amid its work on a folder."""
    child = subprocess.run([sys.executable, "-c", KILLED, str(folder), *words], check=False)
    assert child.returncode == -signal.SIGKILL


def names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


class TestTheLock:
    def test_is_held_by_one_and_tells_by_whom(self, tmp_path: Path) -> None:
        lock = FolderLock(tmp_path)
        with pytest.raises(FolderInUseError, match=f"process {os.getpid()} on") as told:
            FolderLock(tmp_path)
        assert told.value.where == str(tmp_path)
        assert told.value.hint is not None
        holder = holder_of(tmp_path)
        assert holder is not None and holder.process == os.getpid()
        lock.release()
        assert holder_of(tmp_path) is None
        assert names(tmp_path) == set()
        FolderLock(tmp_path).release()

    def test_is_seen_by_another_process(self, tmp_path: Path) -> None:
        code = "import sys; from optisense.folders import FolderLock; FolderLock(sys.argv[1])"
        command = [sys.executable, "-c", code, str(tmp_path)]
        with held(tmp_path):
            refused = subprocess.run(command, capture_output=True, text=True, check=False)
        assert "FolderInUseError: another process is writing" in refused.stderr
        assert f"process {os.getpid()} on" in refused.stderr
        assert subprocess.run(command, check=False).returncode == 0

    def test_goes_with_its_process(self, tmp_path: Path) -> None:
        """The number of the dead process, which another one may get, means nothing."""
        killed(tmp_path)
        assert holder_of(tmp_path) is None
        left = json.loads((tmp_path / LOCK_FILE).read_text())
        (tmp_path / LOCK_FILE).write_text(json.dumps({**left, "process": os.getpid()}))
        assert holder_of(tmp_path) is None
        FolderLock(tmp_path).release()

    def test_of_another_machine_is_not_judged(self, tmp_path: Path) -> None:
        far = replace(Holder.of_this_process(), host="far-away", boot="another", making=("a",))
        (tmp_path / "a").write_text("theirs")
        (tmp_path / LOCK_FILE).write_text(json.dumps(asdict(far)))
        assert holder_of(tmp_path) is not None
        with pytest.raises(FolderInUseError, match="far-away") as told:
            FolderLock(tmp_path)
        assert str(tmp_path / LOCK_FILE) in str(told.value.hint)
        assert names(tmp_path) == {LOCK_FILE, "a"}
        (tmp_path / LOCK_FILE).unlink()
        FolderLock(tmp_path).release()

    def test_of_a_container_on_this_machine_is(self, tmp_path: Path) -> None:
        """Containers have other names, but one kernel, whose locks hold in all of them."""
        near = replace(Holder.of_this_process(), host="a-container")
        if not near.boot:
            pytest.skip("this system has no boot identifier")
        (tmp_path / LOCK_FILE).write_text(json.dumps(asdict(near)))
        FolderLock(tmp_path).release()

    @pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"process": "x"}', b"\xff" * 99])
    def test_file_that_says_nothing_is_no_obstacle(self, tmp_path: Path, content: bytes) -> None:
        (tmp_path / LOCK_FILE).write_bytes(content)
        FolderLock(tmp_path).release()
        assert names(tmp_path) == set()

    def test_that_is_a_link_is_not_followed(self, tmp_path: Path) -> None:
        other = tmp_path / "precious"
        other.write_text("precious")
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / LOCK_FILE).symlink_to(other)
        with pytest.raises(OutputError, match="is a link"):
            FolderLock(tmp_path / "out")
        assert other.read_text() == "precious"

    def test_makes_its_folder_and_takes_it_away_again(self, tmp_path: Path) -> None:
        with held(tmp_path / "a" / "b"):
            assert (tmp_path / "a" / "b").is_dir()
        assert names(tmp_path) == set()
        with held(tmp_path / "a" / "b"):
            (tmp_path / "a" / "b" / "mine").touch()
        assert names(tmp_path) == {"a", "a/b", "a/b/mine"}

    def test_is_shared_within_a_thread_where_that_is_asked(self, tmp_path: Path) -> None:
        give_back = hold(tmp_path)
        with held(tmp_path):
            pass
        assert holder_of(tmp_path) is not None
        give_back()
        assert holder_of(tmp_path) is None

    def test_needs_a_folder(self, tmp_path: Path) -> None:
        (tmp_path / "file").touch()
        with pytest.raises(OutputError, match="this is a file"):
            FolderLock(tmp_path / "file")
        with pytest.raises(OutputError):
            FolderLock(tmp_path / "file" / "inner")


class TestWhatAKilledProcessLeaves:
    def test_is_removed_and_nothing_else(self, tmp_path: Path) -> None:
        (tmp_path / "mine.txt").write_text("mine")
        killed(tmp_path)
        (tmp_path / "inner" / "also mine.txt").write_text("mine")
        lock = FolderLock(tmp_path)
        assert names(tmp_path) == {LOCK_FILE, "mine.txt", "inner", "inner/also mine.txt"}
        lock.release()

    def test_goes_with_its_folders(self, tmp_path: Path) -> None:
        killed(tmp_path / "out")
        with begun(tmp_path / "out", ["a.txt"]):
            (tmp_path / "out" / "a.txt").write_text("whole")
        assert names(tmp_path) == {"out", "out/a.txt"}

    def test_stays_where_it_was_whole(self, tmp_path: Path) -> None:
        killed(tmp_path, "whole")
        FolderLock(tmp_path).release()
        assert {"a.txt", "inner/b.txt"} <= names(tmp_path)

    def test_stays_where_its_last_file_is_there(self, tmp_path: Path) -> None:
        """Killed between its last file and the note that all is whole; others may have used it."""
        killed(tmp_path)
        (tmp_path / "inner" / "deep" / "c.txt").write_text("the last")
        FolderLock(tmp_path).release()
        assert {"a.txt", "inner/b.txt", "inner/deep/c.txt"} <= names(tmp_path)

    def test_is_looked_for_inside_the_folder_only(self, tmp_path: Path) -> None:
        out, beside = tmp_path / "out", tmp_path / "beside"
        for folder in (out, beside):
            folder.mkdir()
        (beside / "precious").write_text("precious")
        (out / "link").symlink_to(beside)
        strange = replace(
            Holder.of_this_process(),
            making=("../beside/precious", "link/precious", str(beside / "precious"), "a\0b"),
            folders=("../beside", ".."),
        )
        (out / LOCK_FILE).write_text(json.dumps(asdict(strange)))
        FolderLock(out).release()
        assert (beside / "precious").read_text() == "precious"

    def test_temporary_files_of_those_who_live_stay(self, tmp_path: Path) -> None:
        mine = tmp_path / f".picture.{os.getpid()}-0123abcd.png"
        killed(tmp_path)
        dead = json.loads((tmp_path / LOCK_FILE).read_text())["process"]
        theirs = tmp_path / "images" / f".picture.{dead}-0123abcd.png"
        theirs.parent.mkdir()
        for path in (mine, theirs, tmp_path / ".hidden.png"):
            path.touch()
        FolderLock(tmp_path).release()
        assert mine.exists() and (tmp_path / ".hidden.png").exists()
        assert not theirs.exists()


class TestABegunFolder:
    def test_must_be_empty(self, tmp_path: Path) -> None:
        (tmp_path / "mine").touch()
        with pytest.raises(OutputError, match="not empty"), begun(tmp_path, ["a"]):
            pass
        assert names(tmp_path) == {"mine"}

    def test_that_fails_leaves_what_others_put_there(self, tmp_path: Path) -> None:
        out = tmp_path / "out"
        with pytest.raises(ZeroDivisionError), begun(out, ["a", "inner/b"]):
            (out / "inner").mkdir()
            for name in ("a", "inner/b", "inner/mine", "mine"):
                (out / name).touch()
            raise ZeroDivisionError
        assert names(out) == {"mine", "inner", "inner/mine"}

    def test_that_fails_is_gone_where_it_was_not_there(self, tmp_path: Path) -> None:
        with pytest.raises(KeyboardInterrupt), begun(tmp_path / "new" / "out", ["a"]):
            (tmp_path / "new" / "out" / "a").touch()
            raise KeyboardInterrupt
        assert names(tmp_path) == set()
