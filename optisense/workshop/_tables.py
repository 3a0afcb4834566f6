"""Entries of the workshop's tables: their digits, and the entries of the library that they name."""

from __future__ import annotations

from optisense import library
from optisense.design import LightGroup
from optisense.errors import LibraryError
from optisense.library import AnyEntry, LightEntry


def digits(value: float, places: int) -> str:
    """Format a number with fixed digits, without a minus before zero."""
    text = f"{value:.{places}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def light_entry(group: LightGroup) -> LightEntry | None:
    """Return the library's entry of a group's light, or None if there is none that can be read."""
    entry = entry_or_none("light", group.model)
    assert entry is None or isinstance(entry, LightEntry)
    return entry


def entry_or_none(kind: str, name: str) -> AnyEntry | None:
    """Return an entry of the library, or None if there is none that can be read."""
    try:
        return library.entry(kind, name)
    except LibraryError:
        return None
