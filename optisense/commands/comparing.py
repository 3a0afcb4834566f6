"""Options of a comparison with photographs."""

from __future__ import annotations

from typing import Annotated, Any

from annotated_types import Ge, Le
from pydantic import AfterValidator, BeforeValidator, Field

from optisense.commands.options import CommandOptions, OptionNotation, Photons, Seed, one_of
from optisense.quality import FIT_PHOTONS, PICTURE_PHOTONS

LARGEST_BALL = 1000.0
"""Largest diameter of a ball, mm; sensors are far smaller, so larger values have a wrong unit."""


def _family(name: str) -> str:
    """Return the name of a family of numbers that a calibration may fit."""
    from optisense.calibration.families import FAMILIES

    return one_of(FAMILIES)(name)


def _number_range(text: str) -> tuple[str, float, float]:
    """Return the path, the lowest and the highest value of a PATH=LO:HI."""
    path, equals, given = text.partition("=")
    low, colon, high = given.partition(":")
    try:
        if not (equals and colon and path.strip()):
            raise ValueError
        return path.strip(), float(low), float(high)
    except ValueError:
        raise ValueError(f"'{text}' is not PATH=LO:HI, such as camera.fov=45:60") from None


FamilyName = Annotated[str, AfterValidator(_family)]
NumberRange = Annotated[tuple[str, float, float], BeforeValidator(_number_range)]


class PhotographOptions(CommandOptions):
    """Options of how photographs are read."""

    ball: Annotated[float, Ge(0.01), Le(LARGEST_BALL), OptionNotation("MM")] | None = Field(
        None,
        description="Diameter of the ball in mm; needed if the folder of photographs does not say "
        "it.",
    )
    as_labelled: bool = Field(
        False,
        description="Use labelled contacts as they are; by default they are searched for near "
        "their labels.",
    )


class CompareOptions(PhotographOptions):
    """Options of a comparison of a design with photographs."""

    photons: Photons = Field(
        PICTURE_PHOTONS, description="Photons to trace for the pictures of the model."
    )
    seed: Seed = Field(0, description="The same seed gives the same light.")


class CalibrateOptions(PhotographOptions):
    """Options of a fit of a design to photographs."""

    keep: Annotated[list[FamilyName], OptionNotation("NAME")] = Field(
        [],
        description="What the fit does not change: powers, colours, tone, black, shading, view or "
        "place. May be given several times.",
    )
    also: Annotated[list[FamilyName], OptionNotation("NAME")] = Field(
        [],
        description="What the fit also changes: pose, distortion, leds, lights, rows, emission, "
        "edges, coating, gel or indices. May be given several times.",
    )
    fit: Annotated[list[NumberRange], OptionNotation("PATH=LO:HI")] = Field(
        [],
        description="Another number of the design that the fit changes, and its range, such as "
        "coating.specularity=0:0.4. May be given several times.",
    )
    hold_out: Annotated[list[str], OptionNotation("PRESS")] = Field(
        [],
        description="The file name of a press that the fit does not use, and that tests the "
        "result; every third press if none is named. May be given several times.",
    )
    rounds: Annotated[int, Ge(1), Le(20), OptionNotation("N")] = Field(
        4, description="Number of rounds of rendering and fitting."
    )
    photons: Photons = Field(
        FIT_PHOTONS, description="Photons of the last round; the others have 0.3 times as many."
    )
    seed: Seed = Field(0, description="The same seed gives the same light.")

    def settings(self) -> Any:
        """Return the settings of a calibration, which take a second to load."""
        from optisense.calibration.families import chosen_families
        from optisense.calibration.settings import CalibrationSettings

        return CalibrationSettings(
            families=chosen_families(self.keep, self.also),
            asked=tuple(self.fit),
            rounds=self.rounds,
            photons=self.photons,
            seed=self.seed,
            refine=not self.as_labelled,
            held_out=tuple(self.hold_out) or None,
        )
