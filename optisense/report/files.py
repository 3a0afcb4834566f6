"""Templates to read and pages to write."""

from __future__ import annotations

from importlib.resources import files


def template(name: str) -> str:
    """A file of the package's templates as text."""
    return (files("optisense.report") / "templates" / name).read_text(encoding="utf-8")
