"""The objectives that a text names, by name, expression or file; none of them is run."""

from __future__ import annotations

import re
from collections.abc import Iterable

from optisense.objectives.expressions import Expression
from optisense.objectives.registry import OBJECTIVES, find

_ARITHMETIC = re.compile(r"[-+*/().,'\"\s]")
"""Characters that occur in every expression with an operation, and in no name."""


def is_plain(text: str) -> bool:
    """Return whether a text names an objective or a Python file, and is no expression."""
    file = text.rpartition(":")[0] or text
    return (
        file.endswith(".py")
        or _ARITHMETIC.search(text.strip()) is None
        or text.strip().lower() in OBJECTIVES
    )


def named_in(texts: Iterable[str]) -> list[str]:
    """Return the names of the objectives in names and expressions, each once; files are kept
    unchanged.

    Raises:
        ObjectiveError: an expression can't be read.
    """
    found: dict[str, None] = {}
    for text in texts:
        inner = (text,) if is_plain(text) else Expression.parse(text).objectives
        found |= dict.fromkeys(inner)
    return list(found)


def are_rays_only(texts: Iterable[str]) -> bool:
    """Return whether all objectives trace chief rays only, as far as their names show.

    An objective in a user's file counts as one that renders, as no file is run.

    Raises:
        ObjectiveError: an expression can't be read, or an objective is unknown.
    """
    inner = named_in(texts)
    return all(not name.endswith(".py") and ".py:" not in name for name in inner) and all(
        find(name).rays_only for name in inner
    )
