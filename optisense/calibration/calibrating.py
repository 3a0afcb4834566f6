"""Fit a design to photographs of a real sensor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.calibration.comparing import Comparison, usable
from optisense.calibration.families import USUAL
from optisense.calibration.gauss_newton import LayeredFit, Solution
from optisense.calibration.kept_renderings import KEPT_NOWHERE, KeptRenderings
from optisense.calibration.layered_pictures import LayeredPictures, layered_pictures
from optisense.calibration.model_pictures import matched_exposure, model_pictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.quantities import designed, quantities_of
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.reading_both_ways import realism_and_readings
from optisense.calibration.realism import Realism
from optisense.calibration.seen_contacts import SeenContact, check_shape
from optisense.design import Provenance, SensorDesign, Status, set_value
from optisense.errors import CalibrationError
from optisense.near import suggestion

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

FloatArray = NDArray[np.float64]

FIT_WIDTH = 160
"""Pixels across the pictures of the fit: a quarter of the pixels of those that are compared in the
end, and enough for the smooth responses of balls."""

FIT_PHOTONS = 300_000
"""Photons of the light of the fit; its noise is a few per cent and smooth, and the same in all
rounds."""

ROUNDS = 3
"""Rounds of rendering and fitting, by default; contacts move by less than half a pixel in a third
round."""

LEAST_PRESSES = 2
"""Presses that a fit needs at least; one ball alone could be explained by its place."""

FEW_PRESSES = 6
"""Presses that are recommended, a third of which are held out."""

FEW_FITTED = 4
"""Presses that are fitted below which a fit is told to rest on few."""

HELD_OUT = 3
"""Every third press is held out and only judged, where there are at least as many."""

DIFFERENCE = 0.35
"""Plausible ranges by which numbers that need a rendering are moved for their difference quotients;
large, as renderings have noise."""

UNDETERMINED = 0.7
"""Uncertainty over the plausible range from which on photographs are said not to determine a
number."""

TOLD_APART = 0.85
"""Correlation of two numbers from which on photographs can't tell them apart."""

OUTLYING = 1.7
"""Error of a press, over the median, from which on it is named as an outlier."""


@dataclass(frozen=True)
class CalibrationSettings:
    """Settings of a calibration.

    Attributes:
        families: what may change, of `families.FAMILIES`.
        asked: path, least and largest value of further numbers of the design.
        rounds: of rendering and fitting.
        photons: of the light of the fit; that of the comparison has as many or more.
        seed: of the light.
        refine: whether labelled contacts are looked for near their labels first.
        held_out: names of the presses that are held out; every third one if None.
    """

    families: tuple[str, ...] = USUAL
    asked: tuple[tuple[str, float, float], ...] = ()
    rounds: int = ROUNDS
    photons: int = FIT_PHOTONS
    seed: int = 0
    refine: bool = True
    held_out: tuple[str, ...] | None = None


@dataclass(frozen=True)
class FittedNumber:
    """A number of the design that was fitted.

    Attributes:
        path, words, unit: as of the quantity.
        before, after: its values.
        uncertainty: standard deviation of the value.
        determined: whether the photographs say more of it than its plausible range did.
    """

    path: str
    words: str
    unit: str
    before: float
    after: float
    uncertainty: float
    determined: bool


@dataclass(frozen=True)
class Calibration:
    """A design that was fitted to photographs.

    Attributes:
        design: the fitted one.
        exposure: at which its pictures are as bright as the photographs.
        numbers: what was fitted.
        alike: pairs of them, in words, that the photographs can't tell apart, and their
            correlation.
        before, after: the design as it was and as it is, beside all photographs.
        held_out: names of the presses that the fit did not see.
        notes: what is doubtful, one sentence each.
    """

    design: SensorDesign
    exposure: float
    numbers: tuple[FittedNumber, ...]
    alike: tuple[tuple[str, str, float], ...]
    before: Comparison = field(repr=False)
    after: Comparison = field(repr=False)
    held_out: tuple[str, ...]
    notes: tuple[str, ...]

    def of_presses(self, found: Realism, *, held_out: bool) -> Realism:
        """The figures of the presses that were held out, or of those that were not."""
        presses = [p for p in found.presses if (p.name in self.held_out) == held_out]
        readings = [r for r in found.readings if (r.name in self.held_out) == held_out]
        return replace(found, presses=tuple(presses), readings=tuple(readings))

    def as_data(self) -> dict[str, Any]:
        """All numbers and figures, ready for JSON."""
        return {
            "exposure": self.exposure,
            "numbers": [asdict(each) for each in self.numbers],
            "not_told_apart": [list(pair) for pair in self.alike],
            "held_out": list(self.held_out),
            "notes": list(self.notes),
            "photographs": {
                "background": self.after.photographs.fingerprint,
                **{press.name: press.fingerprint for press in self.after.photographs.presses},
            },
            "before": self.before.realism.as_data(),
            "after": self.after.realism.as_data(),
        }


Progress = Callable[[str, int, int], None]
"""Called with what is done, how many pieces of the whole are done, and of how many."""


def calibrate(
    design: SensorDesign,
    photographs: Photographs,
    settings: CalibrationSettings | None = None,
    *,
    variant: str = "auto",
    kept: KeptRenderings = KEPT_NOWHERE,
    progress: Progress = lambda what, done, count: None,
) -> Calibration:
    """Fit a design to photographs of a real sensor.

    Args:
        design: to start from.
        photographs: of the sensor.
        settings: what may change, and how; the usual ones if None.
        variant: of the renderer.
        kept: renderings of an earlier run that ended before it was done, which need not be made
            again, and where those of this one are kept.
        progress: called before each rendering and each step of the fit.

    Raises:
        CalibrationError: there are too few photographs, or they do not fit the design.
        OptiSenseError: the design can't be rendered, or a rendering not be kept.
    """
    from optisense.optics import OpticalModel

    chosen_settings = settings or CalibrationSettings()
    full, seen, notes = usable(photographs, refine=chosen_settings.refine)
    chosen = quantities_of(design, chosen_settings.families, chosen_settings.asked)
    held_out = _held_out(full, chosen_settings.held_out)
    notes += _refuse_too_few(full, chosen, held_out)
    model = OpticalModel(design, variant)
    check_shape(full, model)
    fit = _Fit(design, model, full, seen, chosen, chosen_settings, kept, progress)
    solution = fit.run()
    held = tuple(full.presses[index].name for index in fit.held_out)
    notes += fit.doubts(solution)
    fitted, exposure = _with_exposure(design, chosen, solution.steps, fit.exposure)
    numbers = _numbers(chosen, solution, fitted)
    fitted = _marked(fitted, chosen, numbers, full)
    places = fit.places(fitted, exposure)
    comparisons = []
    for each, factor in ((design, None), (fitted, exposure)):
        fit.told("comparing")
        model.set_design(each)
        photons = max(chosen_settings.photons, FIT_PHOTONS)
        shown = model_pictures(
            model,
            full,
            places,
            photons=photons,
            seed=chosen_settings.seed,
            exposure=factor,
            kept=kept,
        )
        figures = realism_and_readings(model, full, places, shown)
        comparisons.append(Comparison(full, tuple(places), shown, figures, ()))
    return Calibration(
        design=fitted,
        exposure=exposure,
        numbers=numbers,
        alike=_alike(chosen, solution),
        before=comparisons[0],
        after=comparisons[1],
        held_out=held,
        notes=tuple(notes),
    )


class _Fit:
    """The rounds of a fit."""

    def __init__(
        self,
        design: SensorDesign,
        model: OpticalModel,
        photographs: Photographs,
        seen: list[SeenContact],
        chosen: list[FitQuantity],
        settings: CalibrationSettings,
        kept: KeptRenderings,
        progress: Progress,
    ) -> None:
        self._design, self._model, self._settings = design, model, settings
        self._chosen, self._kept, self._progress = chosen, kept, progress
        self._small = photographs.scaled(FIT_WIDTH)
        factor = self._small.size[0] / photographs.size[0]
        self._factor = factor
        self._seen = [_scaled(place, factor) for place in seen]
        count = len(photographs.presses)
        self.held_out = _held_out(photographs, settings.held_out)
        self._used = [index for index in range(count) if index not in self.held_out]
        self._rendering = [number for number, each in enumerate(chosen) if each.renders]
        self.exposure = 1.0
        self._done = 0
        self._count = 2 * settings.rounds + len(self._rendering) + 3

    def told(self, what: str) -> None:
        """Tell the progress, one piece on."""
        self._progress(what, self._done, self._count)
        self._done += 1

    def run(self) -> Solution:
        """All rounds; the contacts of the photographs that are fitted move along.

        Difference quotients by numbers that need a rendering are taken in the first round only;
        later rounds start from new renderings, and what they correct is small.
        """
        steps = np.zeros(len(self._chosen))
        small = self._small.subset(self._used)
        solution: Solution | None = None
        slopes: dict[int, list[NDArray[np.float32]]] = {}
        for number in range(self._settings.rounds):
            seen = [self._seen[index] for index in self._used]
            self.told("rendering")
            layers = self._layers(small, seen, steps)
            if number == 0:
                total = layers.background.sum(axis=0)
                self.exposure = matched_exposure(total, layers.chain, small.background)
                slopes = self._slopes(small, seen, steps, layers)
            self.told("fitting")
            fit = LayeredFit(small, seen, layers, self._chosen, self.exposure, steps, slopes)
            solution = fit.solve(steps, np.zeros((len(seen), 3)))
            steps = solution.steps
            for index, moved in zip(self._used, solution.contacts, strict=True):
                self._seen[index] = _moved(self._seen[index], moved)
        assert solution is not None
        return solution

    def places(self, fitted: SensorDesign, exposure: float) -> list[SeenContact]:
        """Where each photograph shows its contact by the fitted model, at the full size.

        Those that were held out are placed here, with nothing else fitted.
        """
        if self.held_out:
            self.told("placing what was held out")
            small = self._small.subset(self.held_out)
            self._model.set_design(fitted)
            for _ in range(2):
                seen = [self._seen[index] for index in self.held_out]
                layers = layered_pictures(
                    self._model, small, seen, self._settings.photons, self._settings.seed,
                    kept=self._kept,
                )  # fmt: skip
                none: FloatArray = np.zeros(0)
                fit = LayeredFit(small, seen, layers, [], exposure, none, {})
                found = fit.solve(none, np.zeros((len(seen), 3)))
                for index, moved in zip(self.held_out, found.contacts, strict=True):
                    self._seen[index] = _moved(self._seen[index], moved)
        return [_scaled(place, 1.0 / self._factor) for place in self._seen]

    def doubts(self, solution: Solution) -> list[str]:
        """Presses that the fit explains far worse than the others."""
        names = [self._small.presses[index].name for index in self._used]
        usual = float(np.median(solution.outlying))
        return [
            f"{name}: it is explained worse than the others, by {error:.1f} levels where they have "
            f"{usual:.1f}; check its ball and whether it slipped"
            for name, error in zip(names, solution.outlying, strict=True)
            if error > OUTLYING * usual
        ]

    def _layers(
        self,
        small: Photographs,
        seen: Sequence[SeenContact],
        steps: FloatArray,
        contacts: LayeredPictures | None = None,
    ) -> LayeredPictures:
        """Layers at the values of what needs a rendering; all else is as the design has it."""
        moved = [self._chosen[number] for number in self._rendering]
        self._model.set_design(designed(self._design, moved, steps[self._rendering]))
        return layered_pictures(
            self._model, small, seen, self._settings.photons, self._settings.seed,
            None if contacts is None else contacts.contacts, self._kept,
        )  # fmt: skip

    def _slopes(
        self,
        small: Photographs,
        seen: Sequence[SeenContact],
        steps: FloatArray,
        layers: LayeredPictures,
    ) -> dict[int, list[NDArray[np.float32]]]:
        found: dict[int, list[NDArray[np.float32]]] = {}
        for number in self._rendering:
            each = self._chosen[number]
            self.told(f"rendering another {each.words}")
            other = steps.copy()
            other[number] += DIFFERENCE
            if each.value(float(other[number])) == each.value(float(steps[number])):
                other[number] -= 2.0 * DIFFERENCE
            size = float(other[number] - steps[number])
            same = None if each.moves_contacts else layers
            moved = self._layers(small, seen, other, same)
            pairs = zip(
                [moved.background, *moved.presses], [layers.background, *layers.presses],
                strict=True,
            )  # fmt: skip
            found[number] = [((one - two) / size).astype(np.float32) for one, two in pairs]
        return found


def _held_out(photographs: Photographs, asked: Sequence[str] | None) -> list[int]:
    """Indices of the presses that are held out.

    Raises:
        CalibrationError: there is no press of a name.
    """
    names = [press.name for press in photographs.presses]
    if asked is None:
        return list(range(HELD_OUT - 1, len(names), HELD_OUT))
    for name in asked:
        if name not in names:
            raise CalibrationError(
                f"there is no press '{name}' to hold out",
                hint=suggestion(name, names),
            )
    return [index for index, name in enumerate(names) if name in asked]


def _refuse_too_few(
    photographs: Photographs, chosen: Sequence[FitQuantity], held_out: Sequence[int]
) -> list[str]:
    """What is to be said of the number of photographs.

    Raises:
        CalibrationError: there are too few, or nothing is to be fitted.
    """
    count = len(photographs.presses) - len(held_out)
    if not chosen:
        raise CalibrationError("nothing may change", hint="Keep less as it is")
    if count < LEAST_PRESSES:
        raise CalibrationError(
            f"{count} press{'' if count == 1 else 'es'} can't tell {len(chosen)} numbers",
            hint=f"Photograph at least {LEAST_PRESSES}, better {FEW_PRESSES}, at different places",
        )
    notes = []
    if not held_out:
        notes.append("no press is held out: the figures are those of the presses that were fitted")
    if count < FEW_FITTED:
        notes.append(
            f"the fit rests on {count} presses; {FEW_PRESSES} at different places tell more"
        )
    return notes


def _with_exposure(
    design: SensorDesign, chosen: Sequence[FitQuantity], steps: FloatArray, exposure: float
) -> tuple[SensorDesign, float]:
    """The fitted design whose lights have as much power together as before, and its exposure.

    Photographs do not tell powers and exposure apart.
    """
    fitted = designed(design, chosen, steps)
    before = sum(group.flux * len(group.lights) for group in design.lights.values())
    after = sum(group.flux * len(group.lights) for group in fitted.lights.values())
    factor = before / after if after > 0.0 else 1.0
    if abs(factor - 1.0) > 1e-12:
        for name, group in fitted.lights.items():
            fitted = set_value(fitted, f"lights.{name}.flux", group.flux * factor)
    return fitted, exposure / factor


def _marked(
    fitted: SensorDesign,
    chosen: Sequence[FitQuantity],
    numbers: Sequence[FittedNumber],
    photographs: Photographs,
) -> SensorDesign:
    """The design whose fitted numbers say so, with the fingerprints of the photographs."""
    prints = ", ".join(
        each[:12]
        for each in (photographs.fingerprint, *(p.fingerprint for p in photographs.presses))
    )
    known = dict(fitted.provenance)
    texts: dict[str, list[str]] = {}
    for quantity, each in zip(chosen, numbers, strict=True):
        said = f"{each.words} {each.after:.4g} ± {each.uncertainty:.2g} {each.unit}".strip()
        texts.setdefault(quantity.home or each.path, []).append(said)
    for path, words in texts.items():
        known[path] = Provenance(
            status=Status.CALIBRATED,
            source=f"fitted to {len(photographs.presses)} photographed presses and a background: "
            + "; ".join(words)
            + f". SHA-256 of the photographs begin with {prints}",
        )
    return fitted.model_copy(update={"provenance": known})


def _numbers(
    chosen: Sequence[FitQuantity], solution: Solution, fitted: SensorDesign
) -> tuple[FittedNumber, ...]:
    deviations = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
    found = []
    for each, step, deviation in zip(chosen, solution.steps, deviations, strict=True):
        value = each.value(float(step))
        error = abs(each.slope(float(step))) * float(deviation)
        if each.path.startswith("lights.") and each.path.endswith(".flux"):
            group = each.path.split(".")[1]
            scale = fitted.lights[group].flux / value
            value, error = value * scale, error * scale
        found.append(
            FittedNumber(
                each.path, each.words, each.unit, each.start, value, error,
                bool(deviation < UNDETERMINED),
            )
        )  # fmt: skip
    return tuple(found)


def _alike(chosen: Sequence[FitQuantity], solution: Solution) -> tuple[tuple[str, str, float], ...]:
    deviations = np.sqrt(np.maximum(np.diag(solution.covariance), 1e-300))
    correlation = solution.covariance / np.outer(deviations, deviations)
    found = []
    for one in range(len(chosen)):
        for other in range(one):
            value = float(correlation[one, other])
            if abs(value) > TOLD_APART:
                found.append((chosen[other].words, chosen[one].words, round(value, 3)))
    return tuple(sorted(found, key=lambda pair: -abs(pair[2])))


def _scaled(place: SeenContact, factor: float) -> SeenContact:
    column, row = place.centre
    return SeenContact((column * factor, row * factor), place.radius * factor)


def _moved(place: SeenContact, amount: FloatArray) -> SeenContact:
    column, row, wider = (float(value) for value in amount)
    grown = place.radius * math.exp(min(max(wider, -0.5), 0.5))
    return SeenContact((place.centre[0] + column, place.centre[1] + row), grown)
