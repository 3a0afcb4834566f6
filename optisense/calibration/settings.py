"""Settings of a calibration."""

from __future__ import annotations

from dataclasses import dataclass

from optisense.calibration.families import USUAL
from optisense.calibration.photographs import Photographs
from optisense.errors import CalibrationError
from optisense.near import suggestion
from optisense.quality import FIT_PHOTONS

EARLIER_PHOTONS = 0.3
"""Number of photons of the earlier rounds, as a share of those of the last; their noise changes
numbers by less than a later round does.
"""

ROUNDS = 4
"""Default number of rounds of rendering and fitting: with three, hidden numbers of simulated
photographs are far off, as layers are linear for small changes only."""

HELD_OUT = 3
"""Interval of held-out presses: every third press is held out and only evaluated, if there are at
least as many. Of the recommended six presses, four are then fitted.
"""


@dataclass(frozen=True)
class CalibrationSettings:
    """Settings of a calibration.

    Attributes:
        families: families of numbers that may change, of `families.FAMILIES`.
        asked: path, smallest and largest value of further numbers of the design.
        rounds: number of rounds of rendering and fitting.
        photons: number of photons of the light of the last round and of the comparison; earlier
            rounds have 0.3 times as many.
        seed: seed of the light.
        refine: whether labelled contacts are first searched near their labels.
        held_out: names of the presses that are held out; every third one if None.
    """

    families: tuple[str, ...] = USUAL
    asked: tuple[tuple[str, float, float], ...] = ()
    rounds: int = ROUNDS
    photons: int = FIT_PHOTONS
    seed: int = 0
    refine: bool = True
    held_out: tuple[str, ...] | None = None

    def photons_of(self, number: int) -> int:
        """Return the number of photons of a round, counted from 0."""
        last = number >= self.rounds - 1
        return self.photons if last else max(round(EARLIER_PHOTONS * self.photons), 1)

    def check_held_out(self, photographs: Photographs, shown: Photographs) -> None:
        """Raise CalibrationError if no photograph has a name that is held out, or if it is not
        among those that show a contact.
        """
        names = [press.name for press in photographs.presses]
        for name in self.held_out or ():
            if name not in names:
                raise CalibrationError(
                    f"there is no press '{name}' to hold out", hint=suggestion(name, names)
                )
            if all(press.name != name for press in shown.presses):
                raise CalibrationError(
                    f"press '{name}' shows no contact, and tests nothing",
                    hint="Hold out another one",
                )

    def indices_held_out(self, photographs: Photographs) -> list[int]:
        """Return the indices of the presses that are held out, see `check_held_out`."""
        names = [press.name for press in photographs.presses]
        if self.held_out is None:
            return list(range(HELD_OUT - 1, len(names), HELD_OUT))
        return [index for index, name in enumerate(names) if name in self.held_out]
