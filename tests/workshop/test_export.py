"""Exports by formats of other packages that are at odds with others, or with themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

from optisense.design import SensorDesign
from optisense.errors import OutputError
from optisense.workshop import FORMATS, ShapeFormat, export


def write(path: Path, title: str, shapes: object) -> None:
    path.write_text(title)


def test_two_formats_that_would_write_the_same_files_are_refused(
    flat: SensorDesign, tmp_path: Path
) -> None:
    with FORMATS.forgetting():
        FORMATS.register("stl2", ShapeFormat(".STL", write))
        with pytest.raises(OutputError, match="formats 'stl' and 'stl2' would both write") as found:
            export(flat, tmp_path / "parts", ["stl", "stl2"])
        assert found.value.hint == "Export them into two folders"
        assert not (tmp_path / "parts").exists()
        files = export(flat, tmp_path / "parts", ["stl2", "stl2"])
    assert (tmp_path / "parts" / "gel.STL").read_text() == flat.name
    assert len(files) == len(set(files))


@pytest.mark.parametrize("holds_all", [False, True])
def test_a_format_that_writes_no_file_is_named(
    flat: SensorDesign, tmp_path: Path, holds_all: bool
) -> None:
    with FORMATS.forgetting():
        FORMATS.register("idle", ShapeFormat(".idle", lambda path, title, shapes: None, holds_all))
        with pytest.raises(OutputError, match="the format 'idle' wrote no file"):
            export(flat, tmp_path / "parts", ["stl", "idle"])
    assert not list((tmp_path / "parts").iterdir())
