"""Property groups for the fields of lamps, materials and coatings, as the engine describes them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    StringProperty,
)

from ..core import schema
from ..core.numbers import kept, kept_list

Items = list[tuple[str, str, str]]

NOT_FIELDS = ("kind", "library")
"""Entries of a value that are not fields of its kind."""

NUMBERS = ("pair", "triple", "colour")
"""Names of the properties that hold several numbers."""

WHAT = "Value of a lamp, material or coating; the button beside it explains the field"

_filling = False
MOST_LISTS = 256
"""Number of lists of choices that are kept alive: far more than one panel of Blender shows."""

_items: dict[Any, Items] = {}
"""Choices of menus; Blender requires their strings to be kept alive."""


@contextmanager
def _quietly() -> Iterator[None]:
    """Suppress the callbacks for changes within the context."""
    global _filling
    before, _filling = _filling, True
    try:
        yield
    finally:
        _filling = before


def _changed(field: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    if _filling:
        return
    row = field.row
    with _quietly():
        if row and field.holder == "number":
            field.number = schema.bounded(row, field.number)
        elif row and field.holder in NUMBERS:
            own = "triple" if field.holder == "colour" else field.holder
            setattr(field, own, [schema.bounded(row, each) for each in getattr(field, own)])
    owner = field.path_from_id().rpartition(".fields[")[0]
    field.id_data.path_resolve(owner).fields_changed()


def kept_items(items: Items) -> Items:
    """Return equal choices as an object that is kept alive, as Blender requires."""
    while len(_items) > MOST_LISTS:
        _items.pop(next(iter(_items)))
    return _items.setdefault(tuple(items), items)


def _choices(field: bpy.types.PropertyGroup, context: bpy.types.Context | None) -> Items:
    names = list((field.row or {}).get("choices", ()))
    if field.text not in names:
        names.append(field.text)
    return kept_items([(name, name.replace("_", " ").capitalize(), "") for name in names])


def _choice(field: bpy.types.PropertyGroup) -> int:
    return [name for name, *_ in _choices(field, None)].index(field.text)


def _choose(field: bpy.types.PropertyGroup, number: int) -> None:
    field.text = _choices(field, None)[number][0]


def _colour(field: bpy.types.PropertyGroup) -> tuple[float, ...]:
    return tuple(field.triple)


def _recolour(field: bpy.types.PropertyGroup, colour: Any) -> None:
    field.triple = colour


class OPTISENSE_PG_field(bpy.types.PropertyGroup):
    """Field of a kind, identified by its name; `holder` names the property that holds its value."""

    noun: StringProperty(options={"HIDDEN"})
    kind: StringProperty(options={"HIDDEN"})
    holder: StringProperty(options={"HIDDEN"})
    given: BoolProperty(
        name="Given",
        description="Whether the design gives this optional number",
        default=True,
        update=_changed,
    )
    number: FloatProperty(name="Number", description=WHAT, precision=4, update=_changed)
    pair: FloatVectorProperty(
        name="Numbers", size=2, description=WHAT, precision=3, update=_changed
    )
    triple: FloatVectorProperty(
        name="Numbers", size=3, description=WHAT, precision=4, update=_changed
    )
    colour: FloatVectorProperty(
        name="Colour", description=WHAT, size=3, min=0.0, max=1.0, precision=4, subtype="COLOR",
        get=_colour, set=_recolour,
    )  # fmt: skip
    flag: BoolProperty(name="Flag", description=WHAT, update=_changed)
    text: StringProperty(name="Text", description=WHAT, update=_changed)
    file: StringProperty(
        name="File", subtype="FILE_PATH", update=_changed,
        description="Path of the file; Save copies it into the folder of the design",
    )  # fmt: skip
    choice: EnumProperty(name="Choice", description=WHAT, items=_choices, get=_choice, set=_choose)

    @property
    def row(self) -> schema.Row | None:
        """Description of the field by the engine; None if no engine has described it."""
        return schema.fields(self.noun, self.kind).get(self.name)

    @property
    def value(self) -> Any:
        """Value as in a design, with numbers in single precision."""
        if self.holder in NUMBERS:
            return list(self.pair if self.holder == "pair" else self.triple)
        if self.holder == "data":
            return json.loads(self.text)
        return self.text if self.holder == "choice" else getattr(self, self.holder)

    @property
    def is_default(self) -> bool:
        """Whether the value equals the default of a field that a file may omit."""
        row = self.row
        if row is None or row["required"] or row["absent"]:
            return False
        return bool(self.value == row["start"])

    def put(self, value: Any) -> None:
        """Set another value of the same type."""
        if self.holder in ("choice", "data"):
            self.text = value if self.holder == "choice" else json.dumps(value)
        else:
            setattr(self, "triple" if self.holder == "colour" else self.holder, value)


class OPTISENSE_OT_reset_field(bpy.types.Operator):
    """Reset the field to its initial value"""

    bl_idname = "optisense.reset_field"
    bl_label = "Reset"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    path: StringProperty(options={"HIDDEN"})
    help: StringProperty(options={"HIDDEN"})

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        """Return the help text of the field, for the button beside it."""
        return f"{properties.help}. Press to reset it" if properties.help else cls.__doc__

    def execute(self, context: bpy.types.Context) -> set[str]:
        field = context.scene.path_resolve(self.path)
        if field.row is None:
            self.report(
                {"ERROR"}, "The engine has not described this field yet; try again in a moment"
            )
            return {"CANCELLED"}
        field.put(schema.start(field.row))
        return {"FINISHED"}


class HasFields:
    """Mixin of the property groups of lamps, materials and coatings: a kind and its `fields`."""

    noun = ""
    kind_name: str
    fields: Any

    def fields_changed(self) -> None:
        """Callback for a change of a field by the user."""

    def value(self, name: str) -> Any:
        """Return the value of a field.

        Raises:
            KeyError: the kind has no such field.
        """
        return self.fields[name].value

    def field_values(self) -> dict[str, Any]:
        """Return the values of all fields that are given, in single precision."""
        return {field.name: field.value for field in self.fields if field.given}

    def field_rows(self) -> dict[str, schema.Row]:
        """Return the engine's descriptions of the fields of this kind."""
        return schema.fields(self.noun, self.kind_name)

    def put(self, name: str, value: Any) -> None:
        """Change a field as the user would.

        Raises:
            KeyError: the kind has no such field.
        """
        self.fields[name].put(value)

    def fill(self, kind: str, values: dict[str, Any]) -> None:
        """Set kind and values; fields without a value get their initial value."""
        with _quietly():
            self.kind_name = kind
            self.fields.clear()
            rows = self.field_rows()
            for name in rows or [each for each in values if each not in NOT_FIELDS]:
                row, value = rows.get(name), values.get(name)
                if value is None and row is None:
                    continue
                field = self.fields.add()
                field.name, field.noun, field.kind = name, self.noun, kind
                field.given = value is not None or not row["absent"]
                value = schema.start(row) if value is None else value
                field.holder = _holder(value, row)
                field.put(value)
        self.fields_changed()

    def change_kind(self, kind: str) -> None:
        """Change the kind; fields that both kinds have keep their values."""
        if kind != self.kind_name:
            self.fill(kind, self.field_values())

    def gathered(self, was: dict[str, Any]) -> dict[str, Any]:
        """Return the values as for the design file; unchanged numbers stay as they were read.

        Fields that were omitted in the file and still have their initial value stay omitted.

        Args:
            was: values that were read from the file; they are ignored if they are of another kind.
        """
        if was.get("kind", self.kind_name) != self.kind_name:
            was = {}
        found = {name: value for name, value in was.items() if name not in self.fields}
        for field in self.fields:
            if not field.given:
                continue
            value, before = field.value, was.get(field.name)
            if was and before is None and field.is_default:
                continue
            if field.holder == "number":
                value = kept(before, value)
            elif field.holder in NUMBERS:
                value = kept_list(before, value)
            found[field.name] = value
        return found

    def draw(self, layout: bpy.types.UILayout) -> None:
        """Draw the fields with their units, and a button with the help text beside each."""
        for field in self.fields:
            row = field.row
            if row is None:
                continue
            unit = {"degrees": "°"}.get(row["unit"], row["unit"])
            text = f"{row['title']} ({unit})" if unit else row["title"]
            line = layout.row(align=True)
            if row["absent"]:
                line.prop(field, "given", text=text)
                text = ""
            if field.given:
                holder = "text" if field.holder == "data" else field.holder
                line.prop(field, holder, text=text)
                button = line.operator("optisense.reset_field", text="", icon="QUESTION")
                button.path, button.help = field.path_from_id(), schema.explained(row)


def _holder(value: Any, row: schema.Row | None) -> str:
    """Return the name of the property that holds a value."""
    if row is not None and row["type"] in ("choice", "file", "text", "data"):
        return row["type"]
    if isinstance(value, bool):
        return "flag"
    if isinstance(value, (int, float)):
        return "number"
    if isinstance(value, str):
        return "text"
    if isinstance(value, (list, tuple)) and all(isinstance(each, (int, float)) for each in value):
        if len(value) == 3 and row and (row.get("minimum"), row.get("maximum")) == (0.0, 1.0):
            return "colour"
        return {2: "pair", 3: "triple"}.get(len(value), "data")
    return "data"


def kind_menu(noun: str, first: Items = ()) -> Any:
    """Return properties of a menu of all kinds; it stores the name of the chosen one in
    `kind_name`.

    Args:
        noun: `emitter` or `material`.
        first: choices before the kinds.
    """

    def items(owner: Any, context: bpy.types.Context | None) -> Items:
        found = [*first, *((k["name"], k["title"], k["summary"]) for k in schema.kinds(noun))]
        if owner.kind_name not in [name for name, *_ in found]:
            found.append((owner.kind_name, owner.kind_name, "This engine does not know this kind"))
        return kept_items(found)

    def number(owner: Any) -> int:
        return [name for name, *_ in items(owner, None)].index(owner.kind_name)

    def choose(owner: Any, chosen: int) -> None:
        owner.change_kind(items(owner, None)[chosen][0])

    return {"items": items, "get": number, "set": choose}
