"""Work of the units that measure the time of images."""

from __future__ import annotations

import itertools
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.mechanics import CONFORMING
from paper.evaluations import design_of
from paper.unit import Found

if TYPE_CHECKING:
    from optisense.optics import TactileImage

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
