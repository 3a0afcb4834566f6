"""Escaping of text from untrusted files for a terminal, a shell, Markdown, HTML and spreadsheets.

A design, a study or a library entry may come from a stranger. Its names and descriptions may hold
characters that move the cursor or clear the screen, reverse the direction of the text after them,
end a table's cell, or are HTML. All code that shows such text escapes it with these functions.
"""

from __future__ import annotations

import html
import json
import re
import shlex
import unicodedata

LINE_BREAKS = "\n\t"
"""Control characters that are only white space."""

DIRECTIONS = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Characters that change the direction of the text after them."""

MARKDOWN = re.compile(r"[\\`*{}\[\]#!|~$]|(?<!\w)_|_(?!\w)")
"""Pattern of characters that have a meaning in Markdown; '_' within a word has none."""


def visible(text: str) -> str:
    """Return text whose control characters are shown as Python writes them, such as ``\\x1b``.

    Line breaks and tabs are kept. The result is for terminals.
    """
    if text.isprintable():
        return text
    return "".join(_shown(letter) for letter in text)


MOST_QUOTED = 80
"""Largest number of characters of a value that a message quotes; it fits a line of a terminal."""


def brief(text: str) -> str:
    """Return a text for quoting in a message, cut off if it is long."""
    return text if len(text) <= MOST_QUOTED else text[: MOST_QUOTED - 3] + "..."


def one_line(text: str) -> str:
    """Return a visible text with single spaces for all white space."""
    return visible(" ".join(text.split()))


def argument(name: object) -> str:
    """Return the name of a file or folder as an argument of a command that users copy to a shell:
    quoted if it has spaces or other special characters, and behind ``./`` if it begins with a dash.
    """
    text = str(name)
    return shlex.quote(f"./{text}" if text.startswith("-") else text)


def markdown(text: str) -> str:
    """Escape text for a line or a table's cell of Markdown."""
    return MARKDOWN.sub(r"\\\g<0>", html.escape(one_line(text), quote=False))


def to_html(text: str) -> str:
    """Escape text for HTML or SVG, in an element or a quoted attribute."""
    return html.escape(visible(text), quote=True)


def shown_in_html(value: object) -> object:
    """Return a value as templates with automatic escaping shall escape it."""
    return visible(value) if type(value) is str else value


def cell(text: str) -> str:
    """Escape text for a CSV file that spreadsheets open, so that it is no formula."""
    shown = visible(text)
    return f"'{shown}" if shown.startswith(("=", "+", "-", "@")) else shown


def _shown(letter: str) -> str:
    if letter in LINE_BREAKS:
        return letter
    if unicodedata.category(letter) in ("Cc", "Cs") or letter in DIRECTIONS:
        return letter.encode("unicode_escape", "surrogatepass").decode("ascii")
    return letter


def lone_surrogate(value: object) -> str:
    r"""Return the first lone surrogate in the text of plain data, as ``\ud800``; "" if none.

    Such halves of characters come from escapes in JSON, and from bytes on the command line that are
    not UTF-8. They can't be written as UTF-8.
    """
    try:
        json.dumps(value, ensure_ascii=False, default=str).encode()
    except UnicodeEncodeError as found:
        return found.object[found.start].encode("unicode-escape").decode()
    return ""
