"""Building blocks of option models, and parsers of values that users write as text; a ValueError
tells which form a text should have.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from annotated_types import Ge, Le
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict

from optisense.mechanics.skins import SKINS
from optisense.quality import LEVELS, MOST_PIXELS, MOST_SEED, photons_of

LONGEST_RENDER = 7 * 24 * 3600.0
"""Longest time that a picture may be asked to take, s: a week; more is a typing error."""

MOST_ITEMS = 10_000_000
"""Largest number of samples, trials or sensors that may be asked for; more would take years."""

EXPOSURES = (1e-9, 1e9)
"""Smallest and largest factor on the radiance; built-in sensors have factors of 10 to 1000."""

MOST_MARGIN = 100.0
"""Largest distance between a cage and its parts, mm: more than the size of a tactile sensor."""


class CommandOptions(BaseModel):
    """Base class of the options of a command; unknown options are refused."""

    model_config = ConfigDict(extra="forbid", strict=False)


@dataclass(frozen=True)
class OptionNotation:
    """Notation of an option on the command line.

    Attributes:
        form: placeholder of its value in help texts, such as WIDTHxHEIGHT.
        flags: names of the option; made from the field's name if empty.
        usual: description of the default in help texts, if the field has none.
        is_text: whether its value is text that the field's own validator parses.
    """

    form: str | None = None
    flags: tuple[str, ...] = ()
    usual: str | None = None
    is_text: bool = False


def read_resolution(value: Any) -> Any:
    """Return width and height in pixels, from a pair of numbers or WIDTHxHEIGHT."""
    if not isinstance(value, str):
        return value
    match = re.fullmatch(r"\s*([0-9]{1,6})\s*[xX×]\s*([0-9]{1,6})\s*", value)
    if match is None:
        raise ValueError(f"'{value}' is not WIDTHxHEIGHT, such as 320x240")
    width, height = int(match[1]), int(match[2])
    if width < 1 or height < 1 or width * height > MOST_PIXELS:
        raise ValueError(f"'{value}' is not between 1x1 and {MOST_PIXELS:,} pixels")
    return width, height


def read_exposure(value: Any) -> float | Literal["auto"]:
    """Return a positive factor, or "auto"."""
    if isinstance(value, str) and value.strip().lower() == "auto":
        return "auto"
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not EXPOSURES[0] <= number <= EXPOSURES[1]:
        raise ValueError(
            f"'{value}' is neither 'auto' nor a number from {EXPOSURES[0]:g} to {EXPOSURES[1]:g}"
        )
    return number


def read_range(value: Any) -> Any:
    """Return two numbers, from a pair, LOW:HIGH or one number."""
    if not isinstance(value, str):
        return value
    low, _, high = value.partition(":")
    try:
        found = float(low), float(high or low)
        if not all(map(math.isfinite, found)):
            raise ValueError
        return found
    except ValueError:
        raise ValueError(f"'{value}' is not LOW:HIGH, such as 0.3:1") from None


def read_named(value: Any) -> Any:
    """Return values by name, from a mapping or NAME=VALUE texts, whose values are parsed as in a
    design file: 1e-3 is a number.
    """
    if not isinstance(value, list):
        return value
    from optisense.design.yaml_reader import parse_yaml
    from optisense.errors import OptiSenseError

    found = {}
    for text in value:
        name, equals, given = text.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or not name:
            raise ValueError(f"'{text}' is not NAME=VALUE")
        if name in found:
            raise ValueError(f"'{name}' is given twice")
        try:
            read, _ = parse_yaml(f"value: {given}", name)
        except OptiSenseError:
            raise ValueError(f"the value in '{text}' can't be read") from None
        found[name] = read["value"]
    return found


def one_of(names: Collection[str]) -> Callable[[str], str]:
    """Return a validator that accepts one of several names."""

    def check(value: str) -> str:
        if value not in names:
            raise ValueError(f"'{value}' is none of " + ", ".join(names))
        return value

    return check


Seed = Annotated[int, Ge(0), Le(MOST_SEED), OptionNotation("N")]

Resolution = Annotated[
    tuple[int, int], BeforeValidator(read_resolution), OptionNotation("WIDTHxHEIGHT", is_text=True)
]

Photons = Annotated[int, BeforeValidator(photons_of), OptionNotation(f"N|{LEVELS}", is_text=True)]

Exposure = Annotated[
    float | Literal["auto"],
    BeforeValidator(read_exposure),
    OptionNotation("auto|VALUE", is_text=True),
]

Skin = Annotated[str, AfterValidator(one_of(SKINS)), OptionNotation("|".join(SKINS))]
SKIN_HELP = (
    "How the skin deforms: as an elastic gel (elastic), or taking the shape of "
    "the indenter and staying flat around it (conforming)."
)

Range = Annotated[
    tuple[float, float], BeforeValidator(read_range), OptionNotation("LOW:HIGH", is_text=True)
]

NamedValues = Annotated[dict[str, Any], BeforeValidator(read_named)]
