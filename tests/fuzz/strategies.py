"""Hypothesis strategies that damage valid files: values by a JSON schema, and bytes."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

from hypothesis import strategies as st

Schema = dict[str, Any]
Path = tuple[str | int, ...]

EXTREME_NUMBERS: tuple[Any, ...] = (
    0, -0.0, 1, -1, 5e-324, 1e-300, 1e-12, 0.5, 1e30, 1e155, -1e155, 1e308, -1e308,
    float("nan"), float("inf"), float("-inf"), 2**31, 2**53, 2**63, -(2**63), 2**64, 10**25,
    10**400,
)  # fmt: skip

STRANGE_TEXTS = (
    "", " ", ".", "..", "/", "../x", "/etc/passwd", "a\0b", "\x1b[2J", "\u202e", "\ud800", "nan",
    "inf", "1e308", "true", "null", "x" * 300, "x" * 70_000, "9" * 400, "'", '"', "{}", "[]", "%s",
    "\n", "~", "é" * 40, "con", "-", "--help", "$HOME", "c:\\x", "1,2", "a:b", "@", "=1+1",
)  # fmt: skip

OTHER_VALUES: tuple[Any, ...] = (
    None, True, False, [], {}, [[]], [None], {"": None}, {"kind": None}, [1, [2, [3]]], [0] * 2000,
    {"a": {"b": {"c": {}}}},
)  # fmt: skip

strange_texts = st.sampled_from(STRANGE_TEXTS) | st.text(max_size=20)
strange_numbers = st.sampled_from(EXTREME_NUMBERS) | st.floats() | st.integers(-(2**70), 2**70)
# Copies: a value may be changed once it stands in a document.
other_values = st.sampled_from(OTHER_VALUES).map(copy.deepcopy)
strange_values = strange_numbers | strange_texts | other_values


def from_schema(schema: Schema, definitions: Schema | None = None) -> st.SearchStrategy[Any]:
    """Values that a JSON schema allows, as pydantic writes it; a few that it does not.

    Args:
        schema: of a value; `$ref` leads into the definitions.
        definitions: those of the whole schema; its own if None.
    """
    known = schema.get("$defs", {}) if definitions is None else definitions
    schema = _resolved(schema, known)
    for members in ("anyOf", "oneOf"):
        if members in schema:
            return st.one_of([st.deferred(lambda each=each: from_schema(each, known))
                              for each in schema[members]])  # fmt: skip
    if "const" in schema:
        return st.just(schema["const"])
    if "enum" in schema:
        return st.sampled_from(schema["enum"]) | strange_texts
    kind = schema.get("type")
    if kind == "object":
        return _objects(schema, known)
    if kind == "array":
        return _arrays(schema, known)
    if kind in ("number", "integer"):
        return _numbers(schema)
    simple: dict[Any, st.SearchStrategy[Any]] = {
        "boolean": st.booleans(),
        "null": st.none(),
        "string": strange_texts | st.sampled_from(schema.get("examples", ["gel"])),
    }
    return simple.get(kind, strange_values)


def _resolved(schema: Schema, known: Schema) -> Schema:
    while "$ref" in schema:
        schema = known[schema["$ref"].rsplit("/", 1)[-1]]
    return schema


def _numbers(schema: Schema) -> st.SearchStrategy[Any]:
    bounds = ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")
    given = [schema[name] for name in bounds if name in schema]
    low = max([schema.get("minimum", -1e6), schema.get("exclusiveMinimum", -1e6)])
    high = min([schema.get("maximum", 1e6), schema.get("exclusiveMaximum", 1e6)])
    usual: st.SearchStrategy[Any] = st.floats(min(low, high), max(low, high))
    if schema["type"] == "integer":
        usual = usual.map(int)
    return st.one_of(usual, strange_numbers, st.sampled_from([*given, 1]))


def _arrays(schema: Schema, known: Schema) -> st.SearchStrategy[Any]:
    if "prefixItems" in schema:
        return st.tuples(*(from_schema(each, known) for each in schema["prefixItems"])).map(list)
    return st.lists(from_schema(schema.get("items", {}), known), max_size=4)


def _objects(schema: Schema, known: Schema) -> st.SearchStrategy[Any]:
    fields = schema.get("properties", {})
    if not fields:
        items = schema.get("additionalProperties")
        items = items if isinstance(items, dict) else {}
        return st.dictionaries(strange_texts, from_schema(items, known), max_size=3)
    required = set(schema.get("required", ()))
    return st.fixed_dictionaries(
        {name: from_schema(each, known) for name, each in fields.items() if name in required},
        optional={
            name: from_schema(each, known) for name, each in fields.items() if name not in required
        },
    )


def places(data: Any, path: Path = ()) -> Iterator[Path]:
    """The paths of all values in plain data."""
    yield path
    if isinstance(data, dict):
        for key, value in data.items():
            yield from places(value, (*path, key))
    elif isinstance(data, list):
        for index, value in enumerate(data[:40]):
            yield from places(value, (*path, index))


def schema_at(schema: Schema, path: Path, data: Any) -> Schema:
    """What a schema says of the value at a path of some data; nothing where it can't be told."""
    known = schema.get("$defs", {})
    for step in path:
        schema = _member(_resolved(schema, known), known, data)
        inner = schema.get("properties", {}).get(step) if isinstance(step, str) else None
        if inner is None:
            more = schema.get("additionalProperties")
            inner = more if isinstance(more, dict) else schema.get("items", {})
            if isinstance(step, int) and step < len(schema.get("prefixItems", ())):
                inner = schema["prefixItems"][step]
        schema = inner if isinstance(inner, dict) else {}
        data = data[step]
    return schema


def _member(schema: Schema, known: Schema, data: Any) -> Schema:
    """Of several schemas the one that data of this kind are meant to have."""
    for name in ("anyOf", "oneOf"):
        if name in schema:
            members = [_member(_resolved(each, known), known, data) for each in schema[name]]
            kind = data.get("kind") if isinstance(data, dict) else None
            of_kind = [m for m in members
                       if m.get("properties", {}).get("kind", {}).get("const") == kind]  # fmt: skip
            return next(iter(of_kind or members), {})
    return schema


@st.composite
def spoilt(draw: st.DrawFn, original: Any, schema: Schema | None = None, most: int = 3) -> Any:
    """Plain data with some values changed, taken out, added, or moved to another place.

    Args:
        original: what is right.
        schema: of it, for values that nearly fit.
        most: changes.
    """
    known = {} if schema is None else schema.get("$defs", {})
    data = copy.deepcopy(original)
    for _ in range(draw(st.integers(1, most))):
        path = draw(st.sampled_from(list(places(data))))
        way = draw(st.sampled_from(["value", "fitting", "out", "twice", "moved", "more"]))
        here = _at(data, path)
        if way == "out" and path:
            _at(data, path[:-1]).pop(path[-1])
        elif way == "twice" and isinstance(here, list):
            here *= draw(st.sampled_from([2, 3, 50]))
        elif way == "moved":
            other = draw(st.sampled_from(list(places(data))))
            data = _with(data, path, copy.deepcopy(_at(data, other)))
        elif way == "more" and isinstance(here, dict):
            there = {} if schema is None else schema_at(schema, path, data)
            fields = _member(_resolved(there, known), known, here).get("properties", {})
            absent = [name for name in fields if name not in here]
            name = draw(st.sampled_from(absent) if absent else strange_texts)
            here[name] = copy.deepcopy(draw(from_schema(fields.get(name, {}), known)))
        elif way == "fitting" and schema is not None:
            there = schema_at(schema, path, data)
            data = _with(data, path, copy.deepcopy(draw(from_schema(there, known))))
        else:
            data = _with(data, path, draw(strange_values))
    return data


def _at(data: Any, path: Path) -> Any:
    for step in path:
        data = data[step]
    return data


def _with(data: Any, path: Path, value: Any) -> Any:
    if not path:
        return value
    _at(data, path[:-1])[path[-1]] = value
    return data


INSERTED = (
    b"\0", b"\xff\xfe", b"nan", b"inf", b"1e308", b"1e999", b"-1", b"999999999999", b"\n",
    b"[" * 400, b"{\"a\":" * 3000, b"[" * 100_000, b"  - " * 80, b"&a ", b"*a ",
    b"!!python/object:os.system ",
    b": ", b"---\n", b"9" * 5000, b"\\\n", b"#", b"\x1b[2J", b"\r", b"\xe2\x80\xa8", b",", b"\"",
)  # fmt: skip


@st.composite
def spoilt_bytes(draw: st.DrawFn, original: bytes, most: int = 3) -> bytes:
    """Content of a file that is cut off, has other bytes in places, or has parts twice."""
    data = bytearray(original)
    for _ in range(draw(st.integers(1, most))):
        at = draw(st.integers(0, len(data)))
        length = draw(st.sampled_from([1, 2, 4, 8, 40, 400]))
        way = draw(st.sampled_from(["cut", "flip", "fill", "insert", "out", "twice", "word"]))
        if way == "cut":
            del data[at:]
        elif way == "flip" and at < len(data):
            data[at] ^= draw(st.integers(1, 255))
        elif way == "fill":
            data[at : at + length] = bytes([draw(st.sampled_from([0, 255, 48]))]) * length
        elif way == "insert":
            data[at:at] = draw(st.sampled_from(INSERTED) | st.binary(max_size=8))
        elif way == "out":
            del data[at : at + length]
        elif way == "twice":
            data[at:at] = data[at : at + length] * draw(st.sampled_from([1, 3, 30]))
        elif words := bytes(data).split():
            word = draw(st.sampled_from(words[:3000]))
            start = bytes(data).find(word)
            data[start : start + len(word)] = draw(st.sampled_from(INSERTED))
    return bytes(data)
