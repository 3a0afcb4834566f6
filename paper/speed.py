"""Experiment on the time of a tactile image, compared with the times of the OptiSense paper.

The paper states 6 s for GelSight Mini on an Apple M2, 8.9 s for GelBelt, and 8.7 s for GelSight360.
It states neither the resolution, nor the photons, nor the noise, nor a time for GelSight Svelte.
"""

from __future__ import annotations

import itertools
import os
import platform
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.mechanics import CONFORMING
from paper.claims import Claim, Table
from paper.evaluations import design_of, sensor
from paper.experiment import Experiment, Finding, Pictures, Steps, Values
from paper.figures import finish
from paper.spread import exceeds, number, shown, spread
from paper.unit import Found, Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from optisense.optics import TactileImage

PAPER = {"gelsight-mini-ideal": 6.0, "gelbelt": 8.9, "gelsight360": 8.7, "gelsight-svelte": None}
"""Time (s) of an image in the OptiSense paper; it states none for GelSight Svelte."""

KINDS = {"new_light": "new light", "light_kept": "light kept"}

BUSY = 1.3
"""Ratio of wall time times processors to processor time above which other programs ran, too."""

UNTIMED_SEED = 10_000
"""Seed of the images that are not timed; it differs from the seeds 0, 1, ... of those that are."""


def image_times(inputs: Mapping[str, Any], folder: Path) -> Found:
    """Return the times of images, s.

    The inputs are `design`, `resolutions`, `photons`, `seeds` and `ball` (radius and depth, mm).
    For each seed, an image with new light is rendered at the first resolution, and an image with
    the same light at every resolution. Since photons do not depend on the pixels, the time that new
    light adds at the first resolution is added at the others. Images before these are not timed:
    for them, kernels are compiled and the photon guide is learned. The noise is the difference of
    two seeds in the contact, relative to the mean there, divided by the square root of 2.
    """
    from optisense.geometry import Sphere
    from optisense.optics import OpticalModel

    radius, depth = inputs["ball"]
    began = time.perf_counter()
    model = OpticalModel(design_of(inputs["design"]))
    contact = model.nine_contacts(Sphere(radius), depth)[4]
    sizes = [tuple(size) for size in inputs["resolutions"]]

    def image(size: tuple[int, int], seed: int) -> tuple[TactileImage, NDArray[np.float64]]:
        """Return an image with its wall time and processor time (2,), s."""
        clock, spent = time.perf_counter(), time.process_time()
        made = model.render([contact], size, inputs["photons"], seed=seed, skin=CONFORMING)
        if made.interrupted:
            raise KeyboardInterrupt
        return made, np.array([time.perf_counter() - clock, time.process_time() - spent])

    warm, _ = image(sizes[0], UNTIMED_SEED)
    first = time.perf_counter() - began
    for size in sizes:
        image(size, UNTIMED_SEED)
    times: dict[str, list[list[list[float]]]] = {"new_light": [], "light_kept": []}
    images = []
    for seed in inputs["seeds"]:
        new = image(sizes[0], seed)[1]
        made, kept = zip(*(image(size, seed) for size in sizes), strict=True)
        light = new - kept[0]
        images.append(made)
        times["light_kept"].append([each.tolist() for each in kept])
        times["new_light"].append([(light + each).tolist() for each in kept])
    noises = [
        [_difference(a.radiance, b.radiance, a.contact_mask & b.contact_mask) for a, b in pairs]
        for pairs in (zip(*both, strict=True) for both in itertools.pairwise(images))
    ]
    return Found(
        {
            "first": first,
            **times,
            "noise": noises,
            "photons": warm.settings["photons"],
            "pixels_in_contact": int(images[0][0].contact_mask.sum()),
        }
    )


def _difference(one: Any, other: Any, mask: Any) -> float:
    """Return the relative noise of two images (h, w, 3) in a mask (h, w), from their difference."""
    a, b = one[mask].astype(np.float64), other[mask].astype(np.float64)
    lit = (a + b).sum(axis=0) > 0.0
    return float(np.sqrt(((a - b)[:, lit] ** 2).mean() / 2.0) / (0.5 * (a + b)[:, lit].mean()))


def steps(settings: Values) -> Steps:
    """Measure each sensor at all resolutions, one sensor after the other."""
    records = yield [
        Unit(
            image_times,
            {
                "design": sensor(name),
                "resolutions": settings["resolutions"],
                "photons": settings["photons"],
                "seeds": list(range(max(2, settings["seeds"]))),
                "ball": settings["ball"],
            },
            f"images of {name}",
            alone=True,
        )
        for name in PAPER
    ]
    found: Values = {"times": {}, "machine": _machine()}
    for name, record in zip(PAPER, records, strict=True):
        values = record.values
        if record.failure is not None:
            continue
        for place, (width, height) in enumerate(settings["resolutions"]):
            row: Values = {
                "noise": spread([100.0 * noises[place] for noises in values["noise"]]),
                "photons": values["photons"],
                "first": values["first"] if place == 0 else None,
            }
            for kind in KINDS:
                row[kind] = spread([times[place][0] for times in values[kind]])
                row[f"{kind}_processor"] = spread([times[place][1] for times in values[kind]])
            found["times"].setdefault(name, {})[f"{width}x{height}"] = row
    return Finding(found)


def _machine() -> Values:
    """Return the model and the number of the machine's processors."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [x.split(":", 1)[1] for x in info.read_text().splitlines() if "model name" in x]
        model = names[0].strip() if names else model
    return {"processor": model, "processors": os.cpu_count()}


def claims(numbers: Values) -> list[Claim]:
    """Return the paper's times as statements, with verdicts."""
    found = []
    for name, seconds in PAPER.items():
        for size, row in numbers["times"].get(name, {}).items():
            if seconds is None:
                continue
            longer = exceeds(row["new_light"], seconds)
            undecided = longer is None or (longer and _was_busy(row, numbers["machine"]))
            found.append(
                Claim(
                    f"An image of {name} takes {seconds:g} s.",
                    f"{shown(row['new_light'])} s at {size} with {row['photons']:,} photons and "
                    f"{number(row['noise']['mean'], 2)} % noise; a further image of the same "
                    f"sensor takes {shown(row['light_kept'])} s",
                    None if undecided else not longer,
                    "Times depend on the machine and on its other load (compare the processor "
                    "seconds). A shorter time counts as agreement; a longer time on a busy machine "
                    "is inconclusive.",
                )
            )
    return found


def _was_busy(row: Values, about: Values) -> bool:
    """Return whether the processors were idle or ran other programs for much of the time."""
    wall = float(row["new_light"]["mean"]) * (about["processors"] or 1)
    return wall > BUSY * float(row["new_light_processor"]["mean"]) + 1.0


def notes(numbers: Values) -> list[str]:
    """Return a paragraph on the machine, and on whether it was busy."""
    about = numbers["machine"]
    busy = [
        f"{name} {size}"
        for name, sizes in numbers["times"].items()
        for size, row in sizes.items()
        if _was_busy(row, about)
    ]
    text = (
        f"The machine has {about['processors']} processors ({about['processor']}). *New light* is "
        "an image for which all photons are traced anew, as after a change of the lights. *Light "
        "kept* is an image of another contact on the same sensor. The time of photon tracing does "
        "not depend on the number of pixels; it is measured at the first resolution and added at "
        "the others. *First* is the first image of a process, which includes building the scene, "
        "compiling kernels and learning the emission guide. The noise is computed from the "
        "difference between two seeds in the contact."
    )
    if busy:
        text += f" The machine was busy, or partly idle, during: {', '.join(busy)}."
    return [text]


def tables(numbers: Values) -> list[Table]:
    """Return the table of all times."""
    rows = []
    for name, sizes in numbers["times"].items():
        for size, row in sizes.items():
            rows.append(
                [
                    name,
                    size,
                    f"{row['photons']:,}",
                    f"{shown(row['noise'], 2)} %",
                    *(
                        f"{shown(row[kind])} s ({number(row[f'{kind}_processor']['mean'])} s)"
                        for kind in KINDS
                    ),
                    "" if row["first"] is None else f"{number(row['first'])} s",
                    "not given" if PAPER[name] is None else f"{PAPER[name]:g} s",
                ]
            )
    heads = ["sensor", "pixels", "photons", "noise", *KINDS.values(), "first", "paper"]
    return [Table("Time of an image (in brackets: processor seconds of all threads)", heads, rows)]


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Draw the times as bars beside those of the paper."""
    from optisense.figures import AMBER, BLUE, GREY, new_figure

    figure = new_figure(9.0, 3.8)
    axes = figure.subplots()
    labels = [(name, size) for name, sizes in numbers["times"].items() for size in sizes]
    for offset, (kind, colour) in enumerate(zip(KINDS, (BLUE, AMBER), strict=True)):
        found = [numbers["times"][name][size][kind] for name, size in labels]
        axes.bar(
            [k + 0.27 * offset for k in range(len(labels))],
            [each["mean"] for each in found],
            0.25,
            yerr=[each["standard_deviation"] or 0.0 for each in found],
            color=colour,
            label=KINDS[kind],
            capsize=3,
        )
    axes.bar(
        [k + 0.54 for k in range(len(labels))],
        [PAPER[name] or 0.0 for name, _ in labels],
        0.25,
        color=GREY,
        label="paper (its own machine)",
    )
    axes.set_xticks([k + 0.27 for k in range(len(labels))])
    axes.set_xticklabels([f"{name}\n{size}" for name, size in labels])
    finish(axes, "Seconds an image", y="s", legend=True)
    return figure


EXPERIMENT = Experiment(
    name="speed",
    title="Speed",
    about="image times of the four sensors, compared with the paper's 6 to 9 s",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
    notes=notes,
)
