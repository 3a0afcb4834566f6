"""Recipe of a sensor from CAD files: the role of each file, and the placement of lights and camera.

A recipe is a small YAML file, made by `optisense new --from-meshes` or by hand. This module reads
no mesh.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from optisense.design import Role
from optisense.design.fields import (
    Count,
    Fraction,
    InconsistentValueError,
    Model,
    Name,
    Number,
    Vector,
)
from optisense.design.problems import design_error
from optisense.design.yaml_reader import Lines, read_yaml
from optisense.errors import DesignError
from optisense.length_units import Units
from optisense.near import suggestion
from optisense.sensors.from_meshes.directions import Way
from optisense.sensors.from_meshes.recipe_lights import LightChoice
from optisense.sensors.from_meshes.recipe_parts import PartChoice, ShapeReference

Pixels = Annotated[Count, Field(le=65_536)]

SMALLEST_FOV = 0.1
"""Smallest field of view of a camera whose position is to be found, degrees; one with a smaller
field of view would stand half a kilometre away from the skin."""


class CameraChoice(Model):
    """Camera of a recipe and its placement."""

    model: Name = Field(description="camera of the library")
    at: Vector | ShapeReference | None = Field(
        default=None,
        description="position of the pupil, mm, or a shape in whose middle it is; behind the "
        "sensing surface if left out",
    )
    look_at: Name | Vector | None = Field(
        default=None,
        description="part or point (mm) in the middle of the picture; the sensing surface if left "
        "out",
    )
    direction: Way | None = Field(default=None, description="viewing direction, instead of look_at")
    up: Way | None = Field(default=None, description="direction to the top of the picture")
    projection: Literal["perspective", "equidistant"] | None = Field(
        default=None,
        description="perspective; equidistant (fisheye); that of the library if left out",
    )
    fov: Annotated[Number, Field(ge=SMALLEST_FOV, le=360.0)] | None = Field(
        default=None,
        description="field of view across the width, degrees; that of the library if left out",
    )
    resolution: tuple[Pixels, Pixels] | None = Field(
        default=None, description="width and height, pixels; 320 wide if left out"
    )
    imaging: bool = Field(
        default=False,
        description="whether shading, noise, colours and tone curve of the library are used; the "
        "camera is ideal if not",
    )

    @model_validator(mode="after")
    def _one_aim(self) -> CameraChoice:
        """Check that the viewing direction is given once."""
        if self.look_at is not None and self.direction is not None:
            raise ValueError("give look_at or direction, not both")
        return self


class Recipe(Model):
    """Recipe that makes a sensor from CAD files.

    Lengths are in mm, angles in degrees, powers in mW.
    """

    name: Annotated[str, Field(min_length=1, max_length=200)]
    description: str = ""
    units: Units | None = Field(
        default=None,
        description="unit of the files: mm; cm; m; inch; mil; um (STEP files state theirs)",
    )
    join: Annotated[Number, Field(ge=0.0, le=1.0)] = Field(
        default=0.05, description="distance up to which solids are made to touch, mm"
    )
    air_films: list[tuple[Name, Name]] = Field(
        default_factory=list,
        description="pairs of parts between which a thin film of air stays open",
    )
    coating: Name = Field(default="diffuse-grey", description="coating of the library")
    specularity: Fraction | None = Field(
        default=None,
        description="specularity of the coating, 0 to 1; that of the library if left out",
    )
    parts: Annotated[dict[Name, PartChoice], Field(min_length=1)]
    lights: dict[Name, LightChoice] = Field(default_factory=dict)
    camera: CameraChoice

    _folder: Path = PrivateAttr(default_factory=Path)
    _source: str | None = PrivateAttr(default=None)
    _lines: Lines = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _references_hold(self) -> Recipe:
        """Check that a sensing surface exists, and that all names of parts are known."""
        if not any(part.role is Role.SENSING_SURFACE for part in self.parts.values()):
            raise InconsistentValueError(
                "no part is a sensing_surface",
                ("parts",),
                "Give one part this role, or add one with faces_of and towards",
            )
        for path, name in self._named_parts():
            if name not in self.parts:
                hint = suggestion(name, self.parts)
                raise InconsistentValueError(
                    f"there is no part '{name}' in this recipe", path, hint
                )
        for name, part in self.parts.items():
            if part.faces_of is not None and self.parts[part.faces_of].faces_of is not None:
                raise InconsistentValueError(
                    f"part '{part.faces_of}' consists of faces of another part itself",
                    ("parts", name, "faces_of"),
                    "Name the part that has the file",
                )
        return self

    def _named_parts(self) -> list[tuple[tuple[str | int, ...], str]]:
        """Return the places of references to parts, and the names of the parts."""
        named: list[tuple[tuple[str | int, ...], str]] = []
        for name, part in self.parts.items():
            if part.faces_of is not None:
                named.append((("parts", name, "faces_of"), part.faces_of))
            if part.on is not None:
                named.append((("parts", name, "on"), part.on))
        for index, pair in enumerate(self.air_films):
            named += [(("air_films", index), name) for name in pair]
        for name, group in self.lights.items():
            for way in (group.row, group.ring):
                if way is not None:
                    key = "row" if way is group.row else "ring"
                    named.append((("lights", name, key, "part"), way.part))
            if group.along is not None:
                named.append((("lights", name, "along", "edge_of"), group.along.edge_of))
            if group.over is not None and group.over.faces_of is not None:
                named.append((("lights", name, "over", "faces_of"), group.over.faces_of))
        if isinstance(self.camera.at, ShapeReference) and self.camera.at.faces_of is not None:
            named.append((("camera", "at", "faces_of"), self.camera.at.faces_of))
        if isinstance(self.camera.look_at, str):
            named.append((("camera", "look_at"), self.camera.look_at))
        return named

    @property
    def folder(self) -> Path:
        """Return the folder that the paths of files are relative to."""
        return self._folder

    def relative_to(self, folder: Path) -> Recipe:
        """Set the folder that the paths are relative to, and return the recipe."""
        self._folder = folder
        return self

    def where(self, *path: str | int) -> str:
        """Return file and line of a value of a recipe read from a file, else its dotted path."""
        for length in range(len(path), -1, -1):
            if path[:length] in self._lines:
                return f"{self._source}:{self._lines[path[:length]]}"
        return ".".join(str(step) for step in path)


def read_recipe(path: str | Path) -> Recipe:
    """Read a recipe file; the paths in it are relative to its folder.

    Raises:
        DesignError: the file is missing, not YAML, or a field is missing, misspelt or out of range;
            the message names file and line.
    """
    path = Path(path)
    data, lines = read_yaml(path, DesignError)
    try:
        recipe = Recipe.model_validate(data)
    except ValidationError as error:
        raise design_error(error, data, where=str(path), lines=lines, model=Recipe) from None
    recipe._folder, recipe._source, recipe._lines = path.parent, str(path), lines
    return recipe
