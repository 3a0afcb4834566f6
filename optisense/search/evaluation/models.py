"""Optical models that are kept between trials, and the share of the view that trials must keep.

There is one model per process, which is changed as little as possible. The image of a design does
not depend on the designs that a model had before, so a study gives the same scores when it is
resumed or shared among workers.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING

from optisense.design import SensorDesign
from optisense.design.camera_checks import LEAST_SKIN
from optisense.errors import OptiSenseError, SetupError
from optisense.objectives.evaluation import Evaluation
from optisense.search.space.pickling import PickledWithoutCaches

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

LEAST_OF_START = 0.5
"""Share of the sensing surface seen at the start that a trial must see, since scores grow as the
camera looks at less of it. A GelSight360 that sees only its tip, 0.41 of the start, is useless, and
cameras that see 0.56 or more (`benchmarks/single_parameters.py`) are useful zooms."""

VIEW_RAYS = 48
"""Number of columns of the grid of chief rays that shows by which mirrors the camera sees the skin.
Shares are off by at most one column, 0.03, and a trial by AOAP takes at most a twentieth longer."""

MOST_BY_OTHER_MIRRORS = 0.1
"""Share of the chief rays that may reach the sensing surface by other mirrors than in the design
that the search starts from, or by none. Searches for AOAP by a camera that may turn ended at 0.31
to 0.99; a strip of 0.06 beside the edge of a mirror turned by a degree does no harm."""

RAY_INDEPENDENT = ("lights.", "coating.")
"""Prefixes of the names of parameters on which no chief ray depends."""


class ModelCache(PickledWithoutCaches):
    """Cache of one optical model, for designs that are variations of one design."""

    def __init__(self, variant: str = "auto", *, coarse: bool = False) -> None:
        """Store the variant, and whether images are coarse; the model is built on first use."""
        self.variant = variant
        self.coarse = coarse

    def model(self, design: SensorDesign) -> OpticalModel:
        """Return the model of a design, or OptiSenseError if it can't be built. It replaces the
        model returned before, which must no longer be used.
        """
        if self._model is None:
            from optisense.optics import CoarseModel, OpticalModel

            kind = CoarseModel if self.coarse else OpticalModel
            self._model = kind(design, variant=self.variant)
        else:
            self._model.set_design(design)
        return self._model

    @cached_property
    def _model(self) -> OpticalModel | None:
        """Model that was built last; None before the first one."""
        return None


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
    """Return the share of the sensing surface that trials must see if no setting says otherwise,
    for the design that the search starts from.
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
