"""Checks, before a search begins, that what it varies can change what it maximises."""

from __future__ import annotations

import re
from collections.abc import Iterable

from optisense.errors import OptiSenseError
from optisense.objectives.named import are_rays_only

_NO_RAY_TURNS = re.compile(
    r"coating\..+"
    r"|lights\.[^.]+\.(flux|colour|spectrum)(\..+|\[.+)?"
    r"|materials\.[^.]+\.(reflectance|specularity|roughness|absorption|extinction)(\..+|\[.+)?"
)
"""Paths of numbers that change how bright something is, and neither where a ray goes nor where it
ends: colours and powers of lights, coatings, and how much a material reflects or absorbs."""

LIGHT_OBJECTIVES = ("rgb2normal", "normdiff")
"""Objectives of this package that look at pictures."""


def turns_no_ray(path: str) -> bool:
    """Whether a number of a design, by its path, changes brightness and colours only."""
    return _NO_RAY_TURNS.fullmatch(path.strip()) is not None


def advice(paths: Iterable[str], objectives: Iterable[str]) -> str | None:
    """What is to be said against a search: that no trial will score otherwise than its start.

    Args:
        paths: what varies.
        objectives: names of what is maximised, expressions, or functions in files.

    Returns:
        A sentence that says why and one that says what to do; None where nothing is to be said.
    """
    named, varied = list(objectives), list(paths)
    if not named or not varied or not all(turns_no_ray(each) for each in varied):
        return None
    try:
        if not are_rays_only(named):
            return None
    except OptiSenseError:  # told by what reads it in full
        return None
    what, which = _listed(named), _listed(varied)
    return (
        f"{what} {'looks' if len(named) == 1 else 'look'} at where rays go, which {which} "
        f"{'does' if len(varied) == 1 else 'do'} not change: all trials will score alike. Maximise "
        f"{' or '.join(LIGHT_OBJECTIVES)}, or vary shapes, mirrors, lights' places or the camera"
    )


def _listed(texts: list[str]) -> str:
    """One to three texts in words; of more, the first two and how many follow."""
    if len(texts) > 3:
        texts = [*texts[:2], f"{len(texts) - 2} more"]
    return " and ".join(filter(None, [", ".join(texts[:-1]), texts[-1]]))
