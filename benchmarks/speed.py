"""Times of images of the case, their accuracy, and the shares of their parts."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

from benchmarks.case import (
    CONTACT_TEXT,
    DESIGN,
    PHOTONS,
    RESOLUTION,
    Case,
    ball,
    relative_error,
)
from benchmarks.rays import photon_rates
from benchmarks.reference import Reference
from benchmarks.timing import Time, medians, run_child, timed
from optisense.mechanics import CONFORMING
from optisense.optics import OpticalModel, TactileImage

RUNS = 7
"""Number of timed images, whose median is reported."""
LARGE = (640, 480)
"""Width and height (pixels) of large images, twice those of `RESOLUTION`."""
MANY_PHOTONS = 5_000_000
"""Number of photons of scores and datasets by default (`optisense.quality.SCORE_PHOTONS`)."""
OTHER_PLACES = [(2.0, 1.0), (-3.0, 2.0), (1.0, -3.0), (-4.0, -2.0), (4.0, 3.0)]
"""Surface coordinates (mm) of other contacts, spread over the view."""
COMMAND = ["-m", "optisense.cli", "render", DESIGN, "--contact", CONTACT_TEXT, "--out"]


def measure_speed(case: Case, reference: Reference, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return all rows of the speed table, as plain data for JSON."""
    tell("speed: set-up")
    model = OpticalModel(case.model.design)  # compiles what a first model compiles
    _render(model, 0)
    setup = timed(lambda: _fresh_model(case))
    tell("speed: warm images")
    warm = warm_images(case, reference)
    finer = warm_images(case, reference, MANY_PHOTONS)
    large = _new_light(case, LARGE, RUNS - 2)
    tell("speed: other contacts, other flux, other specularity")
    kept = _kept_light(case)
    changed = _changes(case)
    tell("speed: rays")
    rates = photon_rates(case)
    tell("speed: new processes")
    cold = _cold()
    return {
        "image_320x240": warm,
        "image_320x240_many": finer,
        "image_640x480": large,
        "model_set_up": _plain(setup),
        **kept,
        **changed,
        **cold,
        "rays": rates,
    }


def _plain(time: Time) -> dict[str, float]:
    return {"wall_s": round(time.wall, 4), "cpu_s": round(time.cpu, 4)}


def _render(
    model: OpticalModel,
    seed: int,
    place: tuple[float, float] = (0.0, 0.0),
    resolution: tuple[int, int] = RESOLUTION,
) -> TactileImage:
    return model.render(
        [ball(*place)], resolution=resolution, seed=seed, photons=PHOTONS, skin=CONFORMING
    )


def _fresh_model(case: Case) -> None:
    """Build a model with its scene and its emission guide."""
    OpticalModel(case.model.design).guide()


def warm_images(case: Case, reference: Reference, photons: int = PHOTONS) -> dict[str, Any]:
    """Return times and errors of images of the case, each with another seed."""
    case.model.render([ball()], resolution=RESOLUTION, seed=99, photons=photons, skin=CONFORMING)
    times, errors, parts, ratios, image = [], [], [], [], None
    for seed in range(RUNS):
        images: list[Any] = []
        times.append(
            timed(
                lambda seed=seed, images=images: images.append(  # type: ignore[misc]
                    case.model.render(
                        [ball()], resolution=RESOLUTION, seed=seed, photons=photons, skin=CONFORMING
                    )
                )
            )
        )
        image = images[0]
        truth, mask = reference.radiance, case.mask
        errors.append(relative_error(image.radiance, truth, mask, reference.noise))
        ratios.append(float(image.radiance[mask].mean() / truth[mask].mean()))
        parts.append(image.settings["seconds"])
    assert image is not None
    light = median(part["light"] for part in parts)
    return {
        **_plain(medians(times)),
        "relative_rms_error": round(median(errors), 5),
        "mean_over_reference": round(median(ratios), 5),
        "photons": image.settings["photons"],
        "noise_told_percent": image.settings["noise_reached_percent"],
        "breakdown_s": {
            name: round(median(part[name] for part in parts), 4)
            for name in ("scene", "light", "image")
        },
        "photons_per_s_with_field": round(image.settings["photons"] / light),
    }


def _new_light(case: Case, resolution: tuple[int, int], runs: int) -> dict[str, Any]:
    _render(case.model, 99, resolution=resolution)
    times = [
        timed(partial(_render, case.model, seed, resolution=resolution)) for seed in range(runs)
    ]
    return _plain(medians(times))


def _kept_light(case: Case) -> dict[str, Any]:
    """Time images of other contacts, with a kept radiance cache and with new photons.

    The ratio of the latter to an image of the first contact is the cost of a change of contact.
    """
    first = [
        timed(partial(_render, case.model, 200 + number)) for number in range(len(OTHER_PLACES))
    ]
    other = [
        timed(partial(_render, case.model, 300 + number, place))
        for number, place in enumerate(OTHER_PLACES)
    ]
    _render(case.model, 99)
    kept = [timed(partial(_render, case.model, 99, place)) for place in OTHER_PLACES]
    one, two, three = medians(first), medians(other), medians(kept)
    return {
        "other_contact_new_light": {**_plain(two), "ratio_to_first": round(two.wall / one.wall, 3)},
        "other_contact_kept_light": {
            **_plain(three),
            "ratio_to_first": round(three.wall / one.wall, 3),
        },
    }


def _changes(case: Case) -> dict[str, Any]:
    """Time images after changes of flux and of specularity, on a separate model."""
    model = OpticalModel(case.model.design)

    def render() -> None:
        _render(model, 99)

    def change(path: str, value: float) -> None:
        model.update(path, value)
        render()

    render()
    flux = [timed(lambda v=v: change("lights.red.flux", v)) for v in (8.0, 12.0, 9.0, 11.0, 7.0)]  # type: ignore[misc]
    first = timed(lambda: change("coating.specularity", 0.2))
    later = [timed(lambda v=v: change("coating.specularity", v)) for v in (0.3, 0.4, 0.25)]  # type: ignore[misc]
    return {
        "after_flux_change": _plain(medians(flux)),
        "after_first_specularity": _plain(first),
        "after_specularity_change": _plain(medians(later)),
    }


def _cold(runs: int = 3) -> dict[str, Any]:
    """Time the command from its start to its files; a first run caches kernels on disk."""
    times, memory = [], []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(runs + 1):
            time, peak = run_child([sys.executable, *COMMAND, f"{folder}/{number}"])
            if number:
                times.append(time)
            memory.append(peak)
    return {
        "new_process": {**_plain(medians(times)), "peak_memory_gb": round(max(memory) / 1e9, 3)}
    }
