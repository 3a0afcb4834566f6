"""The versions of the software that made a result."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version


def versions(variant: str) -> dict[str, str]:
    """Versions of the packages that decide a rendered number, for a run's record."""
    return {"python": platform.python_version(), "variant": variant, **_installed()}


@cache
def _installed() -> dict[str, str]:
    out = {}
    for name in ("optisense", "mitsuba", "drjit", "numpy"):
        try:
            out[name] = version(name)
        except PackageNotFoundError:
            out[name] = "unknown"
    return out
