"""Options of a light ledger."""

from __future__ import annotations

from pydantic import Field

from optisense.commands.options import CommandOptions, Photons, Seed
from optisense.quality import PICTURE_PHOTONS


class LedgerOptions(CommandOptions):
    """Options of the photons that are followed."""

    photons: Photons = Field(
        PICTURE_PHOTONS, description="Photons to trace, of all lights together."
    )
    seed: Seed = Field(0, description="The same seed gives the same photons.")
