"""Types that the models of a design share, and their base model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, cast

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    ValidationError,
)
from pydantic_core import CoreSchema

from optisense.errors import DesignError

Steps = tuple[str | int, ...]
"""Path of a value in a design: keys and indices."""

LARGEST_NUMBER = 1e12
"""Largest magnitude of a number in a design, in any unit. No meaningful number comes near, and its
cube is still far from the largest floating-point number."""


class NotTooLarge:
    """Annotation that keeps a number within `LARGEST_NUMBER`, if its field has no bounds of its
    own.

    `Field(ge=..., le=...)` in its place would override the bounds that a field of the type gets in
    its default, `power: Number = Field(4.0, le=200.0)`, and these would not be checked.
    """

    def __get_pydantic_core_schema__(
        self, source: type[float], handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        schema: Any = handler(source)
        schema.setdefault("ge", -LARGEST_NUMBER)
        schema.setdefault("le", LARGEST_NUMBER)
        return cast("CoreSchema", schema)


Number = Annotated[float, Field(strict=True, allow_inf_nan=False), NotTooLarge()]
"""Finite number; text, true and false are refused."""

Fraction = Annotated[Number, Field(ge=0.0, le=1.0)]
"""Number from 0 to 1."""

NonNegative = Annotated[Number, Field(ge=0.0)]
Positive = Annotated[Number, Field(gt=0.0)]
Count = Annotated[int, Field(strict=True, ge=1)]

MILLIMETRES: dict[str, Any] = {"unit": "mm"}
DEGREES: dict[str, Any] = {"unit": "degrees"}
"""Unit of an angle in a field's `json_schema_extra`; `unit_of` reads it."""

Vector = tuple[Number, Number, Number]
"""Vector x, y, z."""

Colour = tuple[Fraction, Fraction, Fraction]
"""Three values for red, green and blue, 0 to 1."""

PositiveRGB = tuple[Positive, Positive, Positive]
NonNegativeRGB = tuple[NonNegative, NonNegative, NonNegative]

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$")]
"""Name of a part, material, light group or cage: letters, digits, '-' and '_'."""


def _not_zero(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if sum(value * value for value in vector) < 1e-18:
        raise ValueError("a direction can't be the zero vector")
    return vector


Direction = Annotated[Vector, AfterValidator(_not_zero)]
"""Direction x, y, z of any length except zero."""


def _inside_folder(path: str) -> str:
    parts = path.split("/")
    if "\\" in path or ":" in path or "\0" in path or path.startswith("/") or ".." in parts:
        raise ValueError("must be a path inside the design folder, with '/' between its parts")
    if not parts[-1] or not path.isprintable():
        raise ValueError("must name a file, without control characters")
    return path


IN_FOLDER = AfterValidator(_inside_folder)
"""Mark of a field that names a file, by which `KindModel.files` finds it."""

RelativePath = Annotated[str, IN_FOLDER, Field(json_schema_extra={"format": "path"})]
"""Path of a file inside the design folder."""


def is_left_out(value: object) -> bool:
    """Return whether an optional field has no value and is left out of the file.

    Designs without a field that a later release added are then unchanged, with equal fingerprints.
    """
    return value is None


class Model(BaseModel):
    """Base class of all models in a design file: unknown fields are refused, changes checked."""

    model_config = ConfigDict(extra="forbid", validate_assignment=True)

    error_in_words: ClassVar[Callable[..., DesignError]]
    """The function `design_error` of `optisense.design.problems`, which sets it when it is
    imported. It words an error by the fields of all models, so that its module imports them, and an
    import here would be a cycle."""

    def __setattr__(self, name: str, value: object) -> None:
        """Set a field if the value fits.

        Raises:
            DesignError: the value does not fit; the field is unchanged.
        """
        before = dict(self.__dict__)
        try:
            super().__setattr__(name, value)
        except ValidationError as error:
            # Validators of a whole model see the new value in the model: pydantic sets it before
            # they run, and leaves it there if one of them refuses it.
            self.__dict__.update(before)
            raise Model.error_in_words(error, {name: value}, where=name, model=type(self)) from None


def unit_of(model: type[BaseModel], name: str) -> str:
    """Return the unit of a field's numbers from its schema; empty if it has none."""
    field = model.model_fields.get(name)
    extra = None if field is None else field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


class InconsistentValueError(ValueError):
    """A value that is valid by itself does not fit the rest of the design.

    Attributes:
        path: keys and indices from the model that found it to the value.
        hint: remedy.
    """

    def __init__(self, message: str, path: Steps, hint: str | None = None) -> None:
        super().__init__(message)
        self.path = path
        self.hint = hint
