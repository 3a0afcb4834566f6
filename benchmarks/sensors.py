"""Times of each built-in sensor: loading and checking, a picture, and the first picture.

``python -m benchmarks.sensors [--only NAME] [--dry]`` writes sensors.json and sensors.md beside
this file. It needs a machine that does nothing else; where it has to share one, the processor
seconds tell more than the others.
"""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from typing import Any

import numpy as np

from benchmarks.results import measure_parts, measured_on, page_head
from benchmarks.timing import Time, medians, run_child, timed
from optisense import OpticalModel, sensors
from optisense.geometry import Contact, Sphere
from optisense.mechanics import CONFORMING
from optisense.optics import TactileImage

NAMES = ("digit", "gelsight-mini-ideal", "gelbelt", "gelsight360", "gelsight-svelte")
RESOLUTION = (320, 240)
"""Width and height (pixels) of the images, as in the OptiSense paper."""
WANTED_NOISE = 0.03
"""Relative noise of the light in the contact, that of the images of `benchmarks.case`."""
TRIAL_PHOTONS, STEP, MOST_PHOTONS = 400_000, 50_000, 16_000_000
"""First, step and largest number of photons in the search for the fewest that reach the wanted
noise."""
SEEDS = 6
"""Number of images from which the noise of each pixel is computed."""
RUNS = 3
"""Number of timed images, whose median is reported."""
CHILD_RUNS = 5
"""Number of timed processes that load and check a sensor, whose median is reported."""
RADIUS, DEPTH = 1.5, 0.8
"""Radius and depth (mm) of the ball, those of `benchmarks.case`."""

LOAD_AND_CHECK = "from optisense import sensors; sensors.check(sensors.build('{name}'))"
TARGETS = {"load_and_check": 1.0, "image": 1.5, "first_image": 8.0}
"""Goals for the durations (s) on an idle machine of two cores."""


def main() -> None:
    """Run the benchmark, print its results and write them."""
    measure_parts("sensors", __doc__, {name: partial(measure, name) for name in NAMES}, table)


def measure(name: str) -> dict[str, Any]:
    """Return all figures of a built-in sensor."""
    design = sensors.build(name)
    inside = medians([timed(lambda: sensors.check(sensors.build(name))) for _ in range(CHILD_RUNS)])
    child = [sys.executable, "-c", LOAD_AND_CHECK.format(name=name)]
    loaded = medians([run_child(child)[0] for _ in range(CHILD_RUNS)])

    model = OpticalModel(design)
    place = model.nine_contacts()[4].point
    assert place is not None
    ball = Contact(Sphere(radius=RADIUS), point=place, depth=DEPTH)
    photons, noise = least_photons(model, ball)
    images: list[TactileImage] = []
    fresh, kept = [], []
    for seed in range(10, 10 + RUNS):
        settings = {"resolution": RESOLUTION, "photons": photons, "seed": seed, "skin": CONFORMING}
        fresh.append(timed(lambda s=settings: images.append(model.render([ball], **s))))  # type: ignore[misc]
        kept.append(timed(lambda s=settings: model.render([ball], **s)))  # type: ignore[misc]
    text = ",".join(f"{x:.4f}" for x in place)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "optisense.cli", "render", name, "--contact"]
        command += [f"sphere:{RADIUS}@{text}:{DEPTH}"]
        command += ["--resolution", "{}x{}".format(*RESOLUTION), "--out"]
        first = [run_child([*command, f"{folder}/{run}"])[0] for run in range(RUNS)]
    return {
        "build_and_check": plain(inside),
        "load_and_check": plain(loaded),
        "photons": photons,
        "noise_in_contact": round(noise, 4),
        "noise_told": images[-1].settings["noise_reached_percent"],
        "image_new_photons": plain(medians(fresh)),
        "image_kept_light": plain(medians(kept)),
        "first_image": plain(medians(first)),
        "pixels_in_contact": int(images[-1].contact_mask.sum()),
    }


def least_photons(model: OpticalModel, ball: Contact) -> tuple[int, float]:
    """Return the smallest number of photons that reaches `WANTED_NOISE`, within some 15 %, and the
    relative noise in the contact.

    The next number of photons is predicted from noise that falls as their cubic root.
    """
    photons, too_few = TRIAL_PHOTONS, 0
    while True:
        noise = noise_in_contact(model, ball, photons)
        wanted = 1.03 * photons * (noise / WANTED_NOISE) ** 3
        if (noise <= WANTED_NOISE and wanted > 0.85 * photons) or photons >= MOST_PHOTONS:
            return photons, noise
        if noise > WANTED_NOISE:
            too_few = max(too_few, photons)
            wanted = max(wanted, 1.1 * too_few)
        elif wanted <= 1.1 * too_few:
            return photons, noise
        photons = min(MOST_PHOTONS, -(-int(wanted) // STEP) * STEP)


def noise_in_contact(model: OpticalModel, ball: Contact, photons: int) -> float:
    """Return the RMS noise over the contact's pixels and channels, relative to the mean there."""
    images = [
        model.render([ball], resolution=RESOLUTION, photons=photons, seed=seed)
        for seed in range(1, SEEDS + 1)
    ]
    mask = np.logical_and.reduce([image.contact_mask for image in images])
    values = np.array([image.radiance[mask] for image in images], dtype=np.float64)
    values = values[..., values.sum(axis=(0, 1)) > 0.0]
    return float(np.sqrt(values.var(axis=0, ddof=1).mean()) / values.mean())


def plain(time: Time) -> dict[str, float]:
    """Return the results as plain data for JSON."""
    return {"wall_s": round(time.wall, 3), "cpu_s": round(time.cpu, 3)}


def table(found: dict[str, Any]) -> str:
    """Return the results as Markdown."""
    head = ("sensor", "build and check", "load and check in a new process", "photons",
            "noise in the contact", "image, new photons", "image, light kept",
            "first image in a new process")  # fmt: skip
    lines = [
        *page_head("Times of the built-in sensors", "benchmarks.sensors"),
        "Times are medians in seconds; the processor time of all threads is in brackets. A ball of "
        f"radius {RADIUS} mm is pressed {DEPTH} mm deep into the middle of the view, at "
        f"{RESOLUTION[0]}x{RESOLUTION[1]} pixels. The number of photons is that which reduces the "
        f"noise in the contact to {100 * WANTED_NOISE:g} %. The time of the first image in a new "
        "process is measured from the command until all files are written, with the default number "
        "of photons of `optisense render`. The goals are "
        f"{TARGETS['load_and_check']:g} s for loading and checking, {TARGETS['image']:g} s for an "
        f"image and {TARGETS['first_image']:g} s for the first image.", "",
        "| " + " | ".join(head) + " |", "|" + "---|" * len(head),
    ]  # fmt: skip
    for name, row in found.items():
        times = {
            key: f"{value['wall_s']:.2f} ({value['cpu_s']:.2f})"
            for key, value in row.items()
            if isinstance(value, dict) and "wall_s" in value
        }
        cells = (name, times["build_and_check"], times["load_and_check"], f"{row['photons']:,}",
                 f"{100 * row['noise_in_contact']:.1f} %", times["image_new_photons"],
                 times["image_kept_light"], times["first_image"])  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    lines.append("")
    for name, row in found.items():
        lines.append(f"- {name}: {measured_on(row['machine'])}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
