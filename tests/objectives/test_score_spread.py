"""The deviation of a sample, which rounding does not make."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optisense.objectives.score import deviation_of


def test_equal_values_do_not_spread() -> None:
    assert np.std([0.1, 0.1, 0.1], ddof=1) > 0.0  # what NumPy says
    assert deviation_of([0.1, 0.1, 0.1]) == 0.0
    assert deviation_of([1.0, 1.0 + 1e-15, 1.0 - 1e-15]) == 0.0
    assert deviation_of([0.0, 0.0]) == 0.0


def test_others_do() -> None:
    assert deviation_of([1.0, 3.0]) == pytest.approx(math.sqrt(2.0))
    assert deviation_of([1.0, 1.00001]) == pytest.approx(7.071e-6, rel=1e-3)
    assert math.isnan(deviation_of([1.0]))
    assert math.isnan(deviation_of([]))
