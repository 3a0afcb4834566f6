"""Small pictures of the trials of a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError, SetupError
from optisense.objectives import Settings
from optisense.report._balls import nine_balls
from optisense.report._study_figures import spread_out
from optisense.search.evaluation.outcome import rank_of
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

ACROSS = 240
"""Width of a picture in pixels: it is shown at most 390 pixels wide, beside the trial's numbers."""

PHOTONS = 200_000
"""Number of photons of a picture: its noise, some 4 %, is hardly visible at this size."""

MOST_PICTURES = 500
"""Largest number of pictures that are kept, of 130 KB each; the oldest is dropped first."""


class TrialPictures:
    """Renderer of trials with the nine balls that objectives press in; a trial whose picture is
    still kept is not rendered again.
    """

    def __init__(self, study: Study) -> None:
        """Store the settings; nothing is rendered yet."""
        taken = ("radius", "depth", "skin")
        given = study.settings.settings
        self._settings = Settings(**{key: given[key] for key in taken if key in given})
        self._model: OpticalModel | None = None
        self._found: dict[int, NDArray[np.uint8] | None] = {}

    def of(self, trial: Trial) -> NDArray[np.uint8] | None:
        """Return the picture (h, w, 3) of a trial, or None if its design can't be rendered.

        Raises:
            SetupError: the renderer can't run on this machine.
        """
        if trial.number not in self._found:
            try:
                self._found[trial.number] = self._rendered(trial)
            except SetupError:
                raise
            except OptiSenseError:
                self._found[trial.number] = self._model = None
            while len(self._found) > MOST_PICTURES:
                del self._found[next(iter(self._found))]
        return self._found[trial.number]

    def _rendered(self, trial: Trial) -> NDArray[np.uint8]:
        from optisense.optics import OpticalModel

        design = trial.design
        if self._model is None:
            self._model = OpticalModel(design)
        else:
            self._model.set_design(design)
        image, _ = nine_balls(self._model, self._settings, ACROSS, PHOTONS)
        return image.picture()


def select_for_pictures(study: Study, trials: Sequence[Trial], count: int) -> list[Trial]:
    """Return the trials that a reader is most likely to look at: some along the front of several
    objectives, and the best ones by the first.

    Args:
        count: largest number of trials.
    """
    names = study.settings.names
    fine = [trial for trial in trials if np.isfinite(trial.score)]
    front = spread_out(study.front, names[0], count) if len(names) > 1 else []
    best = sorted(fine, key=lambda trial: rank_of(trial.outcome, names[0]), reverse=True)
    return list({trial.number: trial for trial in (*front, *best)}.values())[:count]
