"""Version of the installed package."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version


@cache
def version_of(package: str, missing: str = "unknown") -> str:
    """Return the version of an installed package, or `missing` if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return missing


__version__ = version_of("optisense", "0+unknown")  # of a source folder that is not installed
