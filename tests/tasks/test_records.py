"""Tables that are killed at any byte, and settings that are compared."""

from __future__ import annotations

from pathlib import Path

import pytest

from optisense.errors import TaskError
from optisense.tasks._records import CsvTable, differences, read_object, refuse_differences

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


def test_other_columns_are_refused(tmp_path: Path) -> None:
    filled(tmp_path / "t.csv")
    with pytest.raises(TaskError, match="other columns"):
        CsvTable(tmp_path / "t.csv", ("name",))


def test_differences_within_lists_name_the_place() -> None:
    before = {"points": [{"x": 0.0, "z": 1.0}, {"x": 0.0, "z": 2.0}], "size": [64, 48]}
    now = {"points": [{"x": 0.0, "z": 1.0}, {"x": 0.0, "z": 2.5}], "size": (80, 48)}
    assert differences(before, now) == [
        "points[1].z was 2.0, is 2.5",
        "size was [64, 48], is [80, 48]",
    ]
    assert differences(before, {**before, "points": before["points"][:1]})[0].startswith("points ")


def test_differences_name_the_path_and_both_values() -> None:
    before = {"a": 1, "b": {"c": [1, 2], "d": "x"}, "gone": True}
    now = {"a": 1, "b": {"c": (1, 2), "d": "y"}, "new": None}
    assert differences(before, now) == [
        'b.d was "x", is "y"',
        "new was nothing, is null",
        "gone was true, is nothing",
    ]
    with pytest.raises(TaskError, match="and 2 more"):
        refuse_differences("things", Path(), {}, {str(n): n for n in range(7)})


def test_json_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(TaskError, match="not JSON"):
        read_object(tmp_path / "a.json")
