"""What software made a result."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version


def versions(variant: str) -> dict[str, str]:
    """Versions of the packages that decide a rendered number, for a run's record."""
    out = {"python": platform.python_version(), "variant": variant}
    for name in ("optisense", "mitsuba", "drjit", "numpy"):
        try:
            out[name] = version(name)
        except PackageNotFoundError:
            out[name] = "unknown"
    return out
