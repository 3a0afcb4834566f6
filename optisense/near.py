"""Near matches for misspelt names."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def near_match(word: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate most similar to `word`, or None if none is similar."""
    folded = {candidate.casefold(): candidate for candidate in candidates}
    matches = get_close_matches(word.casefold(), folded, n=1, cutoff=0.6)
    return folded[matches[0]] if matches else None


def suggestion(word: str, candidates: Iterable[str], limit: int = 12) -> str | None:
    """Return 'Did you mean ...?', or the list of candidates if it is short, or None."""
    names = sorted(candidates)
    match = near_match(word, names)
    if match is not None:
        return f"Did you mean '{match}'?"
    if 0 < len(names) <= limit:
        return "Known: " + ", ".join(names)
    return None
