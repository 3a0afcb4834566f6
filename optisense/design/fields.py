"""Types that the models of a design share, and the base model itself."""

from __future__ import annotations

from typing import Annotated, Any, cast

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema

LARGEST_NUMBER = 1e12
"""The largest magnitude of a number in a design, in any unit. No meaningful number comes
near, and the cube of it is still far from the largest number of a computer."""


class NotTooLarge:
    """Keeps a number within `LARGEST_NUMBER`, where its field has no bounds of its own.

    `Field(ge=..., le=...)` in its place would win over the bounds that a field of the type is given
    as its default, `power: Number = Field(4.0, le=200.0)`, and these would not be checked.
    """

    def __get_pydantic_core_schema__(
        self, source: type[float], handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        schema: Any = handler(source)
        schema.setdefault("ge", -LARGEST_NUMBER)
        schema.setdefault("le", LARGEST_NUMBER)
        return cast("CoreSchema", schema)


Number = Annotated[float, Field(strict=True, allow_inf_nan=False), NotTooLarge()]
"""A finite number; text, true and false are refused."""

Fraction = Annotated[Number, Field(ge=0.0, le=1.0)]
"""A number from 0 to 1."""

NonNegative = Annotated[Number, Field(ge=0.0)]
Positive = Annotated[Number, Field(gt=0.0)]
Count = Annotated[int, Field(strict=True, ge=1)]

MILLIMETRES: dict[str, Any] = {"unit": "mm"}
DEGREES: dict[str, Any] = {"unit": "degrees"}
"""The unit of an angle in a field's `json_schema_extra`; `unit_of` reads it."""

Vector = tuple[Number, Number, Number]
"""x, y, z."""

Colour = tuple[Fraction, Fraction, Fraction]
"""One value for each of red, green and blue, 0 to 1."""

PositiveRGB = tuple[Positive, Positive, Positive]
NonNegativeRGB = tuple[NonNegative, NonNegative, NonNegative]

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$")]
"""The name of a part, material, light group or cage: letters, digits, '-' and '_'."""


def _not_zero(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if sum(value * value for value in vector) < 1e-18:
        raise ValueError("a direction can't be the zero vector")
    return vector


Direction = Annotated[Vector, AfterValidator(_not_zero)]
"""x, y, z of a direction; of any length but zero."""


def _inside_folder(path: str) -> str:
    parts = path.split("/")
    if "\\" in path or ":" in path or "\0" in path or path.startswith("/") or ".." in parts:
        raise ValueError("must be a path inside the design folder, with '/' between its parts")
    if not parts[-1] or not path.isprintable():
        raise ValueError("must name a file, without control characters")
    return path


IN_FOLDER = AfterValidator(_inside_folder)
"""Marks a field that names a file: `KindModel.files` finds it by this."""

RelativePath = Annotated[str, IN_FOLDER, Field(json_schema_extra={"format": "path"})]
"""A file inside the design folder."""


def is_left_out(value: object) -> bool:
    """Whether a field that later releases added says nothing: it is then not written, so that
    designs without it stay what they were, down to their fingerprints."""
    return value is None


class Model(BaseModel):
    """Base of everything in a design file: unknown fields are refused, changes are checked."""

    model_config = ConfigDict(extra="forbid", validate_assignment=True)


def unit_of(model: type[BaseModel], name: str) -> str:
    """The unit of a field's numbers, as the schema has it; empty where they have none."""
    field = model.model_fields.get(name)
    extra = None if field is None else field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


class MisfitError(ValueError):
    """A value that is fine by itself but does not fit the rest of the design.

    Attributes:
        path: keys and indices from the model that found it down to the value.
        hint: what to do.
    """

    def __init__(self, message: str, path: tuple[str | int, ...], hint: str | None = None) -> None:
        super().__init__(message)
        self.path = path
        self.hint = hint
