"""A model that tests of objectives share."""

from __future__ import annotations

import os
from typing import Any

import pytest

from optisense.optics.backend.variant import use_variant

# Before any test module imports what needs a variant.
use_variant(os.environ.get("OPTISENSE_TEST_VARIANT", "llvm"))


@pytest.fixture(scope="module")
def model() -> Any:
    from optisense import OpticalModel, load

    return OpticalModel(load("gelsight-mini-ideal"), "llvm")
