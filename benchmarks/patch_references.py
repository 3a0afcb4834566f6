"""Pictures that patches of contacts are compared with, kept in benchmarks/.cache.

Mitsuba's `path` knows nothing of photons, cells or bins. Where it is too slow, or has no such
camera, progressive photon mapping takes its place: it shares the photon pass and the surfaces with
the radiance cache, but neither cells, bins, kernels nor shading. Its photons fly through the scene
with the ball in it and are gathered one by one.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.mitsuba_export import mitsuba_scene
from benchmarks.reference import WindowCamera, box_around
from optisense import OpticalModel
from optisense.design import SensorDesign
from optisense.geometry import Contact
from optisense.optics import TactileImage
from optisense.optics.imaging.sppm import render_sppm
from optisense.optics.scene import assembly
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.photons import Emission

FloatArray = NDArray[np.floating]
Window = tuple[slice, slice]

CACHE = Path(__file__).parent / ".cache"
BATCHES = 8
"""Number of independent pictures, whose scatter gives the noise of the reference."""
PATH_SAMPLES = 16_384
"""Number of the path tracer's samples per pixel and batch."""
PASS_SAMPLES = 1_024
"""Number of samples per pixel in one call of the path tracer."""
PATH_DEPTH = 64
"""Largest number of surfaces of a path; with metal, longer paths carry less than a thousandth of
the light."""
SPPM_PASSES = 8
"""Number of photon passes in a batch."""
SPPM_PHOTONS = 1_000_000
"""Number of photons in a pass."""
SPPM_RADIUS = 0.08
"""Gather radius (mm) of the first pass of a batch; that of pass n is smaller by a factor of
n^(1/6). It is two thirds of a pixel of GelSight Mini. With 0.3 mm, discs of the row of pixels at
the rim lie half on the skin and half on the ball, and miss 20 to 30 % of the light of a mirroring
flank. At a specularity of 0.8, 0.16 mm makes this row 1.7 to 3.4 % darker than 0.08 mm does, so
that the reference is likely to be too dark there by about as much."""
SPPM_SAMPLES = 8
"""Camera samples of each pixel in a pass, whose discs together cover the pixel several times. With
one, the noise is twice as large."""
FIRST_SEED = 9_000
"""Seed of the first batch of photons, far from the seeds of the judged images."""


class Referee(StrEnum):
    """Renderer of a reference."""

    PATH = "path"
    SPPM = "sppm"


@dataclass(frozen=True)
class Reference:
    """Independent pictures of a reference renderer.

    Attributes:
        batches: radiance (n, h, w, 3), zero outside the window.
        seconds: processor time of all pictures, s.
    """

    batches: FloatArray
    seconds: float


def reference(
    referee: Referee, model: OpticalModel, contact: Contact, image: TactileImage, margin: int
) -> Reference:
    """Return the pictures of a reference renderer, which are cached in a file.

    Args:
        referee: reference renderer.
        model: sensor.
        contact: contact.
        image: image that is judged; its contact mask determines the window.
        margin: width of the margin around the contact, pixels.
    """
    kind = f"{SPPM_PASSES}-{SPPM_SAMPLES}-{SPPM_RADIUS:g}"
    if referee is Referee.PATH:
        kind = str(PATH_SAMPLES)
    known = [
        f"{contact.point}, {contact.depth}",
        repr(image.contact_mask.shape),
        kind,
        str(BATCHES),
    ]
    path = CACHE / f"patches-{referee}-{_digest(model.design, known)}.npz"
    if not path.is_file():
        began = time.process_time()
        window = box_around(image.contact_mask, margin)
        make = _path_pictures if referee is Referee.PATH else _sppm_pictures
        batches = np.zeros((BATCHES, *image.contact_mask.shape, 3))
        for number, picture in enumerate(make(model, contact, image, window)):
            batches[number][window] = picture
        CACHE.mkdir(exist_ok=True)
        seconds = time.process_time() - began
        np.savez_compressed(path, batches=batches.astype(np.float32), seconds=seconds)
    with np.load(path) as kept:
        return Reference(kept["batches"].astype(np.float64), float(kept["seconds"]))


def _digest(design: SensorDesign, more: list[str]) -> str:
    """Return a name for a design (its values that are not defaults, its meshes) and for texts."""
    digest = hashlib.sha256(design.model_dump_json(exclude_defaults=True).encode())
    for name, mesh in sorted(design.meshes.items()):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(mesh.triangles, dtype=np.float32).tobytes())
    for text in more:
        digest.update(text.encode())
    return digest.hexdigest()[:12]


def _path_pictures(
    model: OpticalModel, contact: Contact, image: TactileImage, window: Window
) -> Iterator[FloatArray]:
    parts = assembly.assemble(model.design)
    coat = assembly.coating_surface(model.design.coating, parts.ior_before, Region.INDENTER)
    pieces = [*parts.pieces, assembly.indenter_piece(model.place(contact), coat)]
    flux = [tuple(model.design.lights[name].channel_flux().tolist()) for name in parts.groups]
    height, width = image.contact_mask.shape
    scene = mitsuba_scene(
        pieces,
        parts.emitters,
        model.camera((width, height)),
        flux,
        samples=PASS_SAMPLES,
        max_depth=PATH_DEPTH,
    )
    rows, columns = window
    scene["sensor"]["film"] |= {
        "crop_offset_x": int(columns.start),
        "crop_offset_y": int(rows.start),
        "crop_width": int(columns.stop - columns.start),
        "crop_height": int(rows.stop - rows.start),
    }
    loaded = mi.load_dict(scene)
    passes = PATH_SAMPLES // PASS_SAMPLES
    for batch in range(BATCHES):
        total = np.zeros((rows.stop - rows.start, columns.stop - columns.start, 3))
        for number in range(passes):
            picture = mi.render(loaded, spp=PASS_SAMPLES, seed=batch * passes + number)
            total += np.asarray(picture, dtype=np.float64) / passes
        yield total


def _sppm_pictures(
    model: OpticalModel, contact: Contact, image: TactileImage, window: Window
) -> Iterator[FloatArray]:
    height, width = image.contact_mask.shape
    whole = model.camera((width, height))
    rows, columns = window
    part = {
        **whole.__dict__,
        "width": columns.stop - columns.start,
        "height": rows.stop - rows.start,
    }
    camera = WindowCamera(**part, whole=whole, left=int(columns.start), top=int(rows.start))
    scene = model.scenes.touched([contact], [model.place(contact)]).full
    guide = model.guide()
    per_light = max(1, SPPM_PHOTONS // model.scenes.emitter_table.count)
    flux = [model.design.lights[name].channel_flux() for name in model.groups]
    for batch in range(BATCHES):
        found = render_sppm(
            scene,
            Emission(model.scenes.emitter_table, guide, per_light, FIRST_SEED + batch),
            camera,
            SPPM_PASSES,
            coloured=model.scenes.coloured,
            radius=SPPM_RADIUS,
            samples=SPPM_SAMPLES,
        )
        dr.sync_thread()
        yield np.einsum("ghwc,gc->hwc", found.layers.astype(np.float64), np.array(flux))
