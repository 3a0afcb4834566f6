"""Comments that a user has written into a YAML file, carried over when the file is written anew."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

import yaml

from optisense.design.fields import Steps
from optisense.design.yaml_reader import LOADER, Lines, parse_yaml

_COMMENT = re.compile(r"#[^\r\n]*")


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
