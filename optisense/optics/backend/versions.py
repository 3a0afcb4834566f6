"""The versions of the software that made a result."""

from __future__ import annotations

import platform

from optisense.version import version_of


def versions(variant: str) -> dict[str, str]:
    """Return the versions of the packages that affect rendered values, for the record of a run."""
    packages = ("optisense", "mitsuba", "drjit", "numpy")
    installed = {name: version_of(name) for name in packages}
    return {"python": platform.python_version(), "variant": variant, **installed}
