"""Fits to photographs of simulated sensors with hidden numbers, on four sensors.

``python -m benchmarks.calibration [--only NAME] [--dry]`` writes calibration.json and
calibration.md beside this file. The photographs have noise, dust and blur, and photons of another
seed than the fit. All numbers that `optisense calibrate` fits by default are hidden. Parts whose
name begins with ``many-`` fit many sets of hidden numbers, which need no rendering, to the layers
of one sensor, and count how many are found within their uncertainty.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

import optisense as ots
from benchmarks.results import measure_parts, page_head
from optisense.calibration import PhotographedPress, Photographs, calibrate, photograph_model
from optisense.calibration._fit_rounds import AGAIN
from optisense.calibration._gauss_newton import LayeredFit
from optisense.calibration.families import USUAL
from optisense.calibration.model_pictures import (
    LayeredPictures,
    averaged,
    layered_pictures,
    levels_of,
    matched_exposure,
)
from optisense.calibration.quantities import chain_with, designed, power_factors, quantities_of
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.result import with_known_total
from optisense.calibration.seen_contacts import SeenContact, place_on_skin
from optisense.design import SensorDesign
from optisense.geometry import Contact
from optisense.quality import FIT_PHOTONS

NAMES = ("gelsight-mini-ideal", "gelbelt", "gelsight360", "gelsight-svelte")
MANY = ("gelsight-mini-ideal", "gelsight-svelte")
"""Sensors whose layers are fitted to many sets of hidden numbers."""
WITHOUT_RENDERING = ("powers", "colours", "tone", "black", "shading")
"""Families of numbers that are hidden in these sets."""
SETS = 10
"""Number of sets of hidden numbers: of 10 times some 16 numbers, a share of 0.95 has a statistical
uncertainty of 0.02."""
FITTED = (0, 1, 3, 4)
"""Indices of the presses that are fitted to them, those that a fit does not hold out."""
SEED = 21
"""Seed of the hidden numbers, the noise and the dust."""
HIDDEN = 1.0
"""Largest distance of a hidden number from its start, in plausible ranges."""
RANGE = 4.0
"""Length of the range of a number, in plausible ranges: two to each side of the start. Errors are
given as shares of it."""
SIZE = (160, 120)
"""Size (pixels) of the photographs, that of the fit."""
FINER = 3
"""Number of pixels whose mean is one of the photographs along each axis, as in photographs that are
larger than the fit."""
PLACES = ((0.3, 0.35), (0.7, 0.35), (0.5, 0.5), (0.3, 0.65), (0.7, 0.65), (0.5, 0.3))
"""Places of the presses, as shares of width and height of what the camera sees of the skin."""
RADIUS, DEPTH = 3.0, 0.8
"""Radius and depth (mm) of the ball."""
PHOTONS = 10_000_000
"""Number of photons of the photographs, whose noise is then below that of a fit with 3 million;
real photographs have no such noise."""
NOISE, BLUR = 1.0, 0.4
"""Standard deviation of the noise (levels) and of the blur (pixels): those of photographs of 320
pixels with 2 levels and 0.8 pixels that are averaged to 160."""
DUST, DUST_LEVELS = 4, 40.0
"""Number of grains on the lens in all photographs, and of others in each; largest change of the
levels by one."""
LABELS_OFF = 1.0, 0.1
"""Largest errors of the labels: of a contact's middle (pixels, in each direction) and of its radius
(share), as of labels by hand."""


def main() -> None:
    """Run the benchmark, print its results and write them."""
    parts = {name: partial(measure, name) for name in NAMES}
    parts |= {f"many-{name}": partial(measure_many, name) for name in MANY}
    measure_parts("calibration", __doc__, parts, table)


def measure(name: str) -> dict[str, Any]:
    """Return the fitted numbers of a sensor and the hidden ones."""
    design = ots.load(name)
    chosen = quantities_of(design, USUAL)
    steps = hidden_steps(chosen)
    real = designed(design, chosen, steps)
    photographs = photographed(real)
    start = time.process_time()
    found = calibrate(design, photographs)
    used = time.process_time() - start
    scale = total_power(design) / total_power(real)  # photographs do not determine it
    rows = []
    for each, step, number in zip(chosen, steps, found.numbers, strict=True):
        truth = each.value(float(step)) * (scale if number.path.endswith(".flux") else 1.0)
        off = math.log(number.after / truth) if each.logarithmic else number.after - truth
        rows.append(
            {
                "number": each.words,
                "unit": each.unit,
                "start": each.start,
                "hidden": truth,
                "found": number.after,
                "uncertainty": number.uncertainty,
                "determined": number.determined,
                "share_of_range": abs(off) / (RANGE * each.plausible_range),
                "deviations": abs(number.after - truth) / number.uncertainty,
            }
        )
    held = found.of_presses(found.after.realism, held_out=True)
    return {
        "rows": rows,
        "alike": [list(pair) for pair in found.alike],
        "unexplained": held.median("unexplained"),
        "noise_unexplained": held.median_of_noise("unexplained"),
        "background_db": found.after.realism.background.ratio,
        "cpu_s": round(used, 1),
    }


def measure_many(name: str) -> dict[str, Any]:
    """Return the errors of many sets of hidden numbers, in stated standard deviations."""
    design = ots.load(name)
    chosen = quantities_of(design, WITHOUT_RENDERING)
    model = ots.OpticalModel(design)
    balls, seen = ([each[k] for k in FITTED] for each in balls_on(model))
    blank = np.zeros((SIZE[1], SIZE[0], 3), dtype=np.uint8)
    presses = tuple(PhotographedPress(f"press-{k}", blank, 2.0 * RADIUS) for k in range(len(balls)))
    start = time.process_time()
    real, one, other = (
        layered_pictures(model, Photographs(blank, presses), seen, photons, seed, balls)
        for photons, seed in ((PHOTONS, SEED), (FIT_PHOTONS, 0), (FIT_PHOTONS, AGAIN))
    )
    layers, noise = averaged(one, other)
    errors = [
        errors_of(design, chosen, hidden_steps(chosen, SEED + k), real, layers, noise, seen)
        for k in range(SETS)
    ]
    return {
        "numbers": [each.words for each in chosen],
        "deviations": np.round(errors, 3).tolist(),
        "cpu_s": round(time.process_time() - start, 1),
    }


def errors_of(
    design: SensorDesign,
    chosen: list[FitQuantity],
    hidden: NDArray[np.float64],
    real: LayeredPictures,
    layers: LayeredPictures,
    noise: LayeredPictures,
    seen: list[SeenContact],
) -> NDArray[np.float64]:
    """Return the errors (n,) of fitted numbers, in standard deviations that the fit states.

    Args:
        hidden: (n,) hidden steps of the numbers.
        real, layers, noise: layers of the photographs and of the fit, and a sample of its noise.
    """
    chain = chain_with(real.chain, chosen, hidden)
    factors = power_factors(real.groups, chosen, hidden).astype(np.float32)
    shown = [np.tensordot(factors, each, axes=1) for each in real.pictures]
    exposure = chain.auto_exposure(shown[0])
    levels = [np.clip(np.round(levels_of(each, chain, exposure)), 0, 255) for each in shown]
    ground, *pressed = (by_camera(each.astype(np.uint8), k) for k, each in enumerate(levels))
    photographs = Photographs(
        ground,
        tuple(PhotographedPress(f"{k}", each, 2.0 * RADIUS) for k, each in enumerate(pressed)),
    )
    guess = matched_exposure(layers.background.sum(axis=0), layers.chain, ground)
    start = np.zeros(len(chosen))
    fit = LayeredFit(photographs, seen, layers, chosen, guess, start, {}, noise)
    found = fit.solve(start, np.zeros((len(seen), 3)))
    steps = found.steps
    fitted = designed(design, chosen, steps)
    found = with_known_total(chosen, found, fitted)
    off = steps - hidden
    scale = math.log(total_power(fitted) / total_power(designed(design, chosen, hidden)))
    for index, each in enumerate(chosen):
        if each.path.endswith(".flux"):
            off[index] -= scale / each.plausible_range
    return np.asarray(off / np.sqrt(np.diag(found.covariance)))


def hidden_steps(chosen: list[FitQuantity], seed: int = SEED) -> NDArray[np.float64]:
    """Return how far the hidden numbers are from the starts, in plausible ranges, within limits."""
    rng = np.random.default_rng(seed)
    found = rng.uniform(-HIDDEN, HIDDEN, len(chosen))
    for index, each in enumerate(chosen):
        if not each.logarithmic and each.start + each.plausible_range * found[index] < each.low:
            found[index] *= -1.0  # such as a level in the dark, which is not below 0
    return found


def photographed(real: SensorDesign) -> Photographs:
    """Return photographs of presses, with noise, dust and blur."""
    model = ots.OpticalModel(real)
    balls, seen = balls_on(model)
    rng = np.random.default_rng([SEED, 2000])
    labels = []
    for place in seen:
        off = LABELS_OFF[0] * rng.uniform(-1.0, 1.0, 2)
        labels.append(
            {
                "centre": (place.centre[0] + off[0], place.centre[1] + off[1]),
                "radius": place.radius * (1.0 + LABELS_OFF[1] * rng.uniform(-1.0, 1.0)),
            }
        )
    finer = (FINER * SIZE[0], FINER * SIZE[1])
    clean = photograph_model(
        model, balls, resolution=finer, photons=PHOTONS, seed=SEED, noise=0.0
    ).scaled(SIZE[0])
    presses = [
        replace(press, picture=by_camera(press.picture, number), **label)
        for number, (press, label) in enumerate(zip(clean.presses, labels, strict=True), start=1)
    ]
    return replace(clean, background=by_camera(clean.background, 0), presses=tuple(presses))


def balls_on(model: ots.OpticalModel) -> tuple[list[Contact], list[SeenContact]]:
    """Return balls that are pressed in, and where a picture shows their contacts."""
    rays = model.chief_rays(SIZE)
    rows, columns = np.nonzero(rays.hit)
    balls, seen = [], []
    for across, down in PLACES:
        place = columns.min() + across * np.ptp(columns), rows.min() + down * np.ptp(rows)
        nearest = int(np.argmin(np.hypot(columns - place[0], rows - place[1])))
        point = rays.points[rows[nearest], columns[nearest]].astype(float).tolist()
        ball = Contact(ots.Sphere(RADIUS), point=tuple(point), depth=DEPTH)
        centre = columns[nearest] + 0.5, rows[nearest] + 0.5
        scale = place_on_skin(centre, rays, "")[1]
        radius = math.sqrt(model.pressed([ball]).contacts[0].area / math.pi) / scale
        balls.append(ball)
        seen.append(SeenContact(centre, radius))
    return balls, seen


def by_camera(picture: NDArray[np.uint8], number: int) -> NDArray[np.uint8]:
    """Return a picture with the blur, dust and noise of the photograph of a number."""
    found = gaussian_filter(picture.astype(np.float64), (BLUR, BLUR, 0.0))
    own = np.random.default_rng([SEED, number])
    for rng in (np.random.default_rng([SEED, 1000]), own):  # the same dust in all, and other dust
        for _ in range(DUST):
            row, column = rng.integers(4, picture.shape[0] - 4), rng.integers(4, SIZE[0] - 4)
            found[row : row + 2, column : column + 2] += rng.uniform(-DUST_LEVELS, DUST_LEVELS)
    found += NOISE * own.standard_normal(found.shape)
    return np.clip(np.round(found), 0, 255).astype(np.uint8)


def total_power(design: SensorDesign) -> float:
    """Return the power of all lights, mW."""
    return sum(group.flux * len(group.lights) for group in design.lights.values())


def table(found: dict[str, Any]) -> str:
    """Return the results as Markdown."""
    lines = [
        *page_head("Fits to photographs of simulated sensors", "benchmarks.calibration"),
        f"The photographs, a background and {len(PLACES)} presses of a ball of {2 * RADIUS:g} mm, "
        "are simulated with parameters that the fit does not know, and have noise, dust, blur and "
        "inaccurate labels. The fit starts from the built-in sensor, varies the default parameters "
        "of `optisense calibrate`, and does not use every third press. Errors are given relative "
        "to the range of a parameter (two plausible ranges to each side of its start), and in "
        "standard deviations that the fit states, which are the numbers after ±. *Unexplained* is "
        "the energy of the error divided by that of the measured response, over the presses that "
        "were held out; *noise alone* is the part of it that the noise of the photographs causes.",
        "",
        "| sensor | parameters | not determined | error below 5 % of the range | within 2 "
        "deviations | within 3 | unexplained | noise alone | background | processor time |",
        "|" + "---|" * 10,
    ]  # fmt: skip
    single = {name: part for name, part in found.items() if "rows" in part}
    for name, part in single.items():
        known = [row for row in part["rows"] if row["determined"]]
        near = sum(row["share_of_range"] < 0.05 for row in known)
        two, three = (sum(row["deviations"] < most for row in known) for most in (2.0, 3.0))
        lines.append(
            f"| {name} | {len(part['rows'])} | {len(part['rows']) - len(known)} "
            f"| {near} of {len(known)} | {two} | {three} | {part['unexplained']:.3f} "
            f"| {part['noise_unexplained']:.3f} | {part['background_db']:.1f} dB "
            f"| {part['cpu_s']:.0f} s |"
        )
    lines += [
        "", "## Many sets of hidden parameters", "",
        f"The table counts parameters of {SETS} sets that are found within one, two and three of "
        "their stated standard deviations, and their root mean square error in deviations. With "
        "normally distributed errors, 68 %, 95 % and 99.7 % would be found. The sets contain the "
        "parameters whose changes need no rendering: powers, colours, tone, levels in the dark and "
        "shading. All sets share the renderings of the photographs and of the fit, whose light "
        "has independent noise.", "",
        "| sensor | parameters | within 1 | within 2 | within 3 | root mean square | "
        "processor time |",
        "|" + "---|" * 7,
    ]  # fmt: skip
    for name, part in found.items():
        if "deviations" in part:
            sizes = np.abs(part["deviations"])
            one, two, three = (f"{100 * (sizes < most).mean():.0f} %" for most in (1.0, 2.0, 3.0))
            lines.append(
                f"| {name.removeprefix('many-')} | {sizes.size} | {one} | {two} | {three} "
                f"| {np.sqrt((sizes**2).mean()):.2f} | {part['cpu_s']:.0f} s |"
            )
    for name, part in single.items():
        lines += [
            "", f"## {name}", "",
            "| parameter | start | true | found | ± | error, % of the range | deviations |",
            "|" + "---|" * 7,
        ]  # fmt: skip
        for row in part["rows"]:
            note = "" if row["determined"] else " (not determined)"
            unit = f", {row['unit']}" if row["unit"] else ""
            lines.append(
                f"| {row['number']}{unit}{note} | {row['start']:.4g} | {row['hidden']:.4g} "
                f"| {row['found']:.4g} | {row['uncertainty']:.2g} "
                f"| {100 * row['share_of_range']:.1f} | {row['deviations']:.1f} |"
            )
        for one, other, value in part["alike"]:
            lines += ["", f"Strongly correlated parameters: {one}, and {other} ({value:.2f})."]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
