"""Tests of tasks run on the processor, or where OPTISENSE_TEST_VARIANT says."""

from __future__ import annotations

import os

import pytest

from optisense.optics.variant import use_variant

use_variant(os.environ.get("OPTISENSE_TEST_VARIANT", "llvm"))

from optisense import OpticalModel, load  # noqa: E402


@pytest.fixture(scope="session")
def mini() -> OpticalModel:
    """A flat GelSight Mini; tests don't change it."""
    return OpticalModel(load("gelsight-mini"))


@pytest.fixture(scope="session")
def cylindrical_mini() -> OpticalModel:
    """A GelSight Mini bent to a cylinder; tests don't change it."""
    return OpticalModel(load("gelsight-mini-cylindrical"))
