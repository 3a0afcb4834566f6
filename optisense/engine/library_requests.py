"""Requests about the library, the user's own entries, and kinds of emitters and materials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import Field, TypeAdapter, ValidationError

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
from optisense.engine.protocol import Fields
from optisense.engine.requests import Lane, Rows, handles, listed
from optisense.engine.session import Session
from optisense.errors import DesignError, LibraryError
from optisense.library import AnyEntry
from optisense.library.adding import check_new_name
from optisense.library.loader import kind_named
from optisense.library.storage import files_of, make_entry, write_own

BALL_PIXELS = 160
"""Width and height of the picture of a single ball, in pixels: that of an icon in a front end,
drawn in a third of a second."""


class KindFields(Fields):
    """Fields of the request "library"; see docs/engine.md."""

    kind: str


class EntryFields(KindFields):
    """Fields of the request "entry"; see docs/engine.md."""

    entry: str


class Preview(KindFields):
    """Fields of the request "preview"; see docs/engine.md."""

    entry: str | None = None
    value: dict[str, Any] | None = None
    ball: bool = False


class LibraryAdd(EntryFields):
    """Fields of the request "library_add"; see docs/engine.md."""

    value: dict[str, Any]
    description: str
    maker: str | None = None
    source: str = "set by hand in a front end"
    status: str = "assumed"
    sources: dict[str, Any] | None = Field(default=None)


@handles("library", KindFields, Lane.QUICK)
def entries(session: Session, fields: KindFields, job: Job) -> dict[str, Any]:
    """Return the entries of a kind."""
    rows = []
    for name in library.names(fields.kind):
        job.check()
        entry = library.entry(fields.kind, name)
        own = library.is_own(fields.kind, name)
        row = {"name": name, "description": entry.description, "own": own}
        value_kind = getattr(entry.value, "kind", None)
        rows.append(row | ({} if value_kind is None else {"kind": value_kind}))
    return {"entries": rows}


@handles("entry", EntryFields, Lane.QUICK)
def entry(session: Session, fields: EntryFields, job: Job) -> dict[str, Any]:
    """Return all fields of an entry."""
    found = library.entry(fields.kind, fields.entry)
    own = library.is_own(fields.kind, fields.entry)
    return {"entry": found.model_dump(mode="json", exclude_none=True), "own": own}


@handles("preview", Preview, Lane.QUICK)
def preview(session: Session, fields: Preview, job: Job) -> dict[str, Any]:
    """Draw an entry, or values that are in no library yet."""
    from optisense.library import previews

    files = session.files(fields, job.id)
    if (fields.entry is None) == (fields.value is None):
        raise ProtocolError(
            "a preview needs either 'entry' or 'value'", where="preview", hint="Give one of them"
        )
    if fields.entry is not None:
        name, drawn = fields.entry, library.entry(fields.kind, fields.entry)
    else:
        assert fields.value is not None
        name = fields.name or f"a {kind_named(fields.kind)}"
        drawn = _made(fields.kind, name, fields.value, " ", "assumed", "being edited")
    if fields.ball:
        singular = kind_named(fields.kind)
        if singular not in ("material", "coating"):
            raise ProtocolError(
                f"a {singular} can't be drawn as a ball",
                where="ball",
                hint="Only materials and coatings are drawn as balls",
            )
        material: Any = drawn.value
        ball = previews.picture_of_ball(material, BALL_PIXELS)
        return {"files": {"picture": files.picture("preview.png", ball)}}
    path = files.path("preview.png")
    previews.save(previews.draw(name, drawn), path)
    return {"files": {"picture": str(path)}}


@handles("library_add", LibraryAdd, Lane.QUICK)
def library_add(session: Session, fields: LibraryAdd, job: Job) -> dict[str, Any]:
    """Add values to the user's own library."""
    try:
        check_new_name(fields.entry)
    except LibraryError as error:  # its hint names an option of the command
        hint = "Choose another name, of letters, digits, '-' and '_'"
        raise LibraryError(error.message, where="entry", hint=hint) from None
    made = _made(
        fields.kind,
        fields.entry,
        fields.value,
        fields.description,
        fields.status,
        fields.source,
        {"maker": fields.maker} if fields.maker else {},
        fields.sources,
    )
    named = files_of(made.value)
    if named:
        raise ProtocolError(
            f"an entry with a file ({', '.join(named)}) can't be added by its values",
            where="value",
            hint="Use `optisense library add FILE`",
        )
    path = write_own(kind_named(fields.kind), fields.entry, made)
    return {"entry": fields.entry, "file": str(path)}


def _made(
    kind: str,
    name: str,
    value: dict[str, Any],
    description: str,
    status: str,
    source: str,
    more: dict[str, Any] | None = None,
    sources: dict[str, Any] | None = None,
) -> AnyEntry:
    """Return an entry with these values; all numbers have one source unless `sources` are given."""
    singular = kind_named(kind)
    own = {key: each for key, each in value.items() if each is not None}
    own.pop("library", None)
    given = {"status": status, "source": source}
    data = {
        "description": description,
        "value": own,
        "sources": sources or {key: given for key in own if key != "kind"} or {"kind": given},
        **(more or {}),
    }
    return make_entry(singular, name, data, {}, f"{singular} '{name}'")


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
