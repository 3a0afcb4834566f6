"""Warnings that the parameters of a search can't change its objective, or leave out its design."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

from optisense.design import SensorDesign, get_value
from optisense.errors import OptiSenseError
from optisense.objectives.named import are_rays_only, named_in
from optisense.search.executors import processors
from optisense.search.space.parameters import Choice
from optisense.search.space.search_space import BoundSpace

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


LOADING_TIME = 2.0
"""Time to load and compile before the first score, s; measured on two processors."""

RAYS_TIME = 0.1
"""Processor time of a score that traces rays only, s; measured on GelSight Svelte."""

PICTURES_TIME = 3.4
"""Processor time of a score by pictures with `TRIAL_PHOTONS`, s; measured on GelSight Mini."""

USUAL_AREA = 524.0
"""Area of the sensing surface of GelSight Mini, mm2."""

LARGEST_FACTOR = 3.0
"""Largest factor on the duration of a score for larger surfaces: GelSight Svelte (1,478 mm2),
GelSight360 (2,989 mm2) and GelBelt (3,581 mm2) take 2.9 to 3.3 times as long as GelSight Mini.
"""

MOST_THREADS = 8
"""Largest number of processors that shorten a score; more are idle between short kernels."""


def usual_seconds(design: SensorDesign, objectives: Iterable[str], trials: int) -> float:
    """Return the usual duration of a search in one process on this machine, s."""
    if are_rays_only(objectives):
        each = RAYS_TIME
    else:
        each = PICTURES_TIME * min(max(design.sensing_area / USUAL_AREA, 0.5), LARGEST_FACTOR)
    return LOADING_TIME + (1 + trials) * each / min(processors(), MOST_THREADS)


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


def moved_start_note(space: BoundSpace) -> str | None:
    """Return a note on the values of a design that a search space leaves out, so that the search
    starts with others; None if the space has them all.
    """
    moved = []
    for parameter, start in zip(space.parameters, space.start.tolist(), strict=True):
        kind, expected = parameter.kind, start
        if parameter.variable is not None:
            own: Any = parameter.variable.start(space.design)
        else:
            target = parameter.targets[0]
            own = get_value(space.prepared, target.path)
            expected = target.scale * start + target.offset
        if isinstance(kind, Choice):
            begins, stays = kind.labels[round(start)], own in kind.options
        else:
            begins, stays = f"{expected:g}", math.isclose(own, expected, abs_tol=1e-9)
        if not stays:
            shown = f"{own:g}" if isinstance(own, float) else str(own)
            moved.append(f"{parameter.name} begins with {begins} (the design has {shown})")
    if not moved:
        return None
    return f"the design is not in the search space: {_listed(moved)}"


def _listed(texts: list[str]) -> str:
    """Return up to three texts joined by commas and "and"; of more, two and a count."""
    if len(texts) > 3:
        texts = [*texts[:2], f"{len(texts) - 2} more"]
    return " and ".join(filter(None, [", ".join(texts[:-1]), texts[-1]]))
