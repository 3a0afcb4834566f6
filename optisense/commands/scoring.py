"""Options of scores."""

from __future__ import annotations

from typing import Annotated, Any

from annotated_types import Ge, Le
from pydantic import AfterValidator, Field

from optisense.commands.options import (
    MOST_ITEMS,
    CommandOptions,
    NamedValues,
    OptionNotation,
    Photons,
    Resolution,
    Seed,
    read_resolution,
)
from optisense.quality import LEVELS, photons_of

ScorePhotons = Annotated[
    Photons, OptionNotation(f"N|{LEVELS}", usual="fine, 5 million", is_text=True)
]


def _read(settings: dict[str, Any]) -> dict[str, Any]:
    """Return the settings with photons as a number, and resolutions as width and height."""
    found = dict(settings)
    if found.get("photons") is not None:
        found["photons"] = photons_of(found["photons"])
    for name in ("resolution", "ray_resolution"):
        if isinstance(found.get(name), str):
            found[name] = list(read_resolution(found[name]))
    return found


ObjectiveSettings = Annotated[
    NamedValues, AfterValidator(_read), OptionNotation("NAME=VALUE", ("--set",))
]


class ScoreOptions(CommandOptions):
    """Options of the images and rays of objectives."""

    settings: ObjectiveSettings = Field(
        {},
        description="A setting of the objectives, such as depth=0.5, noise=0.2 or photons=1000000. "
        "May be given several times.",
    )
    resolution: Resolution | None = Field(
        None,
        description="Width and height of the grid of pixels and rays; if left out, 640 wide, in "
        "the camera's aspect ratio.",
    )
    photons: ScorePhotons | None = Field(None, description="Photons to trace.")

    def for_objectives(self) -> dict[str, Any]:
        """Return all options as settings of objectives."""
        found = dict(self.settings)
        if self.photons is not None:
            found["photons"] = self.photons
        if self.resolution is not None:
            found["resolution"] = found["ray_resolution"] = list(self.resolution)
        return found


class EvaluateOptions(ScoreOptions):
    """Options of the scores of a design."""

    objectives: Annotated[list[str], OptionNotation("NAME", ("--objective", "-b"), "all four")] = (
        Field(
            [],
            description="rgb2normal, normdiff, aoap, 2to3pw, another one (--objectives lists all; "
            "docs/objectives.md describes them), or your own as FILE.py:FUNCTION. May be given "
            "several times.",
        )
    )
    seed: Seed = Field(0, description="The same seed gives the same scores.")
    seeds: Annotated[int, Ge(1), Le(MOST_ITEMS), OptionNotation("N")] = Field(
        1, description="Number of seeds to score with; from 2 on the standard deviation is printed."
    )


class ToleranceOptions(ScoreOptions):
    """Options of the scores of a design with manufacturing errors."""

    objectives: Annotated[list[str], OptionNotation("NAME", ("--objective", "-b"))] = Field(
        ["rgb2normal"],
        description="rgb2normal, normdiff, aoap, 2to3pw, or your own as FILE.py:FUNCTION. May be "
        "given several times.",
    )
    errors: Annotated[list[str], OptionNotation("PATH=SIZE", ("--error",), "usual ones")] = Field(
        [],
        description="A value with a manufacturing error, and the error's standard deviation (mm, "
        "degrees, or the value's own unit), or PATH=+-LIMIT for an error uniformly "
        "distributed up to a limit. lights.position and lights.angle mean each light "
        "by itself. May be given several times.",
    )
    sensors: Annotated[int, Ge(8), Le(MOST_ITEMS), OptionNotation("N")] = Field(
        120, description="Approximate number of manufactured sensors to simulate."
    )
    seed: Seed = Field(0, description="The same seed gives the same sensors.")
