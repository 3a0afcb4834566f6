"""The light ledger as text."""

from __future__ import annotations

from typing import Any

MOST_LINES = 6
"""Largest number of lines for a light group: the largest shares; one more line sums up the rest."""

LEAST = 0.002
"""Share of the light below which no line is written, 0.2 %: it would not be worth reading."""


def group_rows(ledger: dict[str, Any]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return for each light group a title and lines (place, amount), the largest share first.

    Args:
        ledger: light ledger as the engine's answer holds it.
    """
    found = []
    for group, emitted in ledger["emitted"].items():
        rows = [row for row in ledger["entries"] if row["group"] == group]
        rows.sort(key=lambda row: -row["share"])
        shown = [row for row in rows[:MOST_LINES] if row["share"] >= LEAST]
        lines = [(_capital(row["where"]), per_cent(row["share"])) for row in shown]
        rest = sum(row["share"] for row in rows) - sum(row["share"] for row in shown)
        if rest >= LEAST:
            lines.append(("Elsewhere", per_cent(rest)))
        lines.append(("At the lens", f"{1000 * ledger['camera']['irradiance'][group]:.3g} µW/mm²"))
        found.append((f"{group}: {emitted:.3g} mW", lines))
    return found


def place_text(place: dict[str, Any]) -> list[str]:
    """Return for each light group a line with the brightness of a place and its light's ways."""
    lines = []
    for group, light in place["groups"].items():
        ways = sorted(light["ways"].items(), key=lambda way: -way[1])
        named = ", ".join(f"{per_cent(share)} {name}" for name, share in ways if share >= LEAST)
        lines.append(
            f"{group} here: {light['of_mean_in_view']:.2f} of the mean in view; {named or 'none'}"
        )
    return lines


def per_cent(share: float) -> str:
    """Return a share, 0 to 1, as text in per cent."""
    return f"{100 * share:.1f} %"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
