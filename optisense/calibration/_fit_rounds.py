"""Rounds of rendering and fitting by which a design is fitted to photographs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from optisense.array_types import FloatArray
from optisense.calibration._covered_view import CoveredView
from optisense.calibration._gauss_newton import LayeredFit
from optisense.calibration._least_squares import Solution
from optisense.calibration._view_slopes import view_changes, with_view
from optisense.calibration.comparing import (
    FIT_WIDTH,
    moved_contact,
    placed,
    scaled_contact,
)
from optisense.calibration.families import EXPOSURE
from optisense.calibration.model_pictures import (
    LayeredPictures,
    PictureSlopes,
    averaged,
    layered_pictures,
    matched_exposure,
)
from optisense.calibration.photographs import Photographs
from optisense.calibration.quantities import designed, fits_all_powers
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.seen_contacts import SeenContact
from optisense.calibration.settings import CalibrationSettings
from optisense.design import SensorDesign
from optisense.kept_arrays import KeptArrays
from optisense.quality import MOST_SEED

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

DIFFERENCE = 0.5
"""Step to both sides of the difference quotients of numbers that need a rendering, in plausible
ranges; it is large because renderings have noise.
"""

VIEW_DIFFERENCE = 0.25
"""Step of the difference quotients of numbers of the view, in plausible ranges. Chief rays have no
noise, but the coverage of a pixel changes in steps of a sixteenth.
"""

VIEW_SOLVES, VIEW_MOVED = 3, 0.03
"""Largest number of fits to the layers of one rendering, and the change of the view, in plausible
ranges, at which they end. A fit to linear changes finds about half of a shift of several pixels."""

BLURS = 6.0, 3.0, 0.0
"""Standard deviations, pixels, by which pictures are blurred in the successive fits of a rough
round: details fit over displacements of about their size only."""

ROUGH_SHARE, ROUGH_PIXELS = 0.5, 36.0
"""Share of the rounds, the first one at least, that count one independent error for so many pixels
of each picture. Weights estimated from the errors of the start would neglect the background."""

AGAIN = 1000
"""Number added to a seed for a second rendering, with other noise; above the number of rounds."""

OUTLYING = 1.7
"""Ratio of a press's error to the median from which on it is named as an outlier."""

Progress = Callable[[str, int, int], None]
"""Function that is called with the current step, the number of finished pieces, and that of all."""


class FitRounds:
    """Rounds of a fit."""

    def __init__(
        self,
        design: SensorDesign,
        model: OpticalModel,
        photographs: Photographs,
        seen: list[SeenContact],
        chosen: list[FitQuantity],
        settings: CalibrationSettings,
        kept: KeptArrays,
        progress: Progress,
    ) -> None:
        self._design, self._model, self._settings = design, model, settings
        self._kept, self._progress = kept, progress
        extra = [] if fits_all_powers(design, chosen) else [EXPOSURE]
        self._chosen = [*chosen, *extra]
        self._small = photographs.scaled(FIT_WIDTH)
        factor = self._small.size[0] / photographs.size[0]
        self._factor = factor
        self._seen = [scaled_contact(place, factor) for place in seen]
        count = len(photographs.presses)
        self.held_out = settings.indices_held_out(photographs)
        self._used = [index for index in range(count) if index not in self.held_out]
        self._fitted = self._small.subset(self._used)
        self._rendering = [number for number, each in enumerate(self._chosen) if each.renders]
        self.exposure = 1.0
        self._done = 0
        self._bodily = [number for number in self._rendering if not chosen[number].views]
        self._count = 2 * settings.rounds + 3
        self._count += len(self._bodily) * max(settings.rounds - 1, 1)

    @property
    def _used_contacts(self) -> list[SeenContact]:
        """Contacts of the photographs that are fitted."""
        return [self._seen[index] for index in self._used]

    def report_step(self, what: str) -> None:
        """Report the progress by one piece."""
        self._progress(what, self._done, self._count)
        self._done += 1

    def run(self) -> Solution:
        """Run all rounds; the contacts of the fitted photographs move along.

        Each round takes new difference quotients, because pictures are not linear in the numbers of
        a sensor's body. The last of several rounds keeps these numbers and fits the others to their
        true pictures: powers and the camera's processing that suit a linear prediction do not suit
        these. Rounds with quotients, and those that are not rough, render everything twice, to know
        the noise of the light.
        The exposure is fitted along if the fitted powers do not determine it.
        """
        steps = np.zeros(len(self._chosen))
        solution: Solution | None = None
        slopes: dict[int, PictureSlopes] = {}
        changes: FloatArray = np.zeros(len(steps))
        for number in range(self._settings.rounds):
            rough = number < max(1, math.floor(ROUGH_SHARE * self._settings.rounds))
            self.report_step("rendering")
            layers, noise = self._layers(steps, number), None
            if number == 0:
                total = layers.background.sum(axis=0)
                self.exposure = matched_exposure(total, layers.chain, self._fitted.background)
            kept = self._bodily if 0 < number == self._settings.rounds - 1 else []
            if not kept:
                slopes = self._slopes(steps, number, layers)
            if not rough or slopes:
                again = self._layers(steps, number, layers, AGAIN)
                layers, noise = averaged(layers, again)
            self.report_step("fitting")
            found = self._solution(layers, steps, slopes, rough, noise, kept)
            before, changes = changes, found.steps - steps
            changes[kept] = before[kept]
            if number:
                found = found.with_changes(changes)
            solution, steps = found, found.steps
            for index, moved in zip(self._used, solution.contacts, strict=True):
                self._seen[index] = moved_contact(self._seen[index], moved)
        assert solution is not None
        if EXPOSURE in self._chosen:
            self.exposure *= EXPOSURE.value(float(solution.steps[-1]))
            return solution.without_last()
        return solution

    def _solution(
        self,
        layers: LayeredPictures,
        steps: FloatArray,
        slopes: dict[int, PictureSlopes],
        rough: bool,
        noise: LayeredPictures | None,
        kept: Sequence[int],
    ) -> Solution:
        """Fit to layers that were rendered at `steps` (n,), where the fit starts; whenever the view
        has moved, the layers are displaced to it and fitted again. Numbers whose indices are kept
        do not change.
        """
        seen, pixels = self._used_contacts, ROUGH_PIXELS if rough else None
        views = [number for number in self._rendering if self._chosen[number].views]
        contacts = np.zeros((len(seen), 3))
        if not views:
            fit = LayeredFit(
                self._fitted, seen, layers, self._chosen, self.exposure, steps, slopes, noise,
                kept, pixels,
            )  # fmt: skip
            return fit.solve(steps, contacts)
        rendered = self._view(steps)
        start, shown, view = steps.copy(), layers, rendered
        for blur in BLURS if rough else (0.0,) * VIEW_SOLVES:
            every = slopes | self._view_slopes(start, shown, view)
            fit = LayeredFit(
                self._fitted, seen, shown, self._chosen, self.exposure, start, every, noise, kept,
                pixels, blur,
            )  # fmt: skip
            found = fit.solve(steps, contacts)
            steps, contacts = found.steps, found.contacts
            moved = float(np.abs(steps[views] - start[views]).max())
            if moved < VIEW_MOVED and not blur:
                break
            start = start.copy()
            start[views] = steps[views]
            view = self._view(start)
            shown = with_view(layers, seen, rendered, view)
        return found

    def places(self, fitted: SensorDesign, exposure: float) -> list[SeenContact]:
        """Return the contact in each photograph by the fitted model, at the full size.

        Those that were held out are located here, with nothing else fitted.
        """
        if self.held_out:
            self.report_step("placing what was held out")
            small = self._small.subset(self.held_out)
            self._model.set_design(fitted)
            found = placed(
                self._model, small, [self._seen[index] for index in self.held_out],
                photons=self._settings.photons, seed=self._settings.seed, exposure=exposure,
                kept=self._kept,
            )  # fmt: skip
            for index, place in zip(self.held_out, found, strict=True):
                self._seen[index] = place
        return [scaled_contact(place, 1.0 / self._factor) for place in self._seen]

    def doubts(self, solution: Solution) -> list[str]:
        """Return notes on presses that the fit explains far worse than the others."""
        names = [self._small.presses[index].name for index in self._used]
        usual = float(np.median(solution.outlying))
        return [
            f"{name}: the fit explains it worse than the others, with an error of {error:.1f} "
            f"levels instead of {usual:.1f}; check its ball and whether it slipped"
            for name, error in zip(names, solution.outlying, strict=True)
            if error > OUTLYING * usual
        ]

    def _layers(
        self,
        steps: FloatArray,
        number: int,
        contacts: LayeredPictures | None = None,
        more: int = 0,
    ) -> LayeredPictures:
        """Return layers of a round, with light of its own noise, at the current steps (n,) of
        numbers that need a rendering; all others are those of the design. `more` is added to the
        seed.
        """
        self._set_design(steps)
        return layered_pictures(
            self._model, self._fitted, self._used_contacts, self._settings.photons_of(number),
            (self._settings.seed + number + more) % (MOST_SEED + 1),
            None if contacts is None else contacts.contacts, self._kept,
        )  # fmt: skip

    def _view_slopes(
        self, steps: FloatArray, layers: LayeredPictures, view: CoveredView
    ) -> dict[int, PictureSlopes]:
        """Return the slopes of the numbers of the view, by index, at layers with this view."""
        found: dict[int, PictureSlopes] = {}
        for number in self._rendering:
            if self._chosen[number].views:
                other = self._other(number, steps, VIEW_DIFFERENCE)
                size = np.float32(other[number] - steps[number])
                after = self._view(other)
                changes = view_changes(layers, self._used_contacts, view, after)
                found[number] = PictureSlopes(
                    [change / size for change in changes],
                    None if layers.coverage is None else (after.coverage - view.coverage) / size,
                )
        return found

    def _view(self, steps: FloatArray) -> CoveredView:
        self._set_design(steps)
        return CoveredView.of(self._model, self._small.size)

    def _set_design(self, steps: FloatArray) -> None:
        """Give the model the design with the steps (n,) of numbers that need a rendering."""
        moved = [self._chosen[number] for number in self._rendering]
        self._model.set_design(designed(self._design, moved, steps[self._rendering]))

    def _other(self, number: int, steps: FloatArray, by: float) -> FloatArray:
        """Return steps with one of them changed, downwards if the number is at its upper limit."""
        each = self._chosen[number]
        other = steps.copy()
        other[number] += by
        if each.value(float(other[number])) == each.value(float(steps[number])):
            other[number] -= 2.0 * by
        return other

    def _slopes(
        self, steps: FloatArray, number: int, layers: LayeredPictures
    ) -> dict[int, PictureSlopes]:
        """Return the slopes of the numbers that need a rendering, by index, from renderings on both
        sides of their current steps (n,). Contacts of the layers are pressed in again if a number
        does not move them.
        """
        found: dict[int, PictureSlopes] = {}
        for index in self._bodily:
            each = self._chosen[index]
            self.report_step(f"rendering another {each.words}")
            lowest, highest = each.limits()
            low = max(min(float(steps[index]) - DIFFERENCE, highest - 2.0 * DIFFERENCE), lowest)
            high = min(low + 2.0 * DIFFERENCE, highest)
            same = None if each.moves_contacts else layers
            size = np.float32(high - low)
            quotients = []
            for more in (0, AGAIN):
                ends = []
                for value in (low, high):
                    other = steps.copy()
                    other[index] = value
                    moved = self._layers(other, number, same, more)
                    ends.append(moved.pictures)
                quotients.append([(two - one) / size for one, two in zip(*ends, strict=True)])
            found[index] = PictureSlopes.of_two(*quotients)
        return found
