"""Reader of YAML from untrusted sources: plain data with the line of each value.

Only YAML's events are used, never its object construction; anchors, aliases and tags are refused,
so no input can run code or grow in memory. The bytes of the file, the number of its values, and the
depth of their nesting are bounded.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from optisense.design.fields import Steps
from optisense.errors import DesignError, OptiSenseError
from optisense.text import brief
from optisense.untrusted_files import COPY_AGAIN, MOST_TEXT, read_text

MAX_DEPTH = 50
"""Largest depth of nesting in a YAML file; a deeper file would exhaust Python's stack."""

MAX_VALUES = 300_000
"""Largest number of values in a YAML file, which take two seconds to read; a design with cages of
20 x 20 x 20 control points and their limits has 100,000."""

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""Loader of whose events and tokens alone YAML is read: the one in C, if PyYAML has it."""

_INTEGER = re.compile(r"[-+]?\d{1,300}$")
_FLOAT = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?$")
_INFINITY = re.compile(r"[-+]?\.(?:inf|Inf|INF)$")
_WORDS: dict[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}

Lines = dict[Steps, int]
"""Line of each value of a file, from 1."""


def read_yaml(
    path: Path, error: type[OptiSenseError] = DesignError
) -> tuple[dict[str, Any], Lines]:
    """Read a YAML file whose top is a mapping.

    Returns:
        The data (dict, list, str, int, float, bool, None) and the line of each value, by its keys
        and indices; the line of the whole file is under ().

    Raises:
        error: the file is missing, too large, or not plain YAML; the message names the line.
    """
    return parse_yaml(read_text(path, MOST_TEXT, error), str(path), error)


def parse_yaml(
    text: str, source: str, error: type[OptiSenseError] = DesignError
) -> tuple[dict[str, Any], Lines]:
    """Parse YAML text as `read_yaml` reads a file; `source` names it in errors."""
    try:
        return _Reader(text, source, error).read()
    except yaml.MarkedYAMLError as found:
        mark = found.problem_mark or found.context_mark
        raise error(
            f"not valid YAML: {found.problem or found.context or 'unknown problem'}",
            where=f"{source}:{mark.line + 1}" if mark else source,
            hint="Check indentation, colons and brackets there",
        ) from None
    except yaml.YAMLError as found:  # characters that YAML does not allow
        raise error(f"not valid YAML: {found}", where=source, hint=COPY_AGAIN) from None


class _Reader:
    """Parser of one YAML text, which builds plain values from its events."""

    def __init__(self, text: str, source: str, error: type[OptiSenseError]) -> None:
        self._events: Iterator[Any] = yaml.parse(text, Loader=LOADER)
        self._source = source
        self._error = error
        self._lines: Lines = {}

    def read(self) -> tuple[dict[str, Any], Lines]:
        """Return the data and the line of each value."""
        event = next(self._events)
        while isinstance(event, yaml.StreamStartEvent | yaml.DocumentStartEvent):
            event = next(self._events)
        if not isinstance(event, yaml.MappingStartEvent):
            raise self._error(
                "holds no 'key: value' lines at its top",
                where=f"{self._source}:1",
                hint="Is this the right file?",
            )
        data = self._value(event, ())
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                self._fail(event, "holds more than one document ('---')")
        return data, self._lines

    def _value(self, event: Any, path: Steps) -> Any:
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            self._fail(event, "anchors (&) and aliases (*) are not read")
        if event.tag not in (None, "!"):
            self._fail(event, f"tags are not read: {brief(event.tag)}")
        if len(path) > MAX_DEPTH:
            self._fail(event, f"nested deeper than {MAX_DEPTH} levels")
        self._lines.setdefault(path, event.start_mark.line + 1)
        if len(self._lines) > MAX_VALUES:
            self._fail(event, f"holds more than {MAX_VALUES:,} values", "Is this the right file?")
        if isinstance(event, yaml.ScalarEvent):
            plain = event.implicit[0]
            return _scalar(event.value) if plain else event.value
        if isinstance(event, yaml.SequenceStartEvent):
            items: list[Any] = []
            while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
                items.append(self._value(event, (*path, len(items))))
            return items
        return self._mapping(path)

    def _mapping(self, path: Steps) -> dict[str, Any]:
        result: dict[str, Any] = {}
        while not isinstance(key := next(self._events), yaml.MappingEndEvent):
            if not isinstance(key, yaml.ScalarEvent):
                self._fail(key, "a key must be plain text")
            if key.anchor is not None or key.tag not in (None, "!"):
                self._fail(key, "anchors and tags are not read")
            if key.value in result:
                self._fail(key, f"'{brief(key.value)}' is there twice")
            inside = (*path, key.value)
            self._lines[inside] = key.start_mark.line + 1
            result[key.value] = self._value(next(self._events), inside)
        return result

    def _fail(self, event: Any, message: str, hint: str | None = None) -> None:
        where = f"{self._source}:{event.start_mark.line + 1}"
        raise self._error(message, where=where, hint=hint)


def _scalar(text: str) -> Any:
    """Return a plain scalar by YAML 1.2's core schema (so 1e-3 is a number and `no` is text)."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.match(text):
        return int(text)
    if _FLOAT.match(text):
        return float(text)
    if _INFINITY.match(text):
        return float(text.replace(".", "", 1))
    return text
