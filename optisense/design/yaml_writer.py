"""Writer of a design as YAML, with the units of numbers and the user's remarks in comments."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from enum import Enum
from typing import Any, NamedTuple

import yaml
from pydantic import BaseModel

from optisense.design.cage import Point, Share
from optisense.design.fields import Steps
from optisense.design.lights import Light
from optisense.design.sensor_design import Provenance
from optisense.design.yaml_reader import LOADER, Lines, parse_yaml

_COMMENT = re.compile(r"#[^\r\n]*")
_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*$")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off"}
_NOT_PRINTABLE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff\ud800-\udfff]")

TABLE_ROWS = 5
"""Number of rows from which on a list of lists is written with one row per line; a matrix of three
rows is written on one line."""

ONE_LINE = (Point, Share, Light, Provenance)
"""Models that are written on one line; the comment is at the list that contains them."""


def to_yaml(model: BaseModel, head: str) -> str:
    """Return the text of a model with all fields except those that are None.

    Args:
        head: comment line for the top.
    """
    return "\n".join([f"# {head}", *_model(model, "")]) + "\n"


def _model(model: BaseModel, indent: str) -> Iterator[str]:
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if value is not None and not field.exclude:
            yield from _entry(field.alias or name, value, indent, field.description)


def _entry(key: str, value: Any, indent: str, comment: str | None) -> Iterator[str]:
    note = f"  # {comment}" if comment else ""
    head = f"{indent}{_text(key)}:"
    if _fits_one_line(value):
        yield f"{head} {_flow(value)}{note}"
        return
    yield head + note
    if isinstance(value, BaseModel):
        yield from _model(value, indent + "  ")
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from _entry(name, item, indent + "  ", None)
    else:
        for item in value:
            yield f"{indent}  - {_flow(item)}"


def _fits_one_line(value: Any) -> bool:
    if isinstance(value, BaseModel):
        return isinstance(value, ONE_LINE)
    if isinstance(value, list | tuple):
        rows = sum(isinstance(item, list | tuple) for item in value)
        return rows < TABLE_ROWS and not any(isinstance(item, BaseModel) for item in value)
    return not isinstance(value, dict) or not value


def _flow(value: Any) -> str:
    if isinstance(value, BaseModel):
        fields = {name: getattr(value, name) for name in type(value).model_fields}
        value = {name: item for name, item in fields.items() if item is not None}
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_text(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    if isinstance(value, Enum):
        return _text(str(value.value))
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)  # the shortest text that reads back as the same number


def _text(text: str) -> str:
    """Return a text without quotes if that is unambiguous, else quoted as JSON, which is YAML."""
    if _PLAIN.match(text) and text.casefold() not in _WORDS:
        return text
    quoted = json.dumps(text, ensure_ascii=False)
    return _NOT_PRINTABLE.sub(lambda match: f"\\u{ord(match[0]):04x}", quoted)


class _Comment(NamedTuple):
    """A comment with its line, counted from 1, and whether a value is on the same line."""

    text: str
    line: int
    beside: bool


def with_comments(text: str, before: str, usual: Callable[[dict[str, Any]], str]) -> str:
    """Return the text of a file with the comments of the user from its earlier text.

    Each gets a line of its own above the value that it was beside or above: the one at the same
    keys and indices. If this value is gone, or its list has another length, it is the one around
    it; after the last value, it is the end of the file.

    Args:
        text: new text, in which each line is a whole entry, as those of `to_yaml` are.
        before: earlier text.
        usual: function that returns the text that the program writes for data; the comments in it,
            and those in the new text, are not the user's.

    Raises:
        DesignError: the earlier text is not plain YAML.
    """
    old, old_lines = parse_yaml(before, "the earlier text")
    comments = _not_in(_comments(before), text)
    if not comments:
        return text
    new, new_lines = parse_yaml(text, "the new text")
    lines = text.split("\n")  # the last one is empty
    above: list[list[str]] = [[] for _ in lines]
    for comment in _not_in(comments, usual(old)):
        path = _still_there(_path_of(comment, old_lines), old, new)
        number = new_lines[path] - 1 if path else -1
        line = lines[number]
        above[number].append(line[: len(line) - len(line.lstrip())] + comment.text)
    return "\n".join(line for k, own in enumerate(lines) for line in (*above[k], own))


def _comments(text: str) -> list[_Comment]:
    """Return the comments of a YAML text, which are all that is between its tokens but space."""
    found: list[_Comment] = []
    end, line, counted = 0, 1, 0
    for token in yaml.scan(text, Loader=LOADER):
        for match in _COMMENT.finditer(text, end, token.start_mark.index):
            line += text.count("\n", counted, match.start())
            counted = match.start()
            start = text.rfind("\n", 0, counted) + 1
            found.append(_Comment(match[0].rstrip(), line, bool(text[start:counted].strip())))
        end = max(end, token.end_mark.index)
    return found


def _not_in(comments: list[_Comment], text: str) -> list[_Comment]:
    """Return the comments whose words are not those of a comment in a YAML text."""
    known = {each.text for each in _comments(text)}
    return [each for each in comments if each.text not in known]


def _path_of(comment: _Comment, lines: Lines) -> Steps:
    """Return the path of the value that a comment is beside, or else above; () at the end."""
    first = comment.line if comment.beside else comment.line + 1
    return next((path for path, line in lines.items() if path and line >= first), ())


def _still_there(path: Steps, old: Any, new: Any) -> Steps:
    """Return the path, or that of the innermost value around it that new data have, too."""
    for count, step in enumerate(path):
        if type(old) is not type(new) or (isinstance(old, list) and len(old) != len(new)):
            return path[:count]
        if isinstance(new, dict) and step not in new:
            return path[:count]
        old, new = old[step], new[step]
    return path
