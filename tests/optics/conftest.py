"""Tests of optics run on the processor, or where OPTISENSE_TEST_VARIANT says."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from optisense.optics.backend.variant import use_variant

# Before any test module imports what needs a variant.
use_variant(os.environ.get("OPTISENSE_TEST_VARIANT", "llvm"))
# For `reference_scenes`, which several of them share.
sys.path.insert(0, str(Path(__file__).parent))
