"""Whether STEP files can be read and written here."""

from __future__ import annotations

import pytest


def _imports() -> bool:
    try:
        import OCP.STEPCAFControl  # noqa: F401
    except ImportError:
        return False
    return True


needs_step = pytest.mark.skipif(
    not _imports(), reason="the extra 'step', or libGL for it, is not installed"
)
