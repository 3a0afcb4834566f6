"""What the paper says, held against what was found: verdicts are worked out, never written down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

AGREES, DISAGREES, OPEN = "agrees", "disagrees", "inconclusive"


@dataclass(frozen=True)
class Claim:
    """One statement of the paper.

    Attributes:
        says: the statement, with the paper's numbers.
        here: what was found, with numbers.
        holds: whether the statement holds here; None where the numbers can't tell.
        why: what explains a difference, or why it can't be told; shown unless the claim holds.
    """

    says: str
    here: str
    holds: bool | None
    why: str = ""

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        return OPEN if self.holds is None else AGREES if self.holds else DISAGREES

    def to_plain(self) -> dict[str, Any]:
        """Ready for JSON."""
        why = "" if self.holds else self.why
        return {**asdict(self), "why": why, "verdict": self.verdict}


@dataclass(frozen=True)
class Table:
    """Numbers for people: a title, heads of columns, rows of cells."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]

    def markdown(self) -> str:
        """The claims as a Markdown table under its title."""
        lines = [self.title + ":", ""] if self.title else []
        lines.append(_cells(self.heads))
        lines.append(_cells(["---"] * len(self.heads)))
        lines += [_cells(row) for row in self.rows]
        return "\n".join(lines)


def _cells(texts: Sequence[str]) -> str:
    return "| " + " | ".join(texts) + " |"
