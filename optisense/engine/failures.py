"""Errors of requests, and their representation as data."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from optisense.design import Diagnostic, SensorDesign
from optisense.errors import OptiSenseError
from optisense.own_code import as_user_error


class ProtocolError(OptiSenseError):
    """Invalid request, or line that is no request: an error of the front end."""

    def __init__(
        self,
        message: str,
        *,
        where: str | None = None,
        hint: str | None = None,
        request: int | str | None = None,
    ) -> None:
        super().__init__(message, where=where, hint=hint)
        self.request = request


class Cancelled(BaseException):
    """Raised at a safe point of a request that was cancelled.

    It is not an `Exception`, so that code which reports any failure of a score lets it pass.
    """


class WrongContactError(OptiSenseError):
    """Error about one of a request's contacts.

    Attributes:
        number: index of the contact, from 0.
        kind: kind of the error in the protocol.
    """

    def __init__(self, error: OptiSenseError, number: int) -> None:
        where = error.where or f"contacts[{number}]"
        super().__init__(error.message, where=where, hint=error.hint)
        self.number = number
        self.kind = type(error).__name__


class InvalidDesignError(OptiSenseError):
    """Error about a design that `check` refuses, with all problems that it found."""

    def __init__(self, problems: Sequence[Diagnostic], source: str) -> None:
        errors = [problem for problem in problems if problem.severity == "error"]
        first = errors[0]
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        super().__init__(first.message + more, where=first.where, hint=first.hint)
        self.problems = list(problems)
        self.source = source


def as_data(error: BaseException, design: SensorDesign | None = None) -> dict[str, Any]:
    """Return an error as data of the protocol.

    Args:
        error: an error of any kind; an `OptiSenseError` tells its place and a remedy.
        design: design of the request, in which the part is looked up.
    """
    told = as_user_error(
        OptiSenseError("the request was cancelled") if isinstance(error, Cancelled) else error,
        less_work="Use a smaller resolution or fewer photons",
        see="the log of the engine",
    )
    if isinstance(error, Cancelled):
        kind = "Cancelled"
    elif isinstance(error, InvalidDesignError):
        kind = "DesignError"
    elif isinstance(error, WrongContactError):
        kind = error.kind
    else:
        is_defect = told is not error and type(told) is OptiSenseError
        kind = "InternalError" if is_defect else type(told).__name__
    problems = error.problems if isinstance(error, InvalidDesignError) else ()
    return {
        "kind": kind,
        **_row(told, design),
        "contact": error.number if isinstance(error, WrongContactError) else None,
        "problems": [problem_row(problem, design) for problem in problems],
    }


def problem_row(problem: Diagnostic, design: SensorDesign | None) -> dict[str, Any]:
    """Return a problem that `check` found as data, with the part that it is about."""
    return {"severity": problem.severity, **_row(problem, design)}


def _row(told: OptiSenseError | Diagnostic, design: SensorDesign | None) -> dict[str, Any]:
    path = path_in(told.where)
    return {
        "message": told.message,
        "where": told.where,
        "hint": told.hint,
        "path": path,
        "part": part_of(told.message, path, list(design.parts) if design else [], design),
    }


def path_in(where: str | None) -> str | None:
    """Return the place of an error if it is a dotted path of the design, else None."""
    if where is None:
        return None
    found = _PATH.fullmatch(where)
    return where if found else None


def part_of(
    message: str, path: str | None, known: Sequence[str], design: SensorDesign | None = None
) -> str | None:
    """Return the part that an error is about: by its path, or else by its name in the message."""
    if path is not None:
        found = re.match(r"parts\.([A-Za-z0-9_-]+)", path)
        if found:
            return found[1]
    for text in re.findall(r"'([^']+)'", message):
        if text in known:
            return str(text)
    if path is not None and design is not None:
        found = re.match(r"cages\.([A-Za-z0-9_-]+)", path)
        if found and found[1] in design.cages:
            return design.cages[found[1]].parts[0]
    return None


_PATH = re.compile(
    r"(schema_version|name|description|coating|materials|parts|lights|camera|cages|provenance)"
    r"(\.[A-Za-z0-9_-]+|\[\d+\])*"
)
