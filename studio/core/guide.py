"""The pages of the documentation that come with the extension, as plain text."""

from __future__ import annotations

import re
from pathlib import Path

_PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)\n*")
_LINK = re.compile(r"\[([^\]]*)\]\(([^)]*)\)")


def folder() -> Path:
    """Return the folder of the pages: in the extension, or in the project if Blender runs from its
    source.
    """
    own = Path(__file__).parents[1] / "help"
    return own if own.is_dir() else Path(__file__).parents[2] / "docs"


def page(name: str) -> str:
    """Return the text of a page without pictures and without the addresses of links.

    Raises:
        OSError: there is no such page.
    """
    text = (folder() / f"{name}.md").read_text(encoding="utf-8")
    return _LINK.sub(r"\1", _PICTURE.sub("", text))


def line_of(text: str, begins: str) -> int:
    """Return the number of the first line, from 0, that begins with `begins`; 0 if no line does."""
    lines = text.splitlines()
    return next((number for number, line in enumerate(lines) if line.startswith(begins)), 0)
