"""The recipe of a sensor from CAD files: which file is what, and where lights and camera go.

A recipe is a small YAML file, made by `optisense new --from-meshes` or by hand. Nothing here
reads a mesh.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, PrivateAttr, ValidationError, model_validator

from optisense.design import Light, Role
from optisense.design.colour import NAMED_COLOURS
from optisense.design.fields import (
    Count,
    Fraction,
    MisfitError,
    Model,
    Name,
    NonNegative,
    Number,
    Positive,
    Vector,
)
from optisense.design.problems import design_error
from optisense.design.yaml_reader import Lines, read_yaml
from optisense.errors import DesignError
from optisense.near import suggestion
from optisense.sensors.from_meshes.directions import Direction, Side, Way, or_words

Units = Literal["mm", "cm", "m", "inch", "um"]
MM_PER: dict[str, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "um": 0.001}
"""Millimetres in each unit that CAD tools export."""

Angle = Annotated[Number, Field(ge=0.0, le=180.0)]
Turn = Annotated[Number, Field(ge=-720.0, le=720.0)]
Pixels = Annotated[Count, Field(le=65_536)]

MOST_LIGHTS = 10_000
"""Largest number of lights in a group; a larger one is a slip, for instance a pitch in metres."""

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
    """A validator for a number or a list of two, each at least (whole) or above `least`."""
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


class ShapeReference(Model):
    """A shape: a file, or faces of another part."""

    file: str | None = Field(default=None, description="OBJ, STL, PLY or STEP")
    solid: str | None = Field(default=None, description="which body of a STEP file")
    units: Units | None = Field(default=None, description="of this file, if not as the others")
    faces_of: Name | None = Field(default=None, description="the part whose faces these are")
    towards: Way | None = Field(default=None, description="only the faces that look there")
    within: Angle | None = Field(default=None, description="degrees, how far they may look aside")
    tangent: bool | None = Field(
        default=None, description="and those that go on from them without a sharp edge"
    )
    patches: Literal["largest", "all"] | None = Field(
        default=None, description="of several separate patches: largest; all"
    )

    @model_validator(mode="after")
    def _one_source(self) -> ShapeReference:
        if (self.file is None) == (self.faces_of is None):
            raise ValueError("give either a file, or faces_of another part")
        if self.faces_of is not None and (self.solid is not None or self.units is not None):
            raise ValueError("solid and units go with a file, not with faces_of")
        if self.faces_of is not None and self.towards is None:
            raise ValueError("faces_of needs towards: where do the faces look? (+z, -x, ...)")
        for name in ("within", "tangent", "patches"):
            if getattr(self, name) is not None and self.towards is None:
                raise ValueError(f"{name} goes with towards, which is missing")
        return self


class PartChoice(ShapeReference):
    """A part of the sensor."""

    role: Role = Field(description="; ".join(role.value for role in Role))
    material: Name | None = Field(default=None, description="of the library")
    priority: Annotated[int, Field(strict=True, ge=-1000, le=1000)] | None = Field(
        default=None, description="where solids overlap, the higher one counts"
    )


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


class Over(ShapeReference):
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
    def _not_too_many(self) -> Over:
        if isinstance(self.count, tuple) and self.count[0] * self.count[1] > MOST_LIGHTS:
            raise ValueError(f"{self.count[0]} x {self.count[1]} are more than {MOST_LIGHTS}")
        return self


class LightChoice(Model):
    """A light group and how its lights are placed: give one of row, ring, over and at."""

    model: Name = Field(description="light of the library")
    colour: ColourWord = Field(description=", ".join(NAMED_COLOURS) + " or [r, g, b]")
    flux: NonNegative = Field(default=10.0, description="mW of each light")
    row: LightRow | None = Field(default=None, description="lights along one side of a part's box")
    ring: Ring | None = Field(default=None, description="lights in a circle around a part")
    over: Over | None = Field(default=None, description="lights over a surface")
    at: list[Light] | None = Field(default=None, description="each light by its place")

    @model_validator(mode="after")
    def _one_way(self) -> LightChoice:
        given = [way for way in ("row", "ring", "over", "at") if getattr(self, way) is not None]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise ValueError(f"needs one of row, ring, over and at, has {found}")
        return self


class CameraChoice(Model):
    """The camera and where it is."""

    model: Name = Field(description="camera of the library")
    at: Vector | ShapeReference | None = Field(
        default=None,
        description="mm, its pupil, or a shape in whose middle it is; behind the sensing surface "
        "if left out",
    )
    look_at: Name | Vector | None = Field(
        default=None, description="part or point; the sensing surface if left out"
    )
    direction: Way | None = Field(default=None, description="where it looks, instead of look_at")
    up: Way | None = Field(default=None, description="upward in the picture")
    fov: Annotated[Number, Field(gt=0.0, le=360.0)] | None = Field(
        default=None, description="degrees across the width, if not the library's"
    )
    resolution: tuple[Pixels, Pixels] | None = Field(
        default=None, description="pixels; 320 wide if left out"
    )

    @model_validator(mode="after")
    def _one_aim(self) -> CameraChoice:
        if self.look_at is not None and self.direction is not None:
            raise ValueError("give look_at or direction, not both")
        return self


class Recipe(Model):
    """How a sensor is made of CAD files. Lengths in mm, angles in degrees, powers in mW."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    description: str = ""
    units: Units | None = Field(
        default=None, description="of the files: mm; cm; m; inch; um (STEP files know theirs)"
    )
    join: Annotated[Number, Field(ge=0.0, le=1.0)] = Field(
        default=0.05, description="mm; solids nearer than this are made to touch"
    )
    air_films: list[tuple[Name, Name]] = Field(
        default_factory=list, description="pairs of parts with a thin film of air that is meant"
    )
    coating: Name = Field(default="diffuse-grey", description="coating of the library")
    specularity: Fraction | None = Field(
        default=None, description="of the coating, 0 to 1, if not the library's"
    )
    parts: Annotated[dict[Name, PartChoice], Field(min_length=1)]
    lights: dict[Name, LightChoice] = Field(default_factory=dict)
    camera: CameraChoice

    _folder: Path = PrivateAttr(default_factory=Path)
    _source: str | None = PrivateAttr(default=None)
    _lines: Lines = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _references_hold(self) -> Recipe:
        if not any(part.role is Role.SENSING_SURFACE for part in self.parts.values()):
            raise MisfitError(
                "no part is a sensing_surface",
                ("parts",),
                "Give one part this role, or add one with faces_of and towards",
            )
        for path, name in self._named_parts():
            if name not in self.parts:
                hint = suggestion(name, self.parts)
                raise MisfitError(f"there is no part '{name}' in this recipe", path, hint)
        for name, part in self.parts.items():
            if part.faces_of is not None and self.parts[part.faces_of].faces_of is not None:
                raise MisfitError(
                    f"part '{part.faces_of}' consists of faces of another part itself",
                    ("parts", name, "faces_of"),
                    "Name the part that has the file",
                )
        return self

    def _named_parts(self) -> list[tuple[tuple[str | int, ...], str]]:
        """Where parts are named, and their names."""
        named: list[tuple[tuple[str | int, ...], str]] = []
        for name, part in self.parts.items():
            if part.faces_of is not None:
                named.append((("parts", name, "faces_of"), part.faces_of))
        for index, pair in enumerate(self.air_films):
            named += [(("air_films", index), name) for name in pair]
        for name, group in self.lights.items():
            for way in (group.row, group.ring):
                if way is not None:
                    key = "row" if way is group.row else "ring"
                    named.append((("lights", name, key, "part"), way.part))
            if group.over is not None and group.over.faces_of is not None:
                named.append((("lights", name, "over", "faces_of"), group.over.faces_of))
        if isinstance(self.camera.at, ShapeReference) and self.camera.at.faces_of is not None:
            named.append((("camera", "at", "faces_of"), self.camera.at.faces_of))
        if isinstance(self.camera.look_at, str):
            named.append((("camera", "look_at"), self.camera.look_at))
        return named

    @property
    def folder(self) -> Path:
        """What the paths of files start from."""
        return self._folder

    def relative_to(self, folder: Path) -> Recipe:
        """The same recipe with paths that start from this folder."""
        self._folder = folder
        return self

    def where(self, *path: str | int) -> str:
        """File and line of a value when the recipe was read from a file, else its dotted path."""
        for length in range(len(path), -1, -1):
            if path[:length] in self._lines:
                return f"{self._source}:{self._lines[path[:length]]}"
        return ".".join(str(step) for step in path)


def read_recipe(path: str | Path) -> Recipe:
    """Read a recipe file; the paths in it start from its folder.

    Raises:
        DesignError: it is missing, not YAML, or a field is missing, misspelt or out of range;
            says file and line.
    """
    path = Path(path)
    data, lines = read_yaml(path, DesignError)
    try:
        recipe = Recipe.model_validate(data)
    except ValidationError as error:
        raise design_error(error, data, where=str(path), lines=lines, model=Recipe) from None
    recipe._folder, recipe._source, recipe._lines = path.parent, str(path), lines
    return recipe
