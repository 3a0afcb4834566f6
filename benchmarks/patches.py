"""Errors of the light by patches of contacts, against Mitsuba's path tracer, in absolute units.

``python -m benchmarks.patches [--only CASE] [--dry]`` writes patches.json and patches.md beside
this file. A ball is pressed into a sensor. What the radiance cache gives in the contact is averaged
over patches (bands of tilt times quarters of azimuth), likewise in a ring of untouched skin around
it; the row of pixels between both, where skin and flank reflect each other at grazing angles, is
told apart. The path tracer knows nothing of photons, cells or bins. Its pictures are kept in
benchmarks/.cache, and its noise is taken off.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from benchmarks.reference import box_around
from benchmarks.results import measure_parts
from optisense import OpticalModel, sensors
from optisense.design import SensorDesign, set_value
from optisense.geometry import Contact, Sphere
from optisense.mechanics import CONFORMING
from optisense.optics import TactileImage
from optisense.optics.mitsuba_export import mitsuba_scene
from optisense.optics.scene import assembly
from optisense.optics.scene.surfaces import Region

FloatArray = NDArray[np.floating]
Mask = NDArray[np.bool_]

FOLDER = Path(__file__).parent
CACHE = FOLDER / ".cache"
RESOLUTION = (160, 120)
RADIUS = 1.5
"""mm: the ball that is pressed in."""
PHOTONS = 10_000_000
"""Of each image."""
SEEDS = (1, 2)
"""Of the images, which are averaged: what is looked for is not their noise."""
BATCHES = 8
"""Independent pictures of the path tracer, whose scatter tells its noise."""
SAMPLES = 16_384
"""Of the path tracer, per pixel and batch."""
PASS_SAMPLES = 1_024
"""Of one call of the path tracer."""
PATH_DEPTH = 64
"""Surfaces of a path; with metal, less than a thousandth of the light is beyond."""
TILTS = 5
"""Bands of tilt in the contact, each of as many pixels."""
QUARTERS = 4
"""Sectors of azimuth."""
RING = 12
"""Pixels: width of the ring of skin around the contact, beyond the rim."""
MARGIN = RING + 2


@dataclass(frozen=True)
class PatchCase:
    """A sensor with a coating and a ball.

    Attributes:
        sensor: its name; "gelsight360" gets a perspective camera, as Mitsuba has no other.
        specularity: of the coating.
        place: number of the place of `OpticalModel.nine_contacts`; 4 is the middle.
        depth: mm.
    """

    sensor: str
    specularity: float
    place: int = 4
    depth: float = 0.8

    @property
    def name(self) -> str:
        """For tables and file names."""
        return f"{self.sensor}, {self.specularity:g}, place {self.place}, {self.depth:g} mm"

    def design(self) -> SensorDesign:
        """The sensor's design."""
        design = set_value(sensors.build(self.sensor), "coating.specularity", self.specularity)
        if self.sensor == "gelsight360":
            design = set_value(design, "camera.projection", "perspective")
            design = set_value(design, "camera.fov", 100.0)
        return design

    def contact(self, model: OpticalModel) -> Contact:
        """The ball."""
        place = model.nine_contacts()[self.place].point
        assert place is not None
        return Contact(Sphere(radius=RADIUS), point=place, depth=self.depth)


CASES = [
    *(PatchCase("gelsight-mini", s) for s in (0.0, 0.3, 0.6, 0.8, 0.9, 1.0)),
    *(PatchCase("gelsight-mini", s, place=0) for s in (0.3, 0.6, 1.0)),
    *(PatchCase("gelsight-mini-cylindrical", s, depth=0.3) for s in (0.0, 0.4, 1.0)),
    *(PatchCase("gelsight-mini-spherical", s) for s in (0.0, 0.6, 1.0)),
    *(PatchCase("gelbelt", s) for s in (0.2, 0.6, 1.0)),
    *(PatchCase("gelsight-svelte", s) for s in (0.0, 0.6, 1.0)),
    *(PatchCase("gelsight360", s) for s in (0.0, 0.4, 1.0)),
]


@dataclass(frozen=True)
class Patches:
    """Numbers (h, w) of the patch that each pixel belongs to, -1 for none.

    Attributes:
        contact: by tilt and azimuth, `TILTS` times `QUARTERS`.
        skin: the ring around, by azimuth.
        rim: the row of pixels between, by azimuth.
    """

    contact: NDArray[np.integer]
    skin: NDArray[np.integer]
    rim: NDArray[np.integer]

    @classmethod
    def of(cls, image: TactileImage) -> Patches:
        """The patches of an image with one contact."""
        inside = image.contact_mask
        normals = image.normals
        around = ndimage.distance_transform_edt(~inside)
        ring = (around > 1.5) & (around <= RING) & np.isfinite(normals[..., 0])
        upright = np.nanmean(normals[ring], axis=0)
        upright /= np.linalg.norm(upright)
        tilt = np.arccos(np.clip(normals @ upright, -1, 1))
        order = np.argsort(np.argsort(tilt[inside]))
        band = np.zeros(inside.shape, dtype=int)
        band[inside] = order * TILTS // len(order)
        rows, columns = np.indices(inside.shape)
        turn = np.arctan2(columns - columns[inside].mean(), rows - rows[inside].mean())
        quarter = np.floor((turn / (2 * np.pi) + 1.125) * QUARTERS).astype(int) % QUARTERS
        return cls(
            np.where(inside, band * QUARTERS + quarter, -1),
            np.where(ring, quarter, -1),
            np.where((around > 0) & (around <= 1.0), quarter, -1),
        )


def means(image: FloatArray, patch: NDArray[np.integer]) -> FloatArray:
    """(patches, 3) means of an image (h, w, 3) over patches."""
    return np.array([image[patch == n].mean(axis=0) for n in range(patch.max() + 1)], dtype=float)


@dataclass(frozen=True)
class PathReference:
    """Pictures of the path tracer.

    Attributes:
        batches: (n, h, w, 3) radiance, zero outside the window.
        seconds: that they took.
    """

    batches: FloatArray
    seconds: float


def path_reference(case: PatchCase, model: OpticalModel, mask: Mask) -> PathReference:
    """The path tracer's pictures of a case, kept in a file."""
    digest = _digest(case.design())
    slug = case.name.replace(", ", "_").replace(" ", "-")
    path = CACHE / f"patches-{slug}-{SAMPLES}-{digest}.npz"
    if not path.is_file():
        began = time.perf_counter()
        batches = np.stack(list(_path_pictures(case, model, mask)))
        CACHE.mkdir(exist_ok=True)
        np.savez_compressed(
            path, batches=batches.astype(np.float32), seconds=time.perf_counter() - began
        )
    with np.load(path) as kept:
        return PathReference(kept["batches"].astype(np.float64), float(kept["seconds"]))


def _digest(design: SensorDesign) -> str:
    """A name for a design: its values, save those left as they are by default, and its meshes."""
    digest = hashlib.sha256(design.model_dump_json(exclude_defaults=True).encode())
    for name, mesh in sorted(design.meshes.items()):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(mesh.triangles, dtype=np.float32).tobytes())
    return digest.hexdigest()[:12]


def _path_pictures(case: PatchCase, model: OpticalModel, mask: Mask) -> Iterator[FloatArray]:
    parts = assembly.assemble(model.design)
    coat = assembly.coating_surface(model.design.coating, parts.ior_before, Region.INDENTER)
    pieces = [*parts.pieces, assembly.indenter_piece(model.place(case.contact(model)), coat)]
    flux = [tuple(model.design.lights[name].channel_flux().tolist()) for name in parts.groups]
    scene = mitsuba_scene(
        pieces,
        parts.emitters,
        model.camera(RESOLUTION),
        flux,
        samples=PASS_SAMPLES,
        max_depth=PATH_DEPTH,
    )
    rows, columns = box_around(mask, MARGIN)
    scene["sensor"]["film"] |= {
        "crop_offset_x": int(columns.start),
        "crop_offset_y": int(rows.start),
        "crop_width": int(columns.stop - columns.start),
        "crop_height": int(rows.stop - rows.start),
    }
    loaded = mi.load_dict(scene)
    passes = SAMPLES // PASS_SAMPLES
    for batch in range(BATCHES):
        total = np.zeros((*mask.shape, 3))
        for number in range(passes):
            seed = batch * passes + number
            picture = mi.render(loaded, spp=PASS_SAMPLES, seed=seed)
            total[rows, columns] += np.asarray(picture, dtype=np.float64) / passes
        yield total


def compare(
    image: FloatArray, truth: PathReference, patch: NDArray[np.integer], scale: FloatArray
) -> dict[str, float]:
    """How far an image is off over patches.

    Args:
        image: (h, w, 3).
        truth: the path tracer's.
        patch: (h, w) number of the patch of each pixel.
        scale: (3,) by which differences of channels are divided.

    Returns:
        rms: over all patches and channels, the path tracer's noise taken off. worst: of one patch.
        noise: RMS of the path tracer. red, green, blue: relative error of the whole.
    """
    each = np.array([means(batch, patch) for batch in truth.batches])
    variance = each.var(axis=0, ddof=1) / len(each)
    off = (means(image, patch) - each.mean(axis=0)) / scale
    noise = variance / scale**2
    whole = truth.batches.mean(axis=0)[patch >= 0].mean(axis=0)
    ratio = image[patch >= 0].mean(axis=0) / np.where(whole > 0, whole, 1.0) - 1
    found = {
        "rms": float(np.sqrt(max((off**2).mean() - noise.mean(), 0.0))),
        "worst": float(off.ravel()[np.abs(off).argmax()]),
        "noise": float(np.sqrt(noise.mean())),
        **dict(zip(("red", "green", "blue"), ratio.tolist(), strict=True)),
    }
    return {key: round(value, 5) for key, value in found.items()}


def measure(case: PatchCase, photons: int = PHOTONS) -> dict[str, Any]:
    """All numbers of a case."""
    model = OpticalModel(case.design())
    contact = case.contact(model)
    images = [
        model.render([contact], RESOLUTION, photons, seed=seed, skin=CONFORMING) for seed in SEEDS
    ]
    began = time.process_time()
    model.render([contact], RESOLUTION, photons, seed=SEEDS[-1], skin=CONFORMING)
    kept = time.process_time() - began
    radiance = np.mean([image.radiance for image in images], axis=0, dtype=np.float64)
    patches = Patches.of(images[0])
    truth = path_reference(case, model, images[0].contact_mask)
    model.forget_light()
    whole = truth.batches.mean(axis=0)
    found: dict[str, Any] = {"cpu_s_kept_light": round(kept, 3)}
    for name, patch in vars(patches).items():
        # The skin around a metal contact is dark; it is judged by its own light.
        scale = whole[(patches.contact if name == "contact" else patch) >= 0].mean(axis=0)
        found[name] = compare(radiance, truth, patch, np.where(scale > 0, scale, 1.0))
    return found


def main() -> None:
    """Measure, print and write."""
    measures = {case.name: partial(measure, case) for case in CASES}
    measure_parts("patches", __doc__, measures, table)


def table(found: dict[str, Any]) -> str:
    """The results as Markdown."""
    lines = [
        "# Errors of the light by patches of contacts", "",
        "Written by `python -m benchmarks.patches`; do not edit.", "",
        f"A ball of radius {RADIUS} mm is pressed in; {RESOLUTION[0]}x{RESOLUTION[1]} pixels, the "
        f"mean of {len(SEEDS)} images of {PHOTONS / 1e6:g} million photons, against Mitsuba's "
        f"`path` with {BATCHES * SAMPLES:,} samples a pixel, in absolute units. In per cent: RMS "
        f"over patches ({TILTS} bands of tilt times {QUARTERS} quarters of azimuth in the contact, "
        "quarters of the skin around it and of the row of pixels between both) and three channels, "
        "in relation to each channel's mean there, the path tracer's noise taken off; that noise; "
        "and by how much the means of the channels are off.", "",
        "| sensor, specularity, place, depth | where | RMS | noise of the reference | red | green "
        "| blue |", "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for name, row in found.items():
        for where in ("contact", "skin", "rim"):
            of = row[where]
            numbers = [f"{100 * of[key]:.1f}" for key in ("rms", "noise")]
            numbers += [f"{100 * of[key]:+.1f}" for key in ("red", "green", "blue")]
            lines.append(f"| {name} | {where} | " + " | ".join(numbers) + " |")
    lines += ["", "Cases without a row have not been measured yet."]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
