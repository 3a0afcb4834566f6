"""Options of parts that are added to the user's library."""

from __future__ import annotations

from typing import Annotated, Any

from annotated_types import Ge, Le
from pydantic import AfterValidator, BeforeValidator, Field

from optisense.commands.options import CommandOptions, OptionNotation
from optisense.design import Status
from optisense.design.colour import WAVELENGTHS

LONGEST_SIDE = 1000.0
"""Largest length of a light's window or body, mm; a larger one is an error of the unit."""

COOLEST, HOTTEST = 1000.0, 20_000.0
"""Range of the colour temperature of light, K: from below candles to the blue sky."""


def above_0(value: float) -> float:
    """Return a number; ValueError if it is not above 0 and finite."""
    if not 0.0 < value < float("inf"):
        raise ValueError(f"{value:g} is not above 0")
    return value


def lengths(count: int) -> BeforeValidator:
    """Return a validator that parses lengths in mm such as 2.8x3.5x1.9."""

    def read(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        try:
            found = tuple(float(word) for word in value.lower().replace("×", "x").split("x"))
        except ValueError:
            found = ()
        if len(found) != count or not all(0.0 < length < LONGEST_SIDE for length in found):
            example = "x".join(["2.8", "3.5", "1.9"][:count])
            raise ValueError(f"'{value}' is not {count} lengths in mm, such as {example}")
        return found

    return BeforeValidator(read)


def _kelvin(value: float) -> float:
    if not COOLEST <= value <= HOTTEST:
        raise ValueError(f"{value:g} K is no colour of light")
    return value


Above0 = Annotated[float, AfterValidator(above_0)]


class IesOptions(CommandOptions):
    """Data of a light that its IES file lacks."""

    colour: Annotated[str, OptionNotation("COLOUR")] | None = Field(
        None, description="With an .ies: red, green, blue, white, or R,G,B from 0 to 1."
    )
    flux: Annotated[Above0, OptionNotation("MW")] | None = Field(
        None, description="With an .ies: radiant flux in mW."
    )
    wavelength: (
        Annotated[float, Ge(WAVELENGTHS[0]), Le(WAVELENGTHS[1]), OptionNotation("NM")] | None
    ) = Field(None, description="With an .ies: dominant wavelength in nm.")
    current: Annotated[Above0, OptionNotation("MA")] | None = Field(
        None, description="With an .ies: current in mA at this flux."
    )
    window: (
        Annotated[tuple[float, float], lengths(2), OptionNotation("WxH", is_text=True)] | None
    ) = Field(None, description="With an .ies: size of its opening in mm, as 2.4x2.4.")
    package: (
        Annotated[tuple[float, float, float], lengths(3), OptionNotation("WxLxH", is_text=True)]
        | None
    ) = Field(None, description="With an .ies: size of its body in mm, as 2.8x3.5x1.9.")
    source: Annotated[str, OptionNotation("TEXT")] | None = Field(
        None, description="With an .ies: where these numbers are from."
    )
    status: Annotated[Status, OptionNotation("STATUS", is_text=True)] = Field(
        Status.ASSUMED,
        description="With an .ies: measured, datasheet, sourced, derived or assumed.",
    )


class TuningOptions(CommandOptions):
    """Data of a camera that a tuning file lacks."""

    like: Annotated[str, OptionNotation("NAME")] | None = Field(
        None,
        description="With --tuning: the camera of the library whose lens and pixels the new entry "
        "has; all else is from the file.",
    )
    temperature: Annotated[float, AfterValidator(_kelvin), OptionNotation("K")] | None = Field(
        None, description="With --tuning: colour temperature in K; 5000 if left out."
    )
