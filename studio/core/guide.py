"""The pages of the documentation that come with the extension, as plain text."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

WIDTH = 96
"""Characters in a line of a page; longer lines are tiring to read, and the help window has room."""

_PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)\n*")
_LINK = re.compile(r"\[([^\]]*)\]\(([^)]*)\)")
_STRONG, _EMPHASIS = re.compile(r"\*\*(.+?)\*\*"), re.compile(r"\*(\S(?:.*?\S)?)\*")
_ITEM = re.compile(r"^( *)([-*]|\d+\.) +")
_FENCE = "```"


def folder() -> Path:
    """Return the folder of the pages: in the extension, or the project if run from source."""
    own = Path(__file__).parents[1] / "help"
    return own if own.is_dir() else Path(__file__).parents[2] / "docs"


def page(name: str) -> str:
    """Return the text of a page without pictures, addresses of links and marks of Markdown.

    Names of buttons are in quotes, headings are underlined, a row of a table is an item, and
    paragraphs are broken into lines of `WIDTH` characters.

    Raises:
        OSError: there is no such page.
    """
    text = (folder() / f"{name}.md").read_text(encoding="utf-8")
    pieces = _LINK.sub(r"\1", _PICTURE.sub("", text)).split(_FENCE)
    plain = [
        _code(piece) if number % 2 else "\n\n".join(map(_block, re.split(r"\n{2,}", piece)))
        for number, piece in enumerate(pieces)
    ]
    return "".join(plain)


def _code(piece: str) -> str:
    """Return a block of code without the name of its language."""
    return textwrap.indent(piece.partition("\n")[2], "    ")


def _block(block: str) -> str:
    """Return a heading, paragraph, list or table as plain text."""
    if block.lstrip().startswith("#"):
        heading = block.strip().lstrip("# ")
        return f"{heading}\n{'=' * len(heading)}"
    if block.lstrip().startswith("|"):
        rows = [[cell.strip() for cell in row.strip(" |").split("|")] for row in block.splitlines()]
        texts = [f"- {cells[0]}: {'; '.join(cells[1:])}" for cells in rows[2:]]  # below the head
        return "\n".join(_wrapped(_without_marks(text)) for text in texts)
    lines: list[str] = []
    for line in block.splitlines():  # an item of a list begins a line of its own
        if lines and line.strip() and not _ITEM.match(line):
            lines[-1] = f"{lines[-1]} {line.strip()}"
        else:
            lines.append(line)
    return "\n".join(_wrapped(_without_marks(line)) for line in lines)


def _wrapped(line: str) -> str:
    item = _ITEM.match(line)
    indent = " " * (item.end() if item else len(line) - len(line.lstrip()))
    return "\n".join(textwrap.wrap(line, WIDTH, subsequent_indent=indent, break_long_words=False))


def _without_marks(text: str) -> str:
    pieces = _STRONG.sub(r"\1", text).split("`")
    for number in range(0, len(pieces), 2):  # between them is code
        pieces[number] = _EMPHASIS.sub(r'"\1"', pieces[number])
    return "".join(pieces)


def line_of(text: str, begins: str) -> int:
    """Return the number of the first line, from 0, that begins with `begins`; 0 if no line does."""
    lines = text.splitlines()
    return next((number for number, line in enumerate(lines) if line.startswith(begins)), 0)
