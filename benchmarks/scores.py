"""Scatter, bias and cost of scores, and their dependence on settings.

``python -m benchmarks.scores [--seeds N] [--dry]`` writes scores.json and scores.md beside this
file. The sensor is GelSight Mini with its flat gel, at the default settings of `evaluate`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from statistics import mean, stdev
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

import optisense
from benchmarks.results import busy_note, machine, page_head, store
from benchmarks.timing import Time, medians, timed
from optisense import library
from optisense.objectives import Evaluation, Press, Score, Settings, evaluate, find
from optisense.objectives.registry import pixels_read
from optisense.objectives.rgb2normal import fit, line, signed_angles
from optisense.objectives.scoring import run_objective
from optisense.optics import OpticalModel

DESIGN = "gelsight-mini-ideal"
SEEDS = 20
"""Number of seeds; 20 give a standard deviation to a sixth of its value."""
TIMED_SEEDS = 5
"""Number of seeds with which scores are timed; the median of the times is reported."""
WARM_UP_SEED = 1000
"""Seed of the evaluation that compiles kernels, which no timed evaluation has."""
RAY_RUNS = 7
"""Number of timed evaluations of chief rays, whose median is reported."""
IMAGES = ("rgb2normal", "normdiff")
RAYS = ("aoap", "2to3pw")
DIRECTIONS = (0.0, 45.0, 90.0, 135.0)
"""Directions (degrees) of the lines on which RGB2Normal is computed: each second one of the usual
eight, whose opposites lie on the same line."""
ANGLES = (20.0, 25.0, 30.0)
"""Largest tilts (degrees) to which the normals of a line are restricted; a ball pressed in by 0.3
mm has tilts up to 37 degrees."""
DEPTHS = (0.1, 0.2, 0.5)
"""Depths (mm) of the ball beside the usual 0.3 mm."""
PIXEL_NOISE = 1.5 / 255
"""Standard deviation of a pixel's noise, as a share of full scale: that of a real GelSight Mini is
1.1 to 1.9 grey levels of 255."""

TARGETS = {
    "rgb2normal": "standard deviation 0.003; 10 s for all nine places, light included",
    "normdiff": "standard deviation 2 %; 2 s more",
    "aoap": "50 ms at 640x480",
    "2to3pw": "50 ms at 640x480",
}

Responses = list[NDArray[np.float32]]


class GivenPresses:
    """Replacement of an evaluation for objectives that read presses only."""

    def __init__(self, presses: Sequence[Press]) -> None:
        self.presses = list(presses)


def main() -> None:
    """Run the benchmark, print its results and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    console = Console()
    about = machine()
    model = OpticalModel(optisense.load(DESIGN))

    def tell(text: str) -> None:
        console.print(f"[dim]{text}")

    tell("warming up")
    evaluate(Evaluation(model, Settings(seed=WARM_UP_SEED)), [*IMAGES, *RAYS])
    scatter, presses, responses = measure_seeds(model, options.seeds, tell)
    tell("what it depends on")
    found = {
        "machine": about,
        "design": DESIGN,
        "scores": scatter | measure_rays(model),
        "more_light": measure_more_light(presses, responses),
        "one_image": measure_one_image(model, options.seeds - 1, presses, responses[-1]),
        "rgb2normal_depends_on": [
            *measure_reading(_lit(presses, responses)),
            *measure_presses(model, options.seeds - 1, scatter),
            measure_without_guide(options.seeds - 1),
        ],
    }
    text = _markdown(found)
    console.print(text, markup=False)
    if not options.dry:
        store("scores", found, text)


def measure_seeds(
    model: OpticalModel, seeds: int, tell: Callable[[str], None]
) -> tuple[dict[str, Any], list[Press], list[Responses]]:
    """Return scores with several seeds, the last presses, and the responses of all seeds.

    Each seed has photons of its own. Both scores are computed together, as is usual; with the first
    `TIMED_SEEDS`, RGB2Normal is timed before by itself, with new photons and with kept ones.
    """
    values: dict[str, list[float]] = {name: [] for name in IMAGES}
    times: dict[str, list[Time]] = {name: [] for name in ("new light", "kept light", "more")}
    presses: list[Press] = []
    responses: list[Responses] = []
    wanted = [find(name) for name in IMAGES]
    for seed in range(seeds):
        evaluation = Evaluation(model, Settings(seed=seed), reads=pixels_read(wanted, {}))
        scores: dict[str, Score] = {}

        def both(e: Evaluation = evaluation, s: dict[str, Score] = scores) -> None:
            s.update(evaluate(e, IMAGES))

        if seed < TIMED_SEEDS:
            alone = [
                timed(lambda s=seed: _checked(evaluate(model, "rgb2normal", seed=s)))  # type: ignore[misc]
                for _ in range(2)
            ]
            together = timed(both)
            times["new light"].append(alone[0])
            times["kept light"].append(alone[1])
            times["more"].append(Time(together.wall - alone[1].wall, together.cpu - alone[1].cpu))
        else:
            both()
        for name in IMAGES:
            values[name].append(_checked(scores[name]).value)
        presses = evaluation.presses
        responses.append([press.response[press.box] for press in presses])
        tell(f"seed {seed}: " + ", ".join(f"{n} {values[n][-1]:.4f}" for n in IMAGES))
    found: dict[str, Any] = {
        name: {
            "values": values[name],
            "mean": mean(values[name]),
            "standard_deviation": stdev(values[name]),
            "its_standard_error": stdev(values[name]) / (2 * (seeds - 1)) ** 0.5,
        }
        for name in IMAGES
    }
    found["rgb2normal"] |= _seconds(medians(times["new light"]))
    found["rgb2normal"]["kept_light"] = _seconds(medians(times["kept light"]))
    found["normdiff"] |= _seconds(medians(times["more"]))
    return found, presses, responses


def measure_rays(model: OpticalModel) -> dict[str, Any]:
    """Return scores of chief rays, each from rays of its own."""
    found = {}
    for name in RAYS:
        scores: list[Score] = []
        times = [
            timed(lambda n=name, s=scores: s.append(_score(Evaluation(model), n)))  # type: ignore[misc]
            for _ in range(RAY_RUNS)
        ]
        found[name] = {"mean": scores[0].value, **_seconds(medians(times))}
    return found


def measure_more_light(presses: list[Press], responses: list[Responses]) -> dict[str, Any]:
    """Return scores of the mean of several images, extrapolated to infinitely many photons.

    The bias of a score falls as 1 over the number of photons. The mean score of single images,
    s(1), and the score of the mean of all k images, s(k), give s(k) + (s(k) - s(1)) / (k - 1).
    """
    count = len(responses)
    found: dict[str, Any] = {}
    for name in IMAGES:
        rows = {}
        for together in (k for k in range(1, count + 1) if count % k == 0):
            groups = [responses[i : i + together] for i in range(0, count, together)]
            rows[together] = mean(_value(name, _lit(presses, group)) for group in groups)
        limit = rows[count] + (rows[count] - rows[1]) / (count - 1)
        found[name] = {
            "mean_of_images": {str(k): value for k, value in rows.items()},
            "endless_light": limit,
            "bias": rows[1] - limit,
        }
    return found


def measure_one_image(
    model: OpticalModel, seed: int, presses: list[Press], responses: Responses
) -> dict[str, Any]:
    """Compare all nine contacts in one image with one image each, with the same photons."""
    evaluations: list[Evaluation] = []
    time = timed(lambda: evaluations.append(_pressed(model, seed, together=True)))
    alone = timed(lambda: evaluations.append(_pressed(model, seed, together=False)))
    found: dict[str, Any] = {
        "seconds_one_image": _seconds(time),
        "seconds_one_by_one": _seconds(alone),
    }
    for name in IMAGES:
        one, each = (evaluate(evaluation, name) for evaluation in evaluations)
        places = [
            abs(a["score"] - b["score"])
            for a, b in zip(one.parts["places"], each.parts["places"], strict=True)
        ]
        found[name] = {
            "one_image": one.value,
            "one_by_one": each.value,
            "largest_difference_of_a_place": max(places),
        }
    return found


def measure_reading(presses: list[Press]) -> Iterator[dict[str, Any]]:
    """Yield RGB2Normal of the same images with other choices of pixels, values and places."""
    rng = np.random.default_rng(0)
    yield _row("the mean image of all seeds", presses)
    for most in ANGLES:
        yield _row(f"only normals within {most:g}°", presses, most=most)
    yield _row("linear response instead of the picture", presses, kind="response")
    yield _row("noise of 1.5 grey levels a pixel", presses, noise=PIXEL_NOISE, rng=rng)
    edge = min(float(press.place[0]) for press in presses)
    beside = [press for press in presses if press.place[0] < edge + 1.0]
    others = [press for press in presses if press.place[0] >= edge + 1.0]
    yield _row("only the three places beside the green LEDs", beside)
    yield _row("without these three places", others)


def measure_presses(
    model: OpticalModel, seed: int, scatter: dict[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield RGB2Normal of other images with the photons of one seed."""
    value = scatter["rgb2normal"]["values"][seed]
    yield {"what": f"one image a place, seed {seed}", "value": value}
    changes: list[tuple[str, dict[str, Any]]] = [
        (f"pressed {depth:g} mm deep instead of 0.3", {"depth": depth}) for depth in DEPTHS
    ]
    changes += [("320x240 pixels", {"resolution": (320, 240)})]
    changes += [("1 million photons", {"photons": 1_000_000})]
    for what, change in changes:
        score = _score(Evaluation(model, Settings(seed=seed, **change)), "rgb2normal")
        yield {"what": what, "value": score.value, **_by_direction(score.parts["directions"])}


def measure_without_guide(seed: int) -> dict[str, Any]:
    """Return RGB2Normal without the assumed light guide: the same LEDs shine through air."""
    design = optisense.load(DESIGN)
    design.materials["air"] = library.material("air")
    design.parts["guide"].material = "air"
    score = _score(Evaluation(OpticalModel(design), Settings(seed=seed)), "rgb2normal")
    what = "no light guide: air in its place"
    return {"what": what, "value": score.value, **_by_direction(score.parts["directions"])}


def _pressed(model: OpticalModel, seed: int, together: bool) -> Evaluation:
    evaluation = Evaluation(model, Settings(seed=seed, together=together))
    assert evaluation.presses
    return evaluation


def _score(evaluation: Evaluation, name: str) -> Score:
    return _checked(run_objective(find(name), evaluation))


def _checked(score: Score) -> Score:
    if score.failure is not None:
        raise RuntimeError(score.failure)
    return score


def _value(name: str, presses: Sequence[Press]) -> float:
    value, *_ = find(name).function(GivenPresses(presses))
    return float(value)


def _lit(presses: list[Press], responses: list[Responses]) -> list[Press]:
    """Return the presses with the mean response over seeds."""
    found = []
    for number, press in enumerate(presses):
        response = np.zeros_like(press.response)
        response[press.box] = np.mean([each[number] for each in responses], axis=0)
        found.append(replace(press, response=response))
    return found


def _row(
    what: str,
    presses: Sequence[Press],
    most: float = 90.0,
    kind: str = "picture",
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> dict[str, Any]:
    table = np.zeros((len(presses), len(DIRECTIONS)))
    for row, press in enumerate(presses):
        for column, angle in enumerate(DIRECTIONS):
            chosen = line(press, angle)
            angles = signed_angles(press, angle, press.normals[chosen])
            colours = press.colours(chosen, kind)
            if rng is not None:
                colours = colours + noise * rng.standard_normal(colours.shape)
            kept = np.abs(angles) < most
            table[row, column] = fit(angles[kept], colours[kept]).linearity
    means = {f"{a:g}": float(m) for a, m in zip(DIRECTIONS, table.mean(axis=0), strict=True)}
    return {"what": what, "value": float(table.mean()), **_by_direction(means)}


def _by_direction(means: dict[str, float]) -> dict[str, Any]:
    return {"directions": {f"{angle:g}": means[f"{angle:g}"] for angle in DIRECTIONS}}


def _seconds(time: Time) -> dict[str, float]:
    return {"wall_s": round(time.wall, 3), "cpu_s": round(time.cpu, 3)}


def _markdown(found: dict[str, Any]) -> str:
    about = found["machine"]
    lines = [
        *page_head("Scatter, bias and time of scores", "benchmarks.scores"),
        f"The sensor is {found['design']}, with default settings. Measured on {about['date']}: "
        f"{about['processor']}, {about['cores']} cores, Python {about['python']}"
        f"{busy_note(about)}.",
        "",
        "| score | value | standard deviation over seeds | seconds | CPU seconds | target |",
        "|---|---|---|---|---|---|",
    ]
    for name, row in found["scores"].items():
        spread = row.get("standard_deviation")
        text = (
            "none"
            if spread is None
            else f"{spread:.4f} ± {row['its_standard_error']:.4f} "
            f"({100 * spread / abs(row['mean']):.1f} %)"
        )
        lines.append(
            f"| {name} | {row['mean']:.4f} | {text} | {row['wall_s']:.2f} | {row['cpu_s']:.2f} | "
            f"{TARGETS[name]} |"
        )
    kept = found["scores"]["rgb2normal"]["kept_light"]
    lines += [
        "",
        "The time of RGB2Normal includes the photons; with an existing radiance cache, it takes "
        f"{kept['wall_s']:.2f} s ({kept['cpu_s']:.2f} CPU seconds). The time of NormDiff is the "
        "additional time if both are computed. The standard deviations are over "
        f"{len(found['scores']['rgb2normal']['values'])} seeds.",
        "",
        "## Bias",
        "",
        "| score | images averaged | value |",
        "|---|---|---|",
    ]
    for name, row in found["more_light"].items():
        lines += [f"| {name} | {k} | {v:.4f} |" for k, v in row["mean_of_images"].items()]
        lines.append(
            f"| {name} | infinitely many | {row['endless_light']:.4f} (bias {row['bias']:+.4f}) |"
        )
    one = found["one_image"]
    lines += ["", "## All nine contacts in one image", ""]
    lines += [
        "| score | one image | one image per contact | largest difference at a place |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {one[name]['one_image']:.4f} | {one[name]['one_by_one']:.4f} | "
        f"{one[name]['largest_difference_of_a_place']:.4f} |"
        for name in IMAGES
    ]
    each, together = one["seconds_one_by_one"], one["seconds_one_image"]
    lines += [
        "",
        f"With an existing radiance cache, one image takes {together['cpu_s']:.1f} CPU seconds, "
        f"and one image per contact {each['cpu_s']:.1f}.",
        "",
        "## Dependence of RGB2Normal on single settings",
        "",
        "| setting | RGB2Normal | " + " | ".join(f"{a:g}°" for a in DIRECTIONS) + " |",
        "|---|---|" + "---|" * len(DIRECTIONS),
    ]
    for row in found["rgb2normal_depends_on"]:
        ways = row.get("directions")
        cells = [f"{v:.3f}" for v in ways.values()] if ways else [""] * len(DIRECTIONS)
        lines.append(f"| {row['what']} | {row['value']:.4f} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
