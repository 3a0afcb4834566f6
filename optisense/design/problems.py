"""Messages for the author of a design file, made from pydantic's errors."""

from __future__ import annotations

from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from optisense.design.fields import InconsistentValueError, Model, Steps
from optisense.design.kinds import KindModel
from optisense.design.sensor_design import SensorDesign, dotted, place_of
from optisense.design.yaml_reader import Lines
from optisense.errors import DesignError, OptiSenseError
from optisense.near import near_match, suggestion
from optisense.text import brief

MAX_SHOWN = 8
"""Number of problems or differences that a message lists, to fit a terminal; others are counted."""

MAX_EXAMINED = 100
"""Largest number of problems of one file that are put into words; a damaged file may have hundreds
of thousands."""

NOT_INSTALLED = "It may be a kind of a package that is not installed here"
"""Last sentence of the hint about an unknown kind."""


@dataclass(frozen=True)
class Diagnostic:
    """Problem of a design.

    Attributes:
        message: description of the problem.
        where: file and line, part name or dotted path.
        hint: remedy, or None.
        severity: "error" (the design can't be simulated, or its simulation would be wrong) or
            "warning" (it is unusual).
    """

    message: str
    where: str
    hint: str | None = None
    severity: Literal["error", "warning"] = "error"

    def __str__(self) -> str:
        text = f"{self.message} ({self.where})"
        return f"{text}. {self.hint}" if self.hint else text


def raise_problems(problems: list[Diagnostic], source: str) -> None:
    """Raise one DesignError for all problems of severity "error" of a file or another source."""
    errors = [problem for problem in problems if problem.severity == "error"]
    if errors:
        raise _in_one(errors, source)


def _in_one(errors: list[Diagnostic], source: str, unseen: int = 0) -> DesignError:
    """Return one DesignError for one or more problems, and for the number of further ones."""
    if len(errors) == 1 and not unseen:
        only = errors[0]
        return DesignError(only.message, where=only.where, hint=only.hint)
    shown = listed(list(map(str, errors)), unseen)
    return DesignError(f"{source} has {len(errors) + unseen} problems:\n{shown}")


def listed(texts: list[str], unseen: int = 0) -> str:
    """Return the first of some texts, one per line, and how many more there are."""
    more = len(texts[MAX_SHOWN:]) + unseen
    lines = [*texts[:MAX_SHOWN], *([f"and {more} more"] if more else [])]
    return "\n".join(f"  {line}" for line in lines)


def design_error(
    error: ValidationError,
    data: Any,
    *,
    where: str = "",
    lines: Lines | None = None,
    model: type[BaseModel] = SensorDesign,
) -> DesignError:
    """Return the DesignError for an error of pydantic.

    The place `where` is a file, with `lines`, or the dotted path that was set; if it is empty, each
    problem has its own dotted path.
    """
    problems = validation_problems(error, data, where, lines, model)
    unseen = max(error.error_count() - MAX_EXAMINED, 0)
    return _in_one(problems, where or "the design", unseen)


Model.error_in_words = staticmethod(design_error)


def invalid_values(design: SensorDesign) -> list[Diagnostic]:
    """Return the problems of values that a design has got by edits inside its lists and sections,
    which are not checked when they are made.
    """
    try:
        data = design._data()
        type(design).model_validate(data)
    except DesignError as error:
        return [Diagnostic(error.message, design.where() or "design", error.hint)]
    except ValidationError as error:
        where = "" if design._source is None else str(design._source)
        return validation_problems(error, data, where, design._lines, type(design))
    return []


def kind_problems(design: SensorDesign, before: SensorDesign | None = None) -> list[Diagnostic]:
    """Return the problems of emitters, materials and others, and those that their classes have.
    Values that are equal to those of a design without problems, `before`, are not checked again.
    """
    known = {} if before is None else before.values_of_kinds()
    problems: list[Diagnostic] = []
    for path, value in design.values_of_kinds().items():
        if known.get(path) == value:
            continue
        try:
            value.verify()
        except OptiSenseError as error:
            place = error.where or design.where(*path)
            problems.append(Diagnostic(error.message, place, error.hint))
    return problems


def validation_problems(
    error: ValidationError,
    data: Any,
    where: str = "",
    lines: Lines | None = None,
    model: type[BaseModel] = SensorDesign,
) -> list[Diagnostic]:
    """Return the problems in an error of pydantic, at most `MAX_EXAMINED`; see `design_error`."""
    lines = lines or {}
    reports = error.errors(include_url=False)[:MAX_EXAMINED]
    found: list[Diagnostic] = []
    explained: set[Steps] = set()  # missing fields that a misspelt one stands for
    for report in reports:
        if report["type"] == "extra_forbidden":
            path = _path_in(data, report["loc"])
            fields = _fields_at(model, report["loc"][:-1], data)
            match = near_match(str(path[-1]), fields)
            if match is not None:
                explained.add((*path[:-1], match))
            hint = suggestion(str(path[-1]), fields, limit=20)
            found.append(
                Diagnostic(f"unknown field '{dotted(path)}'", place_of(path, where, lines), hint)
            )
    for report in reports:
        kind, location = report["type"], report["loc"]
        path = _path_in(data, location)
        context = report.get("ctx", {})
        if kind == "extra_forbidden":
            continue
        if kind == "missing":
            path = (*path, location[-1])
            if path not in explained:
                place = place_of(path, where, lines)
                found.append(Diagnostic(f"'{dotted(path)}' is missing", place, "Add it"))
            continue
        if kind in ("union_tag_invalid", "union_tag_not_found"):
            path = (*path, "kind")
            known = str(context.get("expected_tags", "")).replace("'", "").split(", ")
            tag = str(context.get("tag", ""))
            message = f"unknown kind '{brief(tag)}' at '{dotted(path)}'" if tag else (
                f"'{dotted(path)}' is missing"
            )  # fmt: skip
            hint = suggestion(tag, known) if known[0] else None
            if tag and not (hint or "").endswith("?"):
                hint = ". ".join(filter(None, (hint, NOT_INSTALLED)))
            found.append(Diagnostic(message, place_of(path, where, lines), hint))
            continue
        cause = context.get("error")
        if isinstance(cause, InconsistentValueError):
            path = (*path, *cause.path)
            found.append(Diagnostic(str(cause), place_of(path, where, lines), cause.hint))
            continue
        text = str(cause) if cause is not None else _sentence(report["msg"])
        given = report.get("input")
        plain = isinstance(given, str | int | float | bool | None)
        shown = f" = {brief(repr(given))}" if plain else ""
        hint = None
        if kind in ("enum", "literal_error") and isinstance(given, str):
            words = str(context.get("expected", "")).replace(" or ", ", ").replace("'", "")
            hint = suggestion(given, words.split(", "))
        named = f"'{dotted(path)}'{shown}: " if path else ""  # no path: the whole value
        found.append(Diagnostic(f"{named}{text}", place_of(path, where, lines), hint))
    return found


def _sentence(message: str) -> str:
    text = message.removeprefix("Value error, ").replace("Input should be", "should be")
    for kind in ("Dictionary ", "List "):
        text = text.removeprefix(kind).replace(" after validation", "")
    if text == "should be a valid tuple":  # files know lists only
        return "should be a list of values"
    if "should match pattern" in text:
        return "should be letters, digits, '-' and '_' only, at most 64"
    return text


def _path_in(data: Any, location: Steps) -> Steps:
    """Return the location without the union members and '[key]' marks that pydantic adds to it."""
    path: list[str | int] = []
    for step in location:
        known = step in data if isinstance(data, dict) else False
        if isinstance(data, list | tuple):
            known = isinstance(step, int) and step < len(data)
        if known:
            path.append(step)
            data = data[step]
    return tuple(path)


def _fields_at(model: type[BaseModel], location: Steps, data: Any = None) -> list[str]:
    """Return the fields of the model at a location inside `model`, for the given `data`."""
    kind: Any = model
    for step in location:
        kind = _step_into(kind, step)
        if isinstance(data, dict):
            data = data.get(step)
        elif isinstance(data, list | tuple) and isinstance(step, int) and step < len(data):
            data = data[step]
    kind = _bare(kind)
    if not (isinstance(kind, type) and issubclass(kind, BaseModel)):
        return []
    if issubclass(kind, KindModel) and isinstance(data, dict):
        name = str(data.get("kind", kind.usual_kind))
        kind = kind.kinds.find(name) if name in kind.kinds else kind
    return list(kind.model_fields)


def _step_into(kind: Any, step: str | int) -> Any:
    kind = _bare(kind)
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        field = kind.model_fields.get(str(step))
        return field.annotation if field else None
    if get_origin(kind) in (Union, UnionType):  # the step names the member: by kind or class
        for member in get_args(kind):
            fields = getattr(_bare(member), "model_fields", {})
            if "kind" in fields and fields["kind"].default == step:
                return member
        return kind
    if get_origin(kind) is dict:
        return get_args(kind)[1]
    return get_args(kind)[0] if get_args(kind) else None


def _bare(kind: Any) -> Any:
    """Return a type without its annotations, and without None if only one other type is left."""
    while True:
        if get_origin(kind) is Annotated:
            kind = get_args(kind)[0]
        elif get_origin(kind) in (Union, UnionType):
            members = [member for member in get_args(kind) if member is not type(None)]
            if len(members) > 1:
                return Union[tuple(members)]  # noqa: UP007
            kind = members[0]
        else:
            return kind
