"""Requests about the library: its entries, their pictures, and the user's own entries."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from optisense import library
from optisense.engine.failures import ProtocolError
from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.requests import Lane, handles
from optisense.engine.session import Session
from optisense.errors import LibraryError
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
