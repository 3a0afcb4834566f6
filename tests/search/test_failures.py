"""Failed trials are grouped by the cause of the failure and not by its place."""

from __future__ import annotations

from optisense.search.evaluation.outcome import Outcome
from optisense.search.space.search_space import BoundSpace
from optisense.search.study.failures import cause_of, causes_among, is_defect
from optisense.search.study.trial import Trial

CROSSING = "parts '{}' and '{}' cut through each other at ({}, 11.51, 86.87) mm"


def test_the_same_parts_are_one_cause_wherever_they_meet(two_numbers: BoundSpace) -> None:
    places = (("M1", "body", "-3.76"), ("M2", "body", "1.20"), ("M1", "body", "16.32"))
    failed = [Outcome.of_failure(["near"], CROSSING.format(*place)) for place in places]
    found = causes_among(
        Trial(number, 0, two_numbers.start, outcome, two_numbers)
        for number, outcome in zip((3, 7, 8), failed, strict=True)
    )
    assert [[each.number for each in cause.trials] for cause in found] == [[3, 8], [7]]
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
