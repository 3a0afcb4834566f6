"""Files appear whole and together, or not at all."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import pytest

from optisense.errors import OutputError
from optisense.writing import (
    FREE_SPACE,
    remedy,
    remove_own_page,
    removed_together,
    write_json,
    write_text,
    written_together,
    written_whole,
)


def test_files_appear_together_when_all_are_written(tmp_path: Path) -> None:
    one, other = tmp_path / "one.txt", tmp_path / "deep" / "other.npz"
    one.write_text("before")
    with written_together("the results") as stage:
        stage(one).write_text("after")
        temporary = stage(other)
        assert temporary.parent == other.parent and temporary.suffix == ".npz"
        temporary.write_bytes(b"data")
        assert one.read_text() == "before" and not other.exists()
    assert one.read_text() == "after" and other.read_bytes() == b"data"
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["deep", "one.txt", "other.npz"]


def test_files_are_removed_together_or_not_at_all(tmp_path: Path) -> None:
    one, other = tmp_path / "one.txt", tmp_path / "other.txt"
    one.write_text("first")
    other.write_text("second")
    with pytest.raises(NotADirectoryError), removed_together() as remove:
        remove(one)
        remove(tmp_path / "missing.txt")
        remove(other / "in a file.txt")
    assert (one.read_text(), other.read_text()) == ("first", "second")
    with removed_together() as remove:
        remove(one)
    assert list(tmp_path.iterdir()) == [other]


@pytest.mark.parametrize("error", [ValueError("a defect"), KeyboardInterrupt()])
def test_what_was_there_stays_when_something_goes_wrong(
    tmp_path: Path, error: BaseException
) -> None:
    path = tmp_path / "one.txt"
    path.write_text("before")
    with pytest.raises(type(error)), written_whole(path) as temporary:
        temporary.write_text("half of i")
        raise error
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_the_user_is_told_what_where_and_what_to_do(tmp_path: Path) -> None:
    file = tmp_path / "file"
    write_text(file, "text")
    with pytest.raises(OutputError, match="the scores can't be written") as caught:
        write_json(file / "scores.json", {}, "the scores", "Name another folder")
    assert str(file) in str(caught.value.where) and caught.value.hint == "Name another folder"
    with pytest.raises(OutputError) as caught:  # a rename that fails
        write_text(tmp_path, "text")
    assert caught.value.where == str(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_the_remedy_fits_the_reason(tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("a file")
    for path, hint in ((taken / "file", "another one"), (tmp_path / ("b" * 300), "shorter name")):
        with pytest.raises(OutputError) as caught:
            write_text(path, "text")
        assert hint in str(caught.value.hint)
    assert remedy(OSError(errno.ENOSPC, "full")).startswith("Free space")
    assert remedy(OSError(errno.EIO, "broken")) == "Choose another folder"
    for code in (errno.ENOSPC, errno.EDQUOT):
        assert remedy(OSError(code, "full"), "Name a folder of yours") == FREE_SPACE
        assert remedy(OSError(code, "full"), kept="2 remain") == f"{FREE_SPACE}. 2 remain"
    assert "2 remain" in remedy(OSError(errno.EACCES, "no"), kept="2 remain")
    assert FREE_SPACE not in remedy(OSError(errno.EACCES, "no"), kept="2 remain")
    assert remedy(OSError(errno.EACCES, "no"), "Name a folder of yours") == "Name a folder of yours"


def test_json_reads_back(tmp_path: Path) -> None:
    values = {"name": "größe", "numbers": [1, 2.5, None]}
    write_json(tmp_path / "values.json", values)
    assert json.loads((tmp_path / "values.json").read_text("utf-8")) == values


def test_only_pages_of_this_program_and_kind_are_removed(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    head = '<!DOCTYPE html><meta name="generator" content="OptiSense 0.1.0; {}">'
    for others in ("<!DOCTYPE html><p>my own page about OptiSense", head.format("search"), ""):
        page.write_text(others)
        remove_own_page(page, "render")
        assert page.read_text() == others
    page.write_text(head.format("render"))
    remove_own_page(page, "render")
    assert not page.exists()
    remove_own_page(page, "render")  # it is gone already
