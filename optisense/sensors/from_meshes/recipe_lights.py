"""Lights of a recipe: their kind, colour and placement."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, PlainValidator, model_validator

from optisense.design import Light
from optisense.design.colour import NAMED_COLOURS
from optisense.design.fields import Count, Model, Name, NonNegative, Number, Positive, Vector
from optisense.near import suggestion
from optisense.sensors.from_meshes.directions import Direction, Side, Way, or_words
from optisense.sensors.from_meshes.recipe_parts import ShapeReference, Turn, Units

MOST_LIGHTS = 10_000
"""Largest number of lights in a group; a larger one is an error, for example a pitch in metres."""

Lights = Annotated[Count, Field(le=MOST_LIGHTS)]


def _colour(value: Any) -> str | tuple[float, float, float]:
    if isinstance(value, str):
        if value in NAMED_COLOURS:
            return value
        raise ValueError(f"unknown colour. {suggestion(value, NAMED_COLOURS) or ''}".rstrip())
    if (
        isinstance(value, list | tuple)
        and len(value) == 3
        and all(isinstance(v, int | float) and 0.0 <= v <= 1.0 for v in value)
        and sum(value) > 0.0
    ):
        return float(value[0]), float(value[1]), float(value[2])
    raise ValueError("must be " + ", ".join(NAMED_COLOURS) + " or three numbers from 0 to 1")


def _one_or_two(least: float, whole: bool, form: str) -> PlainValidator:
    """Return a validator for a number or a list of two, each at least (whole) or above `least`."""
    kinds = int if whole else int | float

    def fits(value: Any) -> bool:
        return (
            isinstance(value, kinds)
            and not isinstance(value, bool)
            and (least <= value <= MOST_LIGHTS if whole else least < value < float("inf"))
        )

    def read(value: Any) -> Any:
        if fits(value):
            return value
        if isinstance(value, list | tuple) and len(value) == 2 and all(map(fits, value)):
            return tuple(value)
        raise ValueError(form)

    return PlainValidator(read)


ColourWord = Annotated[str | tuple[float, float, float], PlainValidator(_colour)]


CountOrTwo = Annotated[
    int | tuple[int, int],
    _one_or_two(
        1, True, f"must be a whole number from 1 to {MOST_LIGHTS}, or two of them: [along, across]"
    ),
]
PitchOrTwo = Annotated[
    float | tuple[float, float],
    _one_or_two(0.0, False, "must be a number above 0, or two of them: [along, across]"),
]


class LightRow(Model):
    """Lights in a row along one side of a part's box."""

    part: Name = Field(description="beside this part")
    side: Side = Field(description="at this side of it")
    along: Literal["x", "y", "z"] | None = Field(
        default=None, description="the row runs this way; the longer one if left out"
    )
    count: Lights
    pitch: Positive | None = Field(
        default=None, description="mm between lights; spread over the side if left out"
    )
    gap: Number = Field(
        default=0.2, description="mm from the side to the lights; below 0 is inside the part"
    )
    height: Number | None = Field(
        default=None, description="mm, where on the third axis; the part's middle if left out"
    )
    shift: Number = Field(default=0.0, description="mm, moves the row along itself")
    direction: Way | None = Field(
        default=None, description="where they shine; into the side if left out"
    )


class Ring(Model):
    """Lights in a circle, or an arc of one, around a part."""

    part: Name = Field(description="around the middle of this part")
    axis: Side = Field(default="+z", description="of the circle")
    count: Lights
    radius: Positive | None = Field(
        default=None, description="mm; half the part's width plus gap if left out"
    )
    gap: Number = Field(default=0.2, description="mm outside the part, where no radius is given")
    height: Number | None = Field(
        default=None, description="mm, where on the axis; the part's middle if left out"
    )
    start: Turn = Field(default=0.0, description="degrees, anticlockwise seen from the axis' end")
    end: Turn = Field(default=360.0, description="degrees; a full turn from start is a full ring")
    direction: Annotated[Direction, or_words("inward", "outward")] = Field(
        default="inward", description="inward; outward; or a direction for all"
    )


class LightsOver(ShapeReference):
    """Lights over a reference surface, such as the front of a circuit board."""

    count: CountOrTwo | None = Field(
        default=None, description="number, or [along, across]; one on each patch if left out"
    )
    pitch: PitchOrTwo | None = Field(
        default=None, description="mm, or [along, across]; spread evenly if left out"
    )
    gap: Number = Field(default=0.05, description="mm off the surface")
    direction: Annotated[Direction, or_words("normal", "-normal")] = Field(
        default="normal", description="normal; -normal; or a direction for all"
    )

    @model_validator(mode="after")
    def _not_too_many(self) -> LightsOver:
        if isinstance(self.count, tuple) and self.count[0] * self.count[1] > MOST_LIGHTS:
            raise ValueError(f"{self.count[0]} x {self.count[1]} are more than {MOST_LIGHTS}")
        return self


class LightsAlong(Model):
    """Lights along the outline of a part, such as on a flexible strip around its edge."""

    edge_of: Name = Field(description="around this part")
    axis: Side = Field(default="+z", description="the outline is that seen from where this points")
    height: Number | None = Field(
        default=None, description="mm, where on the axis; the part's middle if left out"
    )
    start: Way = Field(description="the outline is counted from its end in this direction")
    shift: Number = Field(
        default=0.0, description="mm along the outline to the middle of the lights, anticlockwise"
    )
    count: Lights = 1
    pitch: Positive | None = Field(
        default=None, description="mm along the outline; spread over all of it if left out"
    )
    gap: Number = Field(default=0.2, description="mm outside the part")
    direction: Annotated[Direction, or_words("inward", "outward")] = Field(
        default="inward", description="inward; outward; or a direction for all"
    )


class FromTable(Model):
    """Lights where a pick-and-place file of a board puts them."""

    file: str = Field(description="of KiCad, Altium or EasyEDA, or any table with such columns")
    only: str | list[str] | None = Field(
        default=None, description="designators, such as D1, [D1, D3] or D*; all if left out"
    )
    units: Units | None = Field(default=None, description="of the file, where it does not say")
    points: dict[str, Vector] | None = Field(
        default=None, description="two or three designators, and where they are, mm"
    )
    origin: Vector | None = Field(
        default=None, description="mm, where the file's 0, 0 is, instead of points"
    )
    right: Way | None = Field(
        default=None, description="where the file's x axis points, with origin; +x if left out"
    )
    normal: Way | None = Field(
        default=None,
        description="where the board's top looks; needed with two points, +z with origin",
    )
    gap: Number = Field(default=0.05, description="mm off the board")

    @model_validator(mode="after")
    def _one_mapping(self) -> FromTable:
        if (self.points is None) == (self.origin is None):
            raise ValueError("give either points, or the origin of the file")
        if self.points is not None:
            if len(self.points) not in (2, 3):
                raise ValueError("points needs two or three designators")
            if self.right is not None:
                raise ValueError("right goes with origin; points tell it by themselves")
            if (len(self.points) == 2) == (self.normal is None):
                raise ValueError(
                    "two points need normal: where does the top of the board look? (+z, -x, ...)"
                    if len(self.points) == 2
                    else "three points tell where the board looks; leave normal out"
                )
        return self


WAYS = ("row", "ring", "over", "along", "from", "at")
"""Names of the ways to place the lights of a group."""


class LightChoice(Model):
    """Light group of a recipe, placed in one of `WAYS`."""

    model_config = ConfigDict(validate_by_name=True, serialize_by_alias=True)

    model: Name = Field(description="light of the library")
    colour: ColourWord = Field(description=", ".join(NAMED_COLOURS) + " or [r, g, b]")
    flux: NonNegative = Field(default=10.0, description="mW of each light")
    row: LightRow | None = Field(default=None, description="lights along one side of a part's box")
    ring: Ring | None = Field(default=None, description="lights in a circle around a part")
    over: LightsOver | None = Field(default=None, description="lights over a surface")
    along: LightsAlong | None = Field(
        default=None, description="lights along the outline of a part"
    )
    table: FromTable | None = Field(
        default=None, alias="from", description="lights of a pick-and-place file"
    )
    at: list[Light] | None = Field(default=None, description="each light by its place")

    @model_validator(mode="after")
    def _one_way(self) -> LightChoice:
        given = [
            way for way in WAYS if getattr(self, "table" if way == "from" else way) is not None
        ]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise ValueError(f"needs one of {', '.join(WAYS[:-1])} and {WAYS[-1]}, has {found}")
        return self
