"""Converged image of the case by progressive photon mapping, which is kept in a file.

Photons are traced through the scene with the ball in it and gathered one by one within a small
radius, which shares neither the pooling nor the shading of the radiance cache that is judged. Only
the pixels in and around the contact are gathered: that is where error is measured, and it saves
most of the time.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.case import CONTACT_TEXT, DESIGN, RESOLUTION, Case, FloatArray, ball
from optisense.design import SensorDesign
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import box_around
from optisense.optics.imaging.sppm import render_sppm
from optisense.optics.transport.photons import Emission

CACHE = Path(__file__).parent / ".cache"
SEEDS = 6
"""Number of independent images, whose scatter gives the noise of their mean."""
PHOTONS = 60_000_000
"""Number of photons of each image; the noise of the mean of six was 2.2 %."""
FIRST_RADIUS = 0.12
"""Gather radius (mm) of the first pass, two pixels. That of pass n is smaller by a factor of
n^(1/6), so that most are within one pixel."""
PASS_PHOTONS = 1_000_000
"""Number of photons of a pass; the gather radius shrinks from pass to pass."""
MARGIN = 10
"""Width (pixels) of the margin around the contact, beyond which errors are not measured."""
FIRST_SEED = 7_000
"""Seed of the first image, far from the seeds of the judged images."""


@dataclass(frozen=True)
class WindowCamera(RayCamera):
    """Camera that renders a part of another camera's image.

    Attributes:
        whole: the other camera.
        left, top: first column and row of the part, in pixels of the whole image.
    """

    whole: RayCamera | None = None
    left: int = 0
    top: int = 0

    def rays(self, x: mi.Float, y: mi.Float) -> tuple[mi.Point3f, mi.Vector3f]:
        """Return the rays through film positions (n,) of the window, pixels."""
        assert self.whole is not None
        return self.whole.rays(x + self.left, y + self.top)


@dataclass(frozen=True)
class Reference:
    """Converged image.

    Attributes:
        radiance: radiance (h, w, 3); zero where it is not known.
        known: mask (h, w) of the rendered box around the contact.
        noise: relative RMS error inside the contact, from the scatter of independent seeds.
        photons: number of photons of all seeds.
        seeds: number of seeds.
        seconds: wall time of the rendering, s.
    """

    radiance: FloatArray
    known: NDArray[np.bool_]
    noise: float
    photons: int
    seeds: int
    seconds: float


def make_reference(
    case: Case,
    seeds: int = SEEDS,
    photons: int = PHOTONS,
    tell: Callable[[str], None] = print,
) -> Reference:
    """Return the reference, from the cache if it was rendered before with these settings."""
    radius = FIRST_RADIUS
    key = _key(case.model.design, seeds, photons, radius)
    path = CACHE / f"reference-{key}.npz"
    if path.is_file():
        with np.load(path) as kept:
            return Reference(
                kept["radiance"],
                kept["known"],
                float(kept["noise"]),
                int(kept["photons"]),
                int(kept["seeds"]),
                float(kept["seconds"]),
            )
    began = time.perf_counter()
    images, window = [], box_around(case.mask, MARGIN)
    traced = 0
    for number in range(seeds):
        image, used = _one_seed(case, window, photons, FIRST_SEED + number, radius)
        images.append(image)
        traced += used
        tell(f"reference: seed {number + 1} of {seeds}, {time.perf_counter() - began:.0f} s")
    stack = np.stack(images).astype(np.float64)
    mean = stack.mean(axis=0)
    inside = case.mask[window]
    spread = stack.var(axis=0, ddof=1) / seeds if seeds > 1 else np.full_like(mean, np.inf)
    noise = float(np.sqrt(spread[inside].mean()) / mean[inside].mean())
    radiance = np.zeros((*case.mask.shape, 3), dtype=np.float32)
    radiance[window] = mean
    known = np.zeros(case.mask.shape, dtype=bool)
    known[window] = True
    result = Reference(radiance, known, noise, traced, seeds, time.perf_counter() - began)
    CACHE.mkdir(exist_ok=True)
    temporary = path.with_name(f".{path.name}")
    with temporary.open("wb") as file:
        np.savez_compressed(file, **result.__dict__)
    temporary.replace(path)
    return result


def window_camera(whole: RayCamera, window: tuple[slice, slice]) -> WindowCamera:
    """Return the camera of the rows and columns of another camera's image."""
    rows, columns = window
    size = {"width": columns.stop - columns.start, "height": rows.stop - rows.start}
    own = {**whole.__dict__, **size}
    return WindowCamera(**own, whole=whole, left=int(columns.start), top=int(rows.start))


def _one_seed(
    case: Case, window: tuple[slice, slice], photons: int, seed: int, radius: float
) -> tuple[FloatArray, int]:
    """Return the radiance (rows, columns, 3) in the window, and the number of photons."""
    model = case.model
    camera = window_camera(model.camera(RESOLUTION), window)
    table = model.scenes.emitter_table
    per_light = max(1, min(PASS_PHOTONS, photons) // table.count)
    passes = max(1, round(photons / (per_light * table.count)))
    result = render_sppm(
        model.scenes.touched([ball()], [model.place(ball())]).full,
        Emission(table, model.guide(), per_light, seed),
        camera,
        passes,
        coloured=model.scenes.coloured,
        radius=radius,
    )
    dr.sync_thread()
    flux = [model.design.lights[name].channel_flux() for name in model.groups]
    image = sum(
        layer * np.asarray(channels, dtype=np.float32)
        for layer, channels in zip(result.layers, flux, strict=True)
    )
    return np.asarray(image, dtype=np.float32), result.photons


def _key(design: SensorDesign, seeds: int, photons: int, radius: float) -> str:
    """Return a name for the design's numbers and meshes, the contact and the settings."""
    digest = hashlib.sha256()
    asked = [DESIGN, CONTACT_TEXT, RESOLUTION, seeds, photons, radius, FIRST_SEED]
    digest.update(json.dumps(asked).encode())
    digest.update(design.model_dump_json().encode())
    for name, mesh in sorted(design.meshes.items()):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(mesh.triangles, dtype=np.float32).tobytes())
    return digest.hexdigest()[:16]
