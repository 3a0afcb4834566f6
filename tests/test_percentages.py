"""Bounds in per cent hold as written, and have no exponents."""

from __future__ import annotations

import pytest

from optisense.percentages import bound_percent


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"),
        (0.000681, "0.069 %"),
        (0.07, "7 %"),  # 7.000000000000001 in floating point
        (0.0912, "9.2 %"),
        (0.0991, "10 %"),
        (0.1, "10 %"),
        (1.234, "130 %"),
    ],
)
def test_a_bound_is_rounded_up_and_has_no_exponent(share: float, text: str) -> None:
    assert bound_percent(share) == text
