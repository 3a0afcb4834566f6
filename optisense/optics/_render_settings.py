"""Checks of the settings of `OpticalModel.render`."""

from __future__ import annotations

from typing import Any

from optisense.errors import RenderError
from optisense.keyword_types import is_real
from optisense.mechanics import SKINS
from optisense.optics._skin_view import is_size
from optisense.optics.estimators import ESTIMATORS
from optisense.quality import MOST_PIXELS, MOST_SEED, photons_of


def check_choices(estimator: str, skin: str, noise: Any, seconds: Any, seed: Any) -> None:
    """Raise RenderError if a setting of `OpticalModel.render` is invalid."""
    if estimator not in ESTIMATORS:
        raise RenderError(
            f"there is no estimator '{estimator}'", hint="Use " + " or ".join(ESTIMATORS)
        )
    if skin not in SKINS:
        raise RenderError(f"there is no kind of skin '{skin}'", hint="Use " + " or ".join(SKINS))
    for name, value in (("noise", noise), ("seconds", seconds)):
        if value is not None and not (is_real(value) and value > 0):
            raise RenderError(
                f"the limit '{name}' is {value!r}", hint="Give a number above 0, or none"
            )
    if not (isinstance(seed, int) and 0 <= seed <= MOST_SEED):
        raise RenderError(f"the seed is {seed!r}", hint=f"Give a number from 0 to {MOST_SEED}")


def check_pixels(resolution: object) -> None:
    """Raise RenderError if a picture has too many pixels."""
    if not is_size(resolution):
        return
    width, height = map(int, resolution)  # a product of NumPy's integers may overflow
    if width * height > MOST_PIXELS:
        raise RenderError(
            f"a picture of {width} x {height} pixels is too large",
            hint=f"Ask for at most {MOST_PIXELS:,} pixels",
        )


def number_of_photons(given: int | str) -> int:
    """Return a number of photons, or that of a level of `optisense.quality`.

    Raises:
        RenderError: there is no such level, or the number is out of its range.
    """
    try:
        return photons_of(given)
    except ValueError as error:
        raise RenderError(str(error)) from None
