"""Tables that are killed at any byte, and settings that are compared."""

from __future__ import annotations

import hashlib
import resource
from pathlib import Path
from typing import Any

import pytest

from optisense import load
from optisense.design.difference import mesh_digests
from optisense.errors import OutputError, TaskError
from optisense.tasks._records import CsvTable, read_object, refuse_differences
from optisense.untrusted_files import read_table

COLUMNS = ("name", "value")
ROWS = [{"name": 'a, "quoted" word', "value": 0.1}, {"name": "b", "value": 1 / 3}]


def filled(path: Path) -> CsvTable:
    table = CsvTable(path, COLUMNS)
    for row in ROWS:
        table.add(row)
    table.close()
    return table


def test_numbers_and_words_come_back(tmp_path: Path) -> None:
    filled(tmp_path / "t.csv")
    rows = CsvTable(tmp_path / "t.csv", COLUMNS).rows
    assert [(row["name"], float(row["value"])) for row in rows] == [
        (row["name"], row["value"]) for row in ROWS
    ]


def test_cut_off_anywhere_it_continues_to_the_same_file(tmp_path: Path) -> None:
    filled(tmp_path / "whole.csv")
    content = (tmp_path / "whole.csv").read_bytes()
    for length in range(len("name,value\n"), len(content)):
        path = tmp_path / "cut.csv"
        path.write_bytes(content[:length])
        table = CsvTable(path, COLUMNS)
        for row in ROWS[len(table.rows) :]:
            table.add(row)
        table.close()
        assert path.read_bytes() == content


def test_a_row_that_does_not_fit_on_the_disk_leaves_no_trace(tmp_path: Path) -> None:
    """A limit on the size of files stops writing in the middle of a row, as a full disk does."""
    path = tmp_path / "t.csv"
    table = CsvTable(path, COLUMNS)
    table.add(ROWS[0])
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 3, limits[1]))
    try:
        with pytest.raises(OutputError, match="the results can't be written"):
            table.add(ROWS[1])
        assert path.read_bytes() == before
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    table.add(ROWS[1])
    table.close()
    assert path.read_bytes() == filled(tmp_path / "whole.csv").path.read_bytes()


def test_a_row_that_is_interrupted_leaves_no_trace(tmp_path: Path) -> None:
    """Ctrl-C comes between two writes of a row, as on a disk that takes a part at a time."""

    class Interrupted:
        def __init__(self, file: Any) -> None:
            self._file, self._writes = file, 0

        def write(self, data: bytes) -> int:
            self._writes += 1
            if self._writes > 1:
                raise KeyboardInterrupt
            return int(self._file.write(data[:2]))

        def __getattr__(self, name: str) -> Any:
            return getattr(self._file, name)

    table = CsvTable(tmp_path / "t.csv", COLUMNS)
    table.add(ROWS[0])
    file = table._file
    table._file = Interrupted(file)  # type: ignore[assignment]
    with pytest.raises(KeyboardInterrupt):
        table.add(ROWS[1])
    table._file = file
    table.add(ROWS[1])
    table.close()
    assert table.path.read_bytes() == filled(tmp_path / "whole.csv").path.read_bytes()


def test_readers_leave_out_a_row_that_is_being_written(tmp_path: Path) -> None:
    content = filled(tmp_path / "t.csv").path.read_bytes()
    row_cut_in_a_letter = "größe".encode()[:3]
    (tmp_path / "t.csv").write_bytes(content + row_cut_in_a_letter)
    assert [row["name"] for row in read_table(tmp_path / "t.csv", TaskError)] == [
        row["name"] for row in ROWS
    ]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"name,value\ra,1\rb,2\r", "no line break"),
        (b'name,value\n"a",1\nb,"cut\noff', "unexpected end of data"),
    ],
    ids=["other line ends", "open quotes"],
)
def test_a_table_without_whole_rows_is_refused(
    content: bytes, message: str, tmp_path: Path
) -> None:
    (tmp_path / "t.csv").write_bytes(content)
    with pytest.raises(TaskError, match=message):
        read_table(tmp_path / "t.csv", TaskError)


def test_other_columns_are_refused(tmp_path: Path) -> None:
    filled(tmp_path / "t.csv")
    with pytest.raises(TaskError, match="other columns"):
        CsvTable(tmp_path / "t.csv", ("name",))


def test_other_settings_are_refused_with_their_paths() -> None:
    before = {"depth": (0.3, 1.0), "seen": {"seed": 3, "name": "x"}, "indenters": ["plane"]}
    refuse_differences("things", Path(), {**before, "depth": [0.3, 1.0]}, before)
    now = {"depth": (0.3, 0.9), "seen": {"seed": 4, "name": "x"}, "indenters": ["plane", "mesh"]}
    with pytest.raises(TaskError) as raised:
        refuse_differences("things", Path(), before, now)
    assert raised.value.message == (
        "the folder holds things with other settings:\n"
        "  depth[1]: 1 -> 0.9\n"
        "  seen.seed: 3 -> 4\n"
        '  indenters: ["plane"] -> ["plane", "mesh"]'
    )
    with pytest.raises(TaskError, match="and 2 more"):
        refuse_differences("things", Path(), {}, {str(n): n for n in range(10)})


def test_digests_of_datasets_of_older_releases_are_still_known() -> None:
    """They are those of the bytes of a mesh, as release 0.2 wrote them."""
    design = load("gelsight-mini-ideal")
    mesh = design.meshes["gel"]
    written = hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).hexdigest()
    assert mesh_digests(design)["gel"] == written


def test_json_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(TaskError, match="not JSON"):
        read_object(tmp_path / "a.json")
