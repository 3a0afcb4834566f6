"""Fit of a design to photographs of a real sensor."""

from __future__ import annotations

from collections.abc import Sequence

from optisense.array_types import FloatArray
from optisense.calibration._body_changes import with_single_lights
from optisense.calibration._camera_families import notes_on_kinds
from optisense.calibration._cross_readings import realism_and_readings
from optisense.calibration._fit_rounds import FitRounds, Progress
from optisense.calibration._orientation import orientation_notes
from optisense.calibration.comparing import Comparison, usable
from optisense.calibration.families import LEDS
from optisense.calibration.model_pictures import model_pictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.quantities import designed, fits_all_powers, quantities_of
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.result import (
    Calibration,
    FittedNumber,
    correlated_pairs,
    fitted_numbers,
    with_known_total,
)
from optisense.calibration.seen_contacts import check_shape
from optisense.calibration.settings import CalibrationSettings
from optisense.design import Provenance, SensorDesign, Status, set_value
from optisense.errors import CalibrationError
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays

LEAST_PRESSES = 2
"""Smallest number of presses of a fit: one ball's response could be due to its place alone."""

FEW_PRESSES = 6
"""Recommended number of presses: a third of them are held out, and four are fitted."""

FEW_FITTED = 4
"""Number of fitted presses below which a note says that the fit rests on few: that of the
recommended number of presses."""


def calibrate(
    design: SensorDesign,
    photographs: Photographs,
    settings: CalibrationSettings | None = None,
    *,
    variant: str = "auto",
    kept: KeptArrays = NOTHING_KEPT,
    progress: Progress = lambda what, done, count: None,
) -> Calibration:
    """Fit a design to photographs of a real sensor.

    Args:
        design: design to start from.
        photographs: photographs of the sensor.
        settings: settings of the fit; the defaults if None.
        variant: variant of the renderer.
        kept: store of renderings: those of an interrupted run are reused, this one's are kept.
        progress: function that is called before each rendering and each step of the fit.

    Raises:
        CalibrationError: there are too few photographs, or they do not fit the design.
        OptiSenseError: the design can't be rendered, or a rendering can't be stored.
    """
    from optisense.optics import OpticalModel

    chosen_settings = settings or CalibrationSettings()
    if LEDS in chosen_settings.families:
        design = with_single_lights(design)
    full, seen, notes = usable(photographs, refine=chosen_settings.refine)
    chosen = quantities_of(design, chosen_settings.families, chosen_settings.asked)
    chosen_settings.check_held_out(photographs, full)
    held_out = chosen_settings.indices_held_out(full)
    notes += notes_on_kinds(design, chosen_settings.families)
    notes += _refuse_too_few(full, chosen, held_out)
    model = OpticalModel(design, variant)
    check_shape(full, model)
    fit = FitRounds(design, model, full, seen, chosen, chosen_settings, kept, progress)
    solution = fit.run()
    held = tuple(full.presses[index].name for index in fit.held_out)
    notes += fit.doubts(solution)
    fitted, exposure = _with_exposure(design, chosen, solution.steps, fit.exposure)
    solution = with_known_total(chosen, solution, fitted)
    numbers = fitted_numbers(chosen, solution, fitted)
    fitted = _marked(fitted, chosen, numbers, full)
    places = fit.places(fitted, exposure)
    comparisons = []
    for each, factor in ((design, None), (fitted, exposure)):
        fit.report_step("comparing")
        model.set_design(each)
        shown = model_pictures(
            model,
            full,
            places,
            photons=chosen_settings.photons,
            seed=chosen_settings.seed,
            exposure=factor,
            kept=kept,
        )
        figures = realism_and_readings(model, full, places, shown)
        comparisons.append(Comparison(full, tuple(places), shown, figures, ()))
    notes += orientation_notes(full, places, comparisons[0].pictures)
    return Calibration(
        design=fitted,
        exposure=exposure,
        numbers=numbers,
        alike=correlated_pairs(chosen, solution),
        before=comparisons[0],
        after=comparisons[1],
        held_out=held,
        notes=tuple(notes),
    )


def _refuse_too_few(
    photographs: Photographs, chosen: Sequence[FitQuantity], held_out: Sequence[int]
) -> list[str]:
    """Return notes on the number of photographs; raise CalibrationError if there are too few, or if
    no number is to be fitted.
    """
    count = len(photographs.presses) - len(held_out)
    if not chosen:
        raise CalibrationError(
            "there is no number to fit: all families are kept, or do not apply to this design",
            hint="Keep fewer families, or name further numbers to fit",
        )
    if count < LEAST_PRESSES:
        raise CalibrationError(
            f"{count} press{'' if count == 1 else 'es'} can't determine {len(chosen)} numbers",
            hint=f"Photograph at least {LEAST_PRESSES}, better {FEW_PRESSES}, at different places",
        )
    notes = []
    if not held_out:
        notes.append("no press is held out: the figures are those of the presses that were fitted")
    if count < FEW_FITTED:
        notes.append(
            f"the fit rests on {count} presses; {FEW_PRESSES} at different places determine the "
            "numbers better"
        )
    return notes


def _with_exposure(
    design: SensorDesign, chosen: Sequence[FitQuantity], steps: FloatArray, exposure: float
) -> tuple[SensorDesign, float]:
    """Return the fitted design and its exposure.

    Photographs do not distinguish powers and exposure. If all powers are fitted, they get the same
    total as before.
    """
    fitted = designed(design, chosen, steps)
    if not fits_all_powers(design, chosen):
        return fitted, exposure
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
    """Return the design with provenance of fitted numbers and fingerprints of the photographs."""
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
