"""Percentages in texts: bounds hold as written, and two that differ look different."""

from __future__ import annotations

import pytest

from optisense.percentages import bound_percent, told_apart


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"),
        (0.000681, "0.069 %"),
        (0.07, "7 %"),  # 7.000000000000001 in floating point
        (0.0912, "9.2 %"),
        (0.0991, "10 %"),
        (0.000991, "0.1 %"),
        (0.1, "10 %"),
        (1.234, "130 %"),
    ],
)
def test_a_bound_is_rounded_up_and_has_no_exponent(share: float, text: str) -> None:
    assert bound_percent(share) == text


@pytest.mark.parametrize(
    ("share", "least", "texts"),
    [
        (0.3108, 0.375, ("31.1 %", "37.5 %")),
        (0.281713, 0.281949, ("28.17 %", "28.19 %")),
        (0.0, 0.25, ("0 %", "25 %")),
        (0.99996, 1.0, ("99.996 %", "100 %")),
    ],
)
def test_two_shares_have_digits_that_tell_them_apart(
    share: float, least: float, texts: tuple[str, str]
) -> None:
    assert told_apart(share, least) == texts
