"""The kinds of emitters, materials and coatings, and their fields, as the engine tells them."""

from __future__ import annotations

from typing import Any

Row = dict[str, Any]
"""A kind or a field, as the engine's answer to `kinds` has it."""

JUST_BEYOND = 1e-6
"""The distance kept from an exclusive bound, in the number's own unit."""

_told: dict[str, Any] = {}


def learn(answer: dict[str, Any]) -> None:
    """Keep the engine's answer to `kinds`."""
    _told.clear()
    _told.update(answer)


def is_known() -> bool:
    """Whether an engine has told its kinds."""
    return bool(_told)


def kinds(noun: str) -> list[Row]:
    """All kinds of an `emitter`, `material` or `coating`; none before an engine has told."""
    return _told.get("kinds", {}).get(noun, [])


def fields(noun: str, kind: str) -> dict[str, Row]:
    """The fields of a kind, by name; none where no engine has told."""
    found = next((row for row in kinds(noun) if row["name"] == kind), None)
    return {row["name"]: row for row in found["fields"]} if found else {}


def file_fields(noun: str, kind: str) -> list[str]:
    """The fields of a kind that name files."""
    return [name for name, row in fields(noun, kind).items() if row["type"] == "file"]


def materials_of(role: str) -> list[str]:
    """The kinds of material that a part of a role can be made of."""
    return _told.get("materials_of_role", {}).get(role, [])


def bounded(row: Row, value: float) -> float:
    """The number nearest to a value that a field can have."""
    low = max(row.get("minimum", -1e300), row.get("above", -1e300) + JUST_BEYOND)
    high = min(row.get("maximum", 1e300), row.get("below", 1e300) - JUST_BEYOND)
    return min(max(value, low), high)


def start(row: Row) -> Any:
    """A value to begin with."""
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
    """What a field is, and between which bounds."""
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
