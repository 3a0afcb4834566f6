"""Version of the installed package."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("optisense")
except PackageNotFoundError:  # running from a source folder that is not installed
    __version__ = "0+unknown"
