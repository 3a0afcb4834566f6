"""The pages of the documentation that come with the extension, as plain text."""

from __future__ import annotations

import re
from pathlib import Path

_PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)\n*")
_LINK = re.compile(r"\[([^\]]*)\]\(([^)]*)\)")


def folder() -> Path:
    """Where the pages are: in the extension, or in the project that it is run from."""
    own = Path(__file__).parents[1] / "help"
    return own if own.is_dir() else Path(__file__).parents[2] / "docs"


def page(name: str) -> str:
    """A page without its pictures and the addresses of its links.

    Raises:
        OSError: it is not there.
    """
    text = (folder() / f"{name}.md").read_text(encoding="utf-8")
    return _LINK.sub(r"\1", _PICTURE.sub("", text))


def line_of(text: str, begins: str) -> int:
    """The first line that begins with some words, the first line of all is 0; 0 where none does."""
    lines = text.splitlines()
    return next((number for number, line in enumerate(lines) if line.startswith(begins)), 0)
