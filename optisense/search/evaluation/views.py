"""The share of the view at the start that the camera of each trial must keep."""

from __future__ import annotations

from collections.abc import Iterable

from optisense.design import SensorDesign
from optisense.design.camera_checks import LEAST_SKIN
from optisense.errors import OptiSenseError, SetupError
from optisense.objectives.evaluation import Evaluation
from optisense.search.evaluation.models import ModelKeeper

LEAST_OF_START = 0.5
"""Share of the sensing surface seen at the start that a trial must see. Scores grow as the camera
looks at less, so a search over the field of view ends where it sees as little as it may: a
GelSight360 that sees its tip only, 0.41 of what it should, is none, and cameras that see 0.56 of
the start or more by `benchmarks/single_parameters.py` are zooms that a person may want."""

VIEW_RAYS = (48, 36)
"""Width and height of the chief rays that tell by which mirrors the camera looks. Of GelSight
Svelte's, 500 arrive: shares are off by a column of the picture at most, 0.03, and a trial by AOAP
takes no longer by more than a twentieth."""

MOST_BY_OTHER_WAYS = 0.1
"""Share of the chief rays that may reach the sensing surface by other mirrors than in the design
that the search starts from, or by none. All rays of GelSight Svelte go by both of its mirrors; by
AOAP, designs of which 31 to 99 % go past them were the best of a camera that may turn, and a
strip of 6 % beside the edge of a mirror turned by a degree does no harm."""

SIGHTLESS = ("lights.", "coating.")
"""Sections of a design that no chief ray depends on."""


class SameMirrors:
    """The camera must see the sensing surface by the same mirrors as in the first design.

    A mirror that the camera looks past is a part that nobody would build.
    """

    def __init__(self, design: SensorDesign, keeper: ModelKeeper) -> None:
        """Nothing is traced yet.

        Args:
            design: that the search starts from.
            keeper: of the optical model.
        """
        self._design = design
        self._keeper = keeper
        self._ways: frozenset[frozenset[str]] | None = None

    def __call__(self, design: SensorDesign) -> str | None:
        """How much the camera sees past the mirrors, where that is too much; else None."""
        if self._ways is None:
            self._ways = frozenset(self._seen(self._design))
        seen = self._seen(design)
        other = {way: share for way, share in seen.items() if way not in self._ways}
        if not self._ways or sum(other.values()) <= MOST_BY_OTHER_WAYS:
            return None
        now = _told(max(other, key=lambda way: other[way]))
        before = " or ".join(sorted(_told(way) for way in self._ways))
        return (
            f"{100 * sum(other.values()):.0f} % of the rays that reach the sensing surface do not "
            "go by the mirrors that they go by in the design that the search starts from: "
            f"{now} instead of {before}"
        )

    def _seen(self, design: SensorDesign) -> dict[frozenset[str], float]:
        return self._keeper.model(design).views_by_mirrors(VIEW_RAYS)


def least_skin(design: SensorDesign, keeper: ModelKeeper) -> float:
    """The share of the sensing surface that trials must see, where no setting says otherwise.

    Args:
        design: that the search starts from.
        keeper: of the optical model.

    Raises:
        SetupError: the renderer can't run on this machine.
    """
    try:
        seen = Evaluation(keeper.model(design)).view.skin
    except SetupError:
        raise
    except OptiSenseError:  # the start has no score either, and says why
        return LEAST_SKIN
    return max(LEAST_SKIN, LEAST_OF_START * seen)


def may_change_view(names: Iterable[str]) -> bool:
    """Whether what parameters of these names change can change what the camera sees."""
    return any(not name.startswith(SIGHTLESS) for name in names)


def _told(way: frozenset[str]) -> str:
    names = [f"'{name}'" for name in sorted(way)]
    return "by " + " and ".join(names) if names else "straight"
