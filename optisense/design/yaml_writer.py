"""Writer of a design as YAML, with the unit of each number in a comment."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from enum import Enum
from typing import Any

from pydantic import BaseModel

from optisense.design.cage import Point, Share
from optisense.design.lights import Light
from optisense.design.sensor_design import Provenance

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*$")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off"}
_NOT_PRINTABLE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff\ud800-\udfff]")

TABLE_ROWS = 5
"""Number of rows from which on a list of lists is written with one row per line; a matrix of three
rows is written on one line.
"""

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
