"""Tests of optics run on the processor, or where OPTISENSE_TEST_VARIANT says."""

from __future__ import annotations

import os

from optisense.optics.variant import use_variant

# Before any test module imports what needs a variant.
use_variant(os.environ.get("OPTISENSE_TEST_VARIANT", "llvm"))
