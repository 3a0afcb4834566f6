"""Pictures of the entries of the library, drawn by the engine when they are first requested."""

from __future__ import annotations

from typing import Any

from ..core.engine import EngineError
from ..engine import catalogue, session
from ..simulate.picture import file_icon

_files: dict[tuple[str, str], str] = {}
_asked: set[tuple[str, str]] = set()
_items: dict[str, tuple[catalogue.Items, list[tuple[Any, ...]]]] = {}
"""Choices of each kind, and the list of which they were made."""

_numbers: dict[str, dict[str, int]] = {}
"""Number of each entry by kind and name, which Blender stores for a choice; it does not depend on
the place in the list.
"""


def items(kind: str) -> list[tuple[Any, ...]]:
    """Return the entries of a kind of the library as choices of a menu, with any pictures."""
    plain = catalogue.items(kind)
    # Kept alive, as Blender requires, and rebuilt only for another list or picture: this is called
    # at each drawing of the panel.
    made_for, found = _items.get(kind, (None, []))
    if made_for is not plain:
        numbers = _numbered(kind, [name for name, *_ in plain])
        found = [
            (name, title, text, file_icon(picture(kind, name)), numbers.get(name, 0))
            for name, title, text in plain
        ]
        _items[kind] = plain, found
    return found


def _numbered(kind: str, names: list[str]) -> dict[str, int]:
    """Return the numbers of a kind's entries; those of removed entries are forgotten."""
    if not catalogue.entries(kind):
        return {}
    numbers = _numbers.setdefault(kind, {})
    for gone in numbers.keys() - set(names):
        del numbers[gone]
        forget(kind, gone)
    for name in names:
        numbers.setdefault(name, max(numbers.values(), default=-1) + 1)
    return numbers


def picture(kind: str, name: str) -> str:
    """Return the file of an entry's picture; empty if there is none yet."""
    return _files.get((kind, name), "")


def is_begun(kind: str) -> bool:
    """Return whether at least one picture of a kind is drawn."""
    return any(each == kind for each, _ in _files)


def missing(kind: str) -> list[str]:
    """Return the entries of a kind whose picture is neither drawn nor requested."""
    names = [row["name"] for row in catalogue.entries(kind)]
    return [name for name in names if (kind, name) not in _asked]


def draw_missing(kind: str) -> None:
    """Request the missing pictures; each is shown when it arrives."""
    for name in missing(kind):
        _asked.add((kind, name))

        def drawn(result: dict[str, Any], name: str = name) -> None:
            _files[kind, name] = result["files"]["picture"]
            _items.pop(kind, None)
            session.redraw()

        def failed(error: EngineError, name: str = name) -> None:
            _asked.discard((kind, name))
            session.say(error)

        session.ask(
            "preview", drawn, failed, kind=kind, entry=name, ball=True, name=f"{kind}-{name}"
        )


def waiting(kind: str) -> int:
    """Return the number of pictures of a kind that are requested and not yet drawn."""
    return sum(each == kind for each, _ in _asked - _files.keys())


def forget(kind: str, name: str) -> None:
    """Forget the picture of an entry that has changed."""
    _files.pop((kind, name), None)
    _items.pop(kind, None)
    _asked.discard((kind, name))


def unregister() -> None:
    _files.clear()
    _asked.clear()
    _items.clear()
    _numbers.clear()
