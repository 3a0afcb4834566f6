"""Pictures of what the library holds, drawn by the engine when they are first asked for."""

from __future__ import annotations

from typing import Any

from ..core.engine import EngineError
from ..engine import catalogue, session
from ..simulate.picture import file_icon

_files: dict[tuple[str, str], str] = {}
_asked: set[tuple[str, str]] = set()
_items: dict[str, tuple[catalogue.Items, list[tuple[Any, ...]]]] = {}
"""Choices of each kind, and the list that they were made for."""

_numbers: dict[str, dict[str, int]] = {}
"""What Blender keeps of a choice: each entry has its own, wherever it is in the list."""


def items(kind: str) -> list[tuple[Any, ...]]:
    """A kind of the library as choices of a menu, with those pictures that are drawn."""
    plain = catalogue.items(kind)
    # Kept, as Blender asks for, and made anew for another list or picture only: this is asked for
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
    """The numbers of a kind's entries; those that have gone are forgotten."""
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
    """The file of an entry's picture; empty while there is none."""
    return _files.get((kind, name), "")


def is_begun(kind: str) -> bool:
    """Whether a picture of this kind is drawn."""
    return any(each == kind for each, _ in _files)


def missing(kind: str) -> list[str]:
    """Entries of this kind that have no picture, and none on its way."""
    names = [row["name"] for row in catalogue.entries(kind)]
    return [name for name in names if (kind, name) not in _asked]


def draw_missing(kind: str) -> None:
    """Ask for the pictures that are missing; each is shown when it is there."""
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
    """How many pictures are on their way."""
    return sum(each == kind for each, _ in _asked - _files.keys())


def forget(kind: str, name: str) -> None:
    """The entry has changed: its picture is of the one before."""
    _files.pop((kind, name), None)
    _items.pop(kind, None)
    _asked.discard((kind, name))


def unregister() -> None:
    _files.clear()
    _asked.clear()
    _items.clear()
    _numbers.clear()
