"""Options of a rendered picture, and of a light ledger."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Le
from pydantic import Field

from optisense.commands.options import (
    LONGEST_RENDER,
    SKIN_HELP,
    CommandOptions,
    Exposure,
    OptionNotation,
    Photons,
    Resolution,
    Seed,
    Skin,
)
from optisense.mechanics.skins import ELASTIC
from optisense.quality import PICTURE_PHOTONS, photons_of


class RenderOptions(CommandOptions):
    """Options of a picture, and of when its light is good enough."""

    resolution: Resolution | None = Field(
        None,
        description="Width and height of the picture in pixels, such as 320x240; those of the "
        "camera if left out.",
    )
    photons: Photons | None = Field(
        None,
        description="Photons to trace: a number, draft (60,000), normal (1 million) or fine (5 "
        "million). Normal if no other limit is given.",
    )
    noise: Annotated[float, Ge(0.01), Le(100.0), OptionNotation("PERCENT")] | None = Field(
        None,
        description="Trace photons until the noise of the light is at most this many per cent.",
    )
    seconds: Annotated[float, Ge(0.01), Le(LONGEST_RENDER), OptionNotation("S")] | None = Field(
        None, description="Trace photons for this many seconds."
    )
    seed: Seed = Field(0, description="The same seed gives the same picture.")
    exposure: Exposure = Field(
        "auto",
        description="Brightness of the picture: a factor on the radiance, or automatic.",
    )
    skin: Skin = Field(ELASTIC, description=SKIN_HELP)

    def photons_to_trace(self, usual: str = "normal") -> int | None:
        """Return the number of photons asked for, or of `usual`; None if another limit is given."""
        limited = self.photons or self.noise or self.seconds
        return self.photons if limited else photons_of(usual)


class BeforeAndAfterOptions(CommandOptions):
    """Options of the pictures on a study's page."""

    photons: Photons = Field(PICTURE_PHOTONS, description="Photons to trace for each picture.")


class LedgerOptions(CommandOptions):
    """Options of the photons that a light ledger follows."""

    photons: Photons = Field(
        PICTURE_PHOTONS, description="Photons to trace, of all lights together."
    )
    seed: Seed = Field(0, description="The same seed gives the same photons.")
