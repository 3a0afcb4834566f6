"""Lights of a recipe: their kind, colour and placement."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, PlainValidator, model_validator

from optisense.design import Light
from optisense.design.colour import NAMED_COLOURS
from optisense.design.fields import Count, Model, Name, NonNegative, Number, Positive, Vector
from optisense.design.lights import MOST_LIGHTS
from optisense.length_units import Units
from optisense.near import suggestion
from optisense.sensors.from_meshes.directions import Direction, Side, Way, or_words
from optisense.sensors.from_meshes.recipe_parts import ShapeReference, Turn

USUAL_FLUX = 10.0
"""Flux of each light if neither the recipe nor the library states one, mW: that of a bright LED.
Only the ratios of the groups matter to a picture whose exposure is automatic."""

Lights = Annotated[Count, Field(le=MOST_LIGHTS)]


def _colour(value: Any) -> str | tuple[float, float, float]:
    """Return the name of a colour, or its shares of R, G and B.

    Raises:
        ValueError: the name is unknown, or the shares are not three numbers from 0 to 1.
    """
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

    part: Name = Field(description="part at whose box the row is")
    side: Side = Field(description="side of the box")
    along: Literal["x", "y", "z"] | None = Field(
        default=None, description="axis along which the row runs; the longer one if left out"
    )
    count: Lights
    pitch: Positive | None = Field(
        default=None, description="distance between lights, mm; spread over the side if left out"
    )
    gap: Number = Field(
        default=0.2,
        description="distance of the lights from the side, mm; below 0 is inside the part",
    )
    height: Number | None = Field(
        default=None,
        description="coordinate along the third axis, mm; the middle of the part if left out",
    )
    shift: Number = Field(default=0.0, description="shift of the row along itself, mm")
    direction: Way | None = Field(
        default=None, description="direction of the light; into the side if left out"
    )


class Ring(Model):
    """Lights in a circle, or an arc of one, around a part."""

    part: Name = Field(description="part around whose middle the ring is")
    axis: Side = Field(default="+z", description="axis of the circle")
    count: Lights
    radius: Positive | None = Field(
        default=None,
        description="radius of the circle, mm; half the width of the part plus gap if left out",
    )
    gap: Number = Field(
        default=0.2, description="distance outside the part, mm, if no radius is given"
    )
    height: Number | None = Field(
        default=None,
        description="coordinate along the axis, mm; the middle of the part if left out",
    )
    start: Turn = Field(
        default=0.0, description="first angle, degrees, anticlockwise seen from the end of the axis"
    )
    end: Turn = Field(
        default=360.0, description="last angle, degrees; a full turn from start is a full ring"
    )
    direction: Annotated[Direction, or_words("inward", "outward")] = Field(
        default="inward", description="inward; outward; or a direction for all"
    )


class LightsOver(ShapeReference):
    """Lights over a reference surface, such as the front of a circuit board."""

    count: CountOrTwo | None = Field(
        default=None, description="number, or [along, across]; one on each patch if left out"
    )
    pitch: PitchOrTwo | None = Field(
        default=None, description="distances, mm, or [along, across]; spread evenly if left out"
    )
    gap: Number = Field(default=0.05, description="distance from the surface, mm")
    direction: Annotated[Direction, or_words("normal", "-normal")] = Field(
        default="normal", description="normal; -normal; or a direction for all"
    )

    @model_validator(mode="after")
    def _not_too_many(self) -> LightsOver:
        if isinstance(self.count, tuple) and self.count[0] * self.count[1] > MOST_LIGHTS:
            raise ValueError(
                f"{self.count[0]} x {self.count[1]} are more than {MOST_LIGHTS} lights"
            )
        return self


class LightsAlong(Model):
    """Lights along the outline of a part, such as on a flexible strip around its edge."""

    edge_of: Name = Field(description="part along whose outline the lights are")
    axis: Side = Field(default="+z", description="direction from which the outline is seen")
    height: Number | None = Field(
        default=None,
        description="coordinate along the axis, mm; the middle of the part if left out",
    )
    start: Way = Field(description="direction in which the outline begins")
    shift: Number = Field(
        default=0.0,
        description="distance to the middle of the lights along the outline, mm, anticlockwise",
    )
    count: Lights = 1
    pitch: Positive | None = Field(
        default=None,
        description="distance along the outline, mm; spread over all of it if left out",
    )
    gap: Number = Field(default=0.2, description="distance outside the part, mm")
    direction: Annotated[Direction, or_words("inward", "outward")] = Field(
        default="inward", description="inward; outward; or a direction for all"
    )


class FromTable(Model):
    """Lights where a pick-and-place file of a board puts them."""

    file: str = Field(
        description="pick-and-place file of KiCad, Altium or EasyEDA, or a similar table"
    )
    only: str | list[str] | None = Field(
        default=None, description="designators, such as D1, [D1, D3] or D*; all if left out"
    )
    units: Units | None = Field(default=None, description="unit of the file, if it states none")
    points: dict[str, Vector] | None = Field(
        default=None, description="positions of two or three designators, mm"
    )
    origin: Vector | None = Field(
        default=None, description="position of the origin of the file, mm, instead of points"
    )
    right: Way | None = Field(
        default=None, description="direction of the x axis of the file, with origin; +x if left out"
    )
    normal: Way | None = Field(
        default=None,
        description="normal of the top of the board; needed with two points, +z with origin",
    )
    gap: Number = Field(default=0.05, description="distance from the board, mm")

    @model_validator(mode="after")
    def _one_mapping(self) -> FromTable:
        if (self.points is None) == (self.origin is None):
            raise ValueError("give either points, or the origin of the file")
        if self.points is not None:
            if len(self.points) not in (2, 3):
                raise ValueError("points needs two or three designators")
            if self.right is not None:
                raise ValueError(
                    "right is for origin only; points define the direction by themselves"
                )
            if (len(self.points) == 2) == (self.normal is None):
                raise ValueError(
                    "two points need normal, the direction of the top of the board (+z, -x, ...)"
                    if len(self.points) == 2
                    else "three points define the direction of the board; leave normal out"
                )
        return self


WAYS = ("row", "ring", "over", "along", "from", "at")
"""Names of the ways to place the lights of a group."""


class LightChoice(Model):
    """Light group of a recipe, placed in one of `WAYS`."""

    model_config = ConfigDict(validate_by_name=True, serialize_by_alias=True)

    model: Name = Field(description="light of the library")
    colour: ColourWord = Field(description=", ".join(NAMED_COLOURS) + " or [r, g, b]")
    flux: NonNegative | None = Field(
        default=None,
        description="flux of each light, mW; the nominal one of the library if left out",
    )
    row: LightRow | None = Field(default=None, description="lights along one side of a part's box")
    ring: Ring | None = Field(default=None, description="lights in a circle around a part")
    over: LightsOver | None = Field(default=None, description="lights over a surface")
    along: LightsAlong | None = Field(
        default=None, description="lights along the outline of a part"
    )
    table: FromTable | None = Field(
        default=None, alias="from", description="lights of a pick-and-place file"
    )
    at: list[Light] | None = Field(default=None, description="position of each light")

    @model_validator(mode="after")
    def _one_way(self) -> LightChoice:
        given = [
            way for way in WAYS if getattr(self, "table" if way == "from" else way) is not None
        ]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise ValueError(f"needs one of {', '.join(WAYS[:-1])} and {WAYS[-1]}, has {found}")
        return self
