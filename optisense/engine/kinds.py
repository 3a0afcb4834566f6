"""Requests about the kinds of emitters, materials, coatings, camera responses and others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from optisense import library
from optisense.design.emitters import LightModel
from optisense.design.fields import LARGEST_NUMBER
from optisense.design.kinds import KindModel
from optisense.design.lenses import LensBlur, LensDistortion, LensShading
from optisense.design.materials import CoatingModel, Material, kinds_for
from optisense.design.parts import Role
from optisense.design.problems import design_error
from optisense.design.responses import CameraResponse, ToneCurve
from optisense.engine.failures import ProtocolError
from optisense.engine.jobs import Job
from optisense.engine.listing import Rows, listed
from optisense.engine.protocol import Fields
from optisense.engine.requests import Lane, handles
from optisense.engine.session import Session
from optisense.errors import DesignError

NOUNS: dict[str, type[KindModel]] = {
    "emitter": LightModel,
    "material": Material,
    "coating": CoatingModel,
    "response": CameraResponse,
    "distortion": LensDistortion,
    "shading": LensShading,
    "blur": LensBlur,
    "tone_curve": ToneCurve,
}
"""Base classes that have kinds, by name; each has its own registry."""

NOT_SHOWN = ("kind", "library")
"""Fields that name a kind or an entry, and are not shown as values."""

BOUNDS = {
    "minimum": "minimum",
    "exclusiveMinimum": "above",
    "maximum": "maximum",
    "exclusiveMaximum": "below",
}
"""Names of bounds in a JSON schema, and in the rows of this module."""


@handles("kinds", Fields, Lane.QUICK)
def kinds(session: Session, fields: Fields, job: Job) -> dict[str, Any]:
    """Return all kinds with their fields, and the kinds of materials that suit each role."""
    found: dict[str, Rows] = {}
    unavailable: Rows = []
    for word, noun in NOUNS.items():
        found[word], failed = listed(noun.kinds, lambda name, kind: _kind(kind))
        unavailable += failed
    return {
        "kinds": found,
        "unavailable": unavailable,
        "materials_of_role": {role.value: kinds_for(role) for role in Role},
    }


class Lamp(Fields):
    """Fields of the request "lamp"; see docs/engine.md."""

    entry: str | None = None
    value: dict[str, Any] | None = None
    folder: str | None = None


@handles("lamp", Lamp, Lane.QUICK)
def lamp(session: Session, fields: Lamp, job: Job) -> dict[str, Any]:
    """Return the drawing of a lamp: its window and its half angle."""
    if (fields.entry is None) == (fields.value is None):
        raise ProtocolError(
            "a lamp needs either 'entry' or 'value'", where="lamp", hint="Give one of them"
        )
    if fields.value is None:
        emitter = library.light(fields.entry or "")
    else:
        emitter = _emitter(fields.value)
        emitter.located(None if fields.folder is None else Path(fields.folder))
    emitter.verify()
    window = emitter.window()
    return {
        "window": None if window is None else {"shape": window.shape, "size": window.size},
        "half_angle": emitter.half_angle(),
        "in_words": emitter.in_words(),
    }


def _emitter(value: dict[str, Any]) -> LightModel:
    try:
        return TypeAdapter(LightModel).validate_python(value)
    except ValidationError as error:
        found = design_error(error, value, where="value", model=LightModel)
        raise DesignError(found.message, where=found.where, hint=found.hint) from None


def _kind(kind: type[KindModel]) -> dict[str, Any]:
    name = kind.model_fields["kind"].default
    schema = kind.model_json_schema(mode="validation")
    return {
        "name": name,
        "title": kind.title or name,
        "summary": kind.summary(),
        "fields": [
            field_row(field, values, required=field in schema.get("required", ()))
            for field, values in schema["properties"].items()
            if field not in NOT_SHOWN and "const" not in values
        ],
    }


def field_row(name: str, schema: dict[str, Any], *, required: bool) -> dict[str, Any]:
    """Return a field as a front end shows it, from its JSON schema.

    Returns:
        `name`, `title`, `help`, `unit`; whether it is `required` and may be `absent`; `start`, a
        value to begin with (null where there is none); `type`: number, numbers (with `size`),
        flag, choice (with `choices`), file, text, or data where it is none of these. Numbers have
        those of the bounds minimum, above, maximum and below that they have.
    """
    start = schema.get("default")
    members = [each for each in schema.get("anyOf", ()) if each.get("type") != "null"]
    row = {
        "name": name,
        "title": schema.get("title", name),
        "help": schema.get("description", ""),
        "unit": schema.get("unit", ""),
        "required": required,
        "absent": len(members) < len(schema.get("anyOf", ())),
        "start": next(iter(schema.get("examples", ())), None) if start is None else start,
    }
    if len(members) == 1:
        schema = members[0]
    items = schema.get("prefixItems", ())
    of_numbers = bool(items) and all(each.get("type") == "number" for each in items)
    if schema.get("type") in ("number", "integer"):
        return row | {"type": "number"} | _bounds(schema)
    if of_numbers:
        return row | {"type": "numbers", "size": len(items)} | _bounds(items[0])
    if "enum" in schema:
        return row | {"type": "choice", "choices": schema["enum"]}
    if schema.get("type") == "string":
        return row | {"type": "file" if schema.get("format") == "path" else "text"}
    return row | {"type": "flag" if schema.get("type") == "boolean" else "data"}


def _bounds(schema: dict[str, Any]) -> dict[str, Any]:
    given = {ours: schema[theirs] for theirs, ours in BOUNDS.items() if theirs in schema}
    return {ours: value for ours, value in given.items() if abs(value) < LARGEST_NUMBER}
