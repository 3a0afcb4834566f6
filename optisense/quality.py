"""Quality levels: the numbers of photons for Python, commands and front ends, in one table.

The relative RMS noise of the light on the skin of the built-in sensors is about 3 % with a million
photons and falls with the square root of their number; docs/performance.md has the times.
"""

from __future__ import annotations

import math

PHOTONS = {"draft": 60_000, "normal": 1_000_000, "fine": 5_000_000}
"""Number of photons of each quality level.

draft: interactive editing in the studio, and a first look. normal: pictures, and the trials of
searches. fine: scores, datasets and tasks, whose numbers are compared with one another.
"""

PICTURE_PHOTONS = PHOTONS["normal"]
"""Default number of photons of a picture; its noise is then hardly visible."""

TRIAL_PHOTONS = PHOTONS["normal"]
"""Default number of photons of a trial of a search. Another seed changes the score of a design by
as much as five million photons do (RGB2Normal of a GelSight Mini: 0.001 to 0.002; NormDiff: 1 to 2
%), and the best trials are scored again with fresh seeds.
"""

SCORE_PHOTONS = PHOTONS["fine"]
"""Default number of photons of an evaluation, whose scores are compared with one another."""

SAMPLE_PHOTONS = PHOTONS["fine"]
"""Default number of photons of results of many pictures: datasets, tasks, calibrations."""

FIT_PHOTONS = 3_000_000
"""Default number of photons of the last round of a fit to photographs; the noise of the light is
then 1 to 5 % of the radiance, smooth over some eight pixels.
"""

QUICK_PHOTONS = 500_000
"""Number of photons of a quick verification: a tenth of the usual number."""

MOST_PHOTONS = 10_000_000_000
"""Largest number of photons of an image; it takes days, so more is a typing error."""

MOST_SEED = 2**32 - 1
"""Largest seed of NumPy's older generators and of Mitsuba's samplers: 32 bits."""

MOST_PIXELS = 20_000_000
"""Largest number of pixels of a picture that may be asked for; more would take all memory, and is a
typing error."""

LEVELS = "|".join(PHOTONS)
"""Names of the levels, as help texts list them."""


def photons_of(quality: int | float | str) -> int:
    """Return the number of photons of a level, or a number as it is.

    Args:
        quality: level, or a whole number from 1 to `MOST_PHOTONS`, also as text or as a float.

    Raises:
        ValueError: the argument is neither.
    """
    if isinstance(quality, str) and quality.strip().lower() in PHOTONS:
        return PHOTONS[quality.strip().lower()]
    try:
        number = math.nan if isinstance(quality, bool) else float(quality)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if MOST_PHOTONS < number < math.inf:
        raise ValueError(f"photons are {number:g}, more than {MOST_PHOTONS:,}")
    if number.is_integer() and number > 0:
        return int(number)
    raise ValueError(f"photons are {quality!r}, neither a whole number above 0 nor {LEVELS}")
