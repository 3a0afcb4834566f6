"""The share of the view at the start that the camera of each trial must keep."""

from __future__ import annotations

from collections.abc import Iterable

from optisense.design import SensorDesign
from optisense.design.camera_checks import LEAST_SKIN
from optisense.errors import OptiSenseError, SetupError
from optisense.objectives.evaluation import Evaluation
from optisense.search.evaluation.models import ModelCache

LEAST_OF_START = 0.5
"""Share of the sensing surface seen at the start that a trial must see. Scores grow as the camera
looks at less of the surface, so a search over the field of view would end at the smallest allowed
view. Values come from examples: a GelSight360 that sees only its tip, 0.41 of the surface of the
design, is useless, and cameras that see 0.56 of the start or more
(`benchmarks/single_parameters.py`) are useful zooms.
"""

VIEW_RAYS = 48
"""Number of columns of the grid of chief rays that shows by which mirrors the camera sees the skin.
Of GelSight Svelte's, 500 arrive; shares are off by at most one column of the picture, 0.03, and a
trial by AOAP takes at most a twentieth longer.
"""

MOST_BY_OTHER_MIRRORS = 0.1
"""Share of the chief rays that may reach the sensing surface by other mirrors than in the design
that the search starts from, or by none. All rays of GelSight Svelte go by both of its mirrors. With
AOAP as the goal and a camera that may turn, the best designs had 31 to 99 % of the rays miss them;
a strip of 6 % beside the edge of a mirror turned by a degree does no harm.
"""

RAY_INDEPENDENT = ("lights.", "coating.")
"""Prefixes of the names of parameters on which no chief ray depends."""


class SameMirrors:
    """Constraint that the camera sees the sensing surface by the same mirrors as in the starting
    design.

    A mirror that the camera looks past is a part that nobody would build.
    """

    def __init__(self, design: SensorDesign, models: ModelCache) -> None:
        """Store the design that the search starts from; nothing is traced yet."""
        self._design = design
        self._models = models
        self._ways: frozenset[frozenset[str]] | None = None

    def __call__(self, design: SensorDesign) -> str | None:
        """Return a message with the share of rays that miss the mirrors if it is too large."""
        if self._ways is None:
            self._ways = frozenset(self._seen(self._design))
        seen = self._seen(design)
        other = {way: share for way, share in seen.items() if way not in self._ways}
        if not self._ways or sum(other.values()) <= MOST_BY_OTHER_MIRRORS:
            return None
        now = _way_in_words(max(other, key=lambda way: other[way]))
        before = " or ".join(sorted(_way_in_words(way) for way in self._ways))
        return (
            f"{100 * sum(other.values()):.0f} % of the rays that reach the sensing surface are not "
            "reflected by the same mirrors as in the design that the search starts from: "
            f"{now} instead of {before}"
        )

    def _seen(self, design: SensorDesign) -> dict[frozenset[str], float]:
        return self._models.model(design).views_by_mirrors(design.camera.size_at(VIEW_RAYS))


def least_skin(design: SensorDesign, models: ModelCache) -> float:
    """Return the share of the sensing surface that trials must see if no setting says otherwise.

    Args:
        design: design that the search starts from.

    Raises:
        SetupError: the renderer can't run on this machine.
    """
    try:
        seen = Evaluation(models.model(design)).view.skin
    except SetupError:
        raise
    except OptiSenseError:  # the start has no score either, and says why
        return LEAST_SKIN
    return max(LEAST_SKIN, LEAST_OF_START * seen)


def may_change_view(names: Iterable[str]) -> bool:
    """Return whether parameters with these names may change what the camera sees."""
    return any(not name.startswith(RAY_INDEPENDENT) for name in names)


def _way_in_words(way: frozenset[str]) -> str:
    names = [f"'{name}'" for name in sorted(way)]
    return "by " + " and ".join(names) if names else "directly"
