"""The versions of the software that made a result."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version


def versions(variant: str) -> dict[str, str]:
    """Return the versions of the packages that affect rendered values, for the record of a run."""
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
