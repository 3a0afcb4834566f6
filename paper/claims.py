"""Statements of the paper beside the results here; verdicts are computed from the results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

AGREES, DISAGREES, OPEN = "agrees", "disagrees", "inconclusive"
"""Verdicts on a statement."""


@dataclass(frozen=True)
class Claim:
    """One statement of the paper.

    Attributes:
        says: the statement, with the paper's numbers.
        here: the result here, with numbers.
        holds: whether the statement holds here; None if the numbers can't decide.
        why: explanation of a difference or of an open verdict; not shown if the claim holds.
    """

    says: str
    here: str
    holds: bool | None
    why: str = ""

    @property
    def verdict(self) -> str:
        """Return the verdict in words."""
        return OPEN if self.holds is None else AGREES if self.holds else DISAGREES

    def to_plain(self) -> dict[str, Any]:
        """Return the claim as plain values for JSON."""
        why = "" if self.holds else self.why
        return {**asdict(self), "why": why, "verdict": self.verdict}


@dataclass(frozen=True)
class Table:
    """Table for readers: a title, heads of columns, and rows of cells."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]

    def markdown(self) -> str:
        """Return the table as Markdown, below its title."""
        lines = [self.title + ":", ""] if self.title else []
        lines.append(_cells(self.heads))
        lines.append(_cells(["---"] * len(self.heads)))
        lines += [_cells(row) for row in self.rows]
        return "\n".join(lines)


def _cells(texts: Sequence[str]) -> str:
    """Return a row of a Markdown table."""
    return "| " + " | ".join(texts) + " |"
