"""Warning, before a search begins, that its parameters can't change its objective."""

from __future__ import annotations

import re
from collections.abc import Iterable

from optisense.errors import OptiSenseError
from optisense.objectives.named import are_rays_only, named_in

_NO_RAY_TURNS = re.compile(
    r"coating\..+"
    r"|lights\.[^.]+\.(flux|colour|spectrum)(\..+|\[.+)?"
    r"|materials\.[^.]+\.(reflectance|specularity|roughness|absorption|extinction)(\..+|\[.+)?"
)
"""Paths of numbers that change brightness, but no path of a ray: colours and powers of lights,
coatings, and how much a material reflects or absorbs.
"""

_FLUX = re.compile(r"lights\.[^.]+\.flux(\..+|\[.+)?")
"""Paths of the powers of lights, which the objective "power" sums."""

LIGHT_OBJECTIVES = ("rgb2normal", "normdiff")
"""Objectives of this package that read pictures."""


def changes_no_ray(path: str) -> bool:
    """Return whether a number of a design, by its path, changes only brightness and colours."""
    return _NO_RAY_TURNS.fullmatch(path.strip()) is not None


def advice(paths: Iterable[str], objectives: Iterable[str]) -> str | None:
    """Return a warning if no trial of a search can have another score than its start.

    Args:
        objectives: names of the objectives, expressions, or functions in files.

    Returns:
        A sentence that says why and one that says what to do; None if there is nothing to warn of.
    """
    named, varied = list(objectives), list(paths)
    if not named or not varied or not all(changes_no_ray(each) for each in varied):
        return None
    try:
        if not are_rays_only(named):
            return None
        if "power" in named_in(named) and any(_FLUX.fullmatch(each.strip()) for each in varied):
            return None
    except OptiSenseError:  # the parser of objectives reports it
        return None
    what, which = _listed(named), _listed(varied)
    one = len(named) == 1
    return (
        f"the objective{'' if one else 's'} {what} depend{'s' if one else ''} only on the paths of "
        f"rays, which {which} "
        f"{'does' if len(varied) == 1 else 'do'} not change: all trials will score alike. Maximise "
        f"{' or '.join(LIGHT_OBJECTIVES)}, or vary shapes, mirrors, lights' places or the camera"
    )


def _listed(texts: list[str]) -> str:
    """Return one to three texts joined by commas and "and"; for more, the first two and the number
    of the others.
    """
    if len(texts) > 3:
        texts = [*texts[:2], f"{len(texts) - 2} more"]
    return " and ".join(filter(None, [", ".join(texts[:-1]), texts[-1]]))
