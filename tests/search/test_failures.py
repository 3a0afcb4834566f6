"""Failed trials are grouped by the cause of the failure and not by its place."""

from __future__ import annotations

from optisense.search.study.failures import by_cause, cause_of, is_defect

CROSSING = "parts '{}' and '{}' cut through each other at ({}, 11.51, 86.87) mm"


def test_the_same_parts_are_one_cause_wherever_they_meet() -> None:
    found = by_cause(
        [
            (3, CROSSING.format("M1", "body", "-3.76")),
            (7, CROSSING.format("M2", "body", "1.20")),
            (8, CROSSING.format("M1", "body", "16.32")),
        ]
    )
    assert [cause.numbers for cause in found] == [[3, 8], [7]]
    assert found[0].text == "parts 'M1' and 'body' cut through each other"
    assert found[0].example == CROSSING.format("M1", "body", "-3.76")


def test_numbers_do_not_make_causes_but_names_do() -> None:
    assert cause_of("61 mW are too hot") == cause_of("70.5 mW are too hot")
    assert cause_of("no light 'led2'") != cause_of("no light 'led3'")
    assert cause_of("the place M1 fails") != cause_of("the place M2 fails")
    assert cause_of("part '1' is thin") != cause_of("part '2' is thin")


def test_the_line_of_an_error_is_part_of_its_cause() -> None:
    told = "RuntimeError: {} mW are too hot (/home/me/mine.py:12)"
    assert cause_of(told.format(61)) == cause_of(told.format(70.5))
    assert cause_of(told.format(61)).endswith("(/home/me/mine.py:12)")
    assert is_defect(told)
    assert not is_defect("parts 'M1' and 'body' cut through each other")
