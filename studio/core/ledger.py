"""A light ledger in words."""

from __future__ import annotations

from typing import Any

MOST_LINES = 6
"""Lines of a light group: the largest shares; what is left is summed up in one more."""

LEAST = 0.002
"""Share of the light below which a line is not worth reading, 0.2 %."""


def told(ledger: dict[str, Any]) -> list[tuple[str, list[tuple[str, str]]]]:
    """For each light group a title, and by share where its light went.

    Args:
        ledger: as the engine answers it.
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


def told_of_place(place: dict[str, Any]) -> list[str]:
    """For each light group a line that says how bright a place is, and by which ways."""
    lines = []
    for group, light in place["groups"].items():
        ways = sorted(light["ways"].items(), key=lambda way: -way[1])
        named = ", ".join(f"{per_cent(share)} {name}" for name, share in ways if share >= LEAST)
        lines.append(
            f"{group} here: {light['of_mean_in_view']:.2f} of the mean in view; {named or 'none'}"
        )
    return lines


def per_cent(share: float) -> str:
    """A share, 0 to 1, as text."""
    return f"{100 * share:.1f} %"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
