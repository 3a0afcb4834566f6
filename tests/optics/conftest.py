"""Tests of optics run on the processor, or where OPTISENSE_TEST_VARIANT says."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from optisense.optics.backend.variant import use_variant

# Before any test module imports what needs a variant.
use_variant(os.environ.get("OPTISENSE_TEST_VARIANT", "llvm"))
# For `reference_scenes`, which several of them share.
sys.path.insert(0, str(Path(__file__).parent))

if TYPE_CHECKING:
    from optisense.optics import OpticalModel


@pytest.fixture(scope="session")
def plain_mini() -> OpticalModel:
    """A GelSight Mini with a flat gel and an ideal camera; tests don't change it."""
    from optisense.optics import OpticalModel
    from optisense.sensors import build

    return OpticalModel(build("gelsight-mini-ideal"), "llvm")


@pytest.fixture
def few_contact_rays(monkeypatch: pytest.MonkeyPatch) -> None:
    """One ray from contacts for each photon instead of four, which suffices for means and takes
    half the time.
    """
    monkeypatch.setattr("optisense.optics.imaging._traced_light.CONTACT_RAYS", 1.0)
