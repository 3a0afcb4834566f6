"""The code blocks of a Markdown page, and what the page says about running them.

The first word after a fence is its language. The words after it are read here and shown by neither
GitHub nor Sphinx:

```console                          the commands after "$ "; each must end with exit code 0
```console exit=2                   the commands end with this exit code
```console enter                    the reader presses Enter at every question
```console long                     takes minutes; a quick variant is typed, too
```console not-run="opens Blender"  can't be run by a test, for this reason
```python                           typed into one Python session for each page
```python save=rules.py             saved under this name (a block of any language)
```
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

RUN = ("console", "python")
"""Languages of the blocks that are run. Blocks of the others are saved, if they say so."""

_WITH_VALUE = ("exit", "not-run", "save")
_WITHOUT_VALUE = ("enter", "long")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    page: Path
    line: int
    """The line of the fence, counted from 1."""
    language: str
    text: str
    save: str | None = None
    """The file name under which the page tells the reader to save the block."""
    exit_code: int = 0
    enter: bool = False
    """Whether Enter answers every question that a command asks."""
    long: bool = False
    not_run: str | None = None
    """The reason why no test runs the block."""

    @property
    def place(self) -> str:
        """Such as ``search.md:12``."""
        return f"{self.page.name}:{self.line}"

    @property
    def commands(self) -> list[str]:
        """The commands of a console block, without the prompt.

        A line that ends with a backslash goes on in the next one. Lines without a prompt are
        output.
        """
        lines = iter(self.text.splitlines())
        return ["\n".join(_command(line[2:], lines)) for line in lines if line.startswith("$ ")]


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, in order.

    Raises ValueError, with the place, where a fence says something that is not understood.
    """
    tokens = MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8"))
    return [
        _block(page, token.map[0] + 1, token.info, token.content)
        for token in tokens
        if token.type == "fence" and token.map is not None
    ]


def code_spans(page: Path) -> list[str]:
    """The texts in backquotes, tables included, in order."""
    tokens = MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8"))
    children = (child for token in tokens for child in token.children or ())
    return [child.content for child in children if child.type == "code_inline"]


def _command(first: str, following: Iterator[str]) -> Iterator[str]:
    yield first
    while first.endswith("\\"):
        first = next(following)
        yield first


def _block(page: Path, line: int, info: str, text: str) -> Block:
    language, *words = shlex.split(info) or [""]
    said: dict[str, str] = {}
    for word in words:
        name, _, value = word.partition("=")
        if name not in (_WITH_VALUE if value else _WITHOUT_VALUE):
            raise ValueError(f"{page.name}:{line}: {word!r} after the fence is not understood")
        said[name] = value
    return Block(
        page,
        line,
        language,
        text,
        save=said.get("save"),
        exit_code=int(said.get("exit", 0)),
        enter="enter" in said,
        long="long" in said,
        not_run=said.get("not-run"),
    )
