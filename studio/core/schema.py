"""Kinds of emitters, materials and coatings, and their fields, as the engine describes them."""

from __future__ import annotations

from typing import Any

Row = dict[str, Any]
"""Description of a kind or a field, as in the engine's answer to `kinds`."""

JUST_BEYOND = 1e-6
"""Distance kept from an exclusive bound, in the unit of the field."""

_told: dict[str, Any] = {}


def learn(answer: dict[str, Any]) -> None:
    """Keep the engine's answer to `kinds`."""
    _told.clear()
    _told.update(answer)


def is_known() -> bool:
    """Return whether an engine has described its kinds."""
    return bool(_told)


def kinds(noun: str) -> list[Row]:
    """Return all kinds of `emitter`, `material` or `coating`; empty before an engine answers."""
    return _told.get("kinds", {}).get(noun, [])


def fields(noun: str, kind: str) -> dict[str, Row]:
    """Return the fields of a kind by name; empty before an engine has described them."""
    found = next((row for row in kinds(noun) if row["name"] == kind), None)
    return {row["name"]: row for row in found["fields"]} if found else {}


def file_fields(noun: str, kind: str) -> list[str]:
    """Return the names of the fields of a kind that hold file names."""
    return [name for name, row in fields(noun, kind).items() if row["type"] == "file"]


def materials_of(role: str) -> list[str]:
    """Return the kinds of material of which a part with a given role can be made."""
    return _told.get("materials_of_role", {}).get(role, [])


def bounded(row: Row, value: float) -> float:
    """Return the value nearest to `value` that a field allows."""
    low = max(row.get("minimum", -1e300), row.get("above", -1e300) + JUST_BEYOND)
    high = min(row.get("maximum", 1e300), row.get("below", 1e300) - JUST_BEYOND)
    return min(max(value, low), high)


def start(row: Row) -> Any:
    """Return the initial value of a field."""
    if row["start"] is not None:
        return row["start"]
    if row["type"] == "number":
        return bounded(row, 1.0)
    if row["type"] == "numbers":
        return [bounded(row, 1.0)] * row["size"]
    if row["type"] == "choice":
        return row["choices"][0]
    return False if row["type"] == "flag" else ""


def explained(row: Row) -> str:
    """Return the help text of a field, with its bounds."""
    limits = [
        f"{word} {row[bound]:g}"
        for bound, word in (
            ("minimum", "at least"),
            ("above", "above"),
            ("maximum", "at most"),
            ("below", "below"),
        )
        if bound in row
    ]
    text = row["help"][:1].upper() + row["help"][1:]
    return ". ".join(filter(None, [text, ", ".join(limits).capitalize()]))
