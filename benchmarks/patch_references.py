"""Pictures that patches of contacts are compared with, kept in benchmarks/.cache.

Mitsuba's `path` knows nothing of photons, cells or bins. Where it is too slow, light tracing takes
its place: it shares the photon pass and the surfaces with the radiance cache, but neither cells,
bins, kernels nor shading. Its photons fly through the scene with the ball in it, and each is seen
where it lands, without a gather radius. Where both were compared, they agree within their noise.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.light_tracing import light_traced
from benchmarks.mitsuba_export import mitsuba_scene
from benchmarks.reference import box_around, window_camera
from optisense import OpticalModel
from optisense.design import SensorDesign
from optisense.geometry import Contact
from optisense.optics.scene import assembly
from optisense.optics.scene.surfaces import Region

FloatArray = NDArray[np.floating]
Window = tuple[slice, slice]
Render = Callable[[int], FloatArray]
"""Renders the picture of the window (rows, columns, 3) for a number of a batch."""

CACHE = Path(__file__).parent / ".cache"
PATH_SAMPLES = 4_096
"""Number of the path tracer's samples per pixel in a batch."""
PASS_SAMPLES = 1_024
"""Number of samples per pixel in one call of the path tracer."""
PATH_DEPTH = 64
"""Largest number of surfaces of a path; with metal, longer paths carry less than a thousandth of
the light."""
LIGHT_PASSES = 4
"""Number of photon passes in a batch of light tracing."""
LIGHT_PHOTONS = 1_000_000
"""Number of photons in a pass, whose landings take 50 MB."""
FIRST_SEED = 9_000
"""Seed of the first batch of photons, far from the seeds of the judged images."""


class Referee(StrEnum):
    """Renderer of a reference."""

    PATH = "path"
    LIGHT = "light"


def reference(
    referee: Referee,
    model: OpticalModel,
    contact: Contact,
    mask: NDArray[np.bool_],
    margin: int,
    batches: int,
) -> FloatArray:
    """Return independent pictures (batches, h, w, 3) of a reference renderer, zero outside a window
    around the contact. Each is cached in a file.

    Args:
        referee: reference renderer.
        model: sensor.
        contact: contact.
        mask: mask (h, w) of the pixels that see the contact.
        margin: width of the margin around the contact, pixels.
        batches: number of pictures.
    """
    kind = f"{PATH_SAMPLES}" if referee is Referee.PATH else f"{LIGHT_PASSES}x{LIGHT_PHOTONS}"
    shape = mask.shape
    name = _digest(model.design, [f"{contact.point}, {contact.depth}", repr(shape), kind])
    window = box_around(mask, margin)
    pictures = np.zeros((batches, *shape, 3))
    render = None
    for batch in range(batches):
        path = CACHE / f"patches-{referee}-{name}-{batch}.npy"
        if not path.is_file():
            if render is None:
                make = _path if referee is Referee.PATH else _light
                render = make(model, contact, shape, window)
            CACHE.mkdir(exist_ok=True)
            unfinished = path.with_name(f".{path.name}")
            np.save(unfinished, render(batch).astype(np.float32))
            unfinished.replace(path)
        pictures[batch][window] = np.load(path)
    return pictures


def _digest(design: SensorDesign, more: list[str]) -> str:
    """Return a name for a design (its values that are not defaults, its meshes) and for texts."""
    digest = hashlib.sha256(design.model_dump_json(exclude_defaults=True).encode())
    for name, mesh in sorted(design.meshes.items()):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(mesh.triangles, dtype=np.float32).tobytes())
    for text in more:
        digest.update(text.encode())
    return digest.hexdigest()[:12]


def _path(model: OpticalModel, contact: Contact, shape: tuple[int, int], window: Window) -> Render:
    parts = assembly.assemble(model.design)
    coat = assembly.coating_surface(model.design.coating, parts.ior_before, Region.INDENTER)
    pieces = [*parts.pieces, assembly.indenter_piece(model.place(contact), coat)]
    flux = [tuple(model.design.lights[name].channel_flux().tolist()) for name in parts.groups]
    scene = mitsuba_scene(
        pieces,
        parts.emitters,
        model.camera(shape[::-1]),
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

    def render(batch: int) -> FloatArray:
        total = np.zeros((rows.stop - rows.start, columns.stop - columns.start, 3))
        for number in range(passes):
            picture = mi.render(loaded, spp=PASS_SAMPLES, seed=batch * passes + number)
            total += np.asarray(picture, dtype=np.float64) / passes
        return total

    return render


def _light(model: OpticalModel, contact: Contact, shape: tuple[int, int], window: Window) -> Render:
    camera = window_camera(model.camera(shape[::-1]), window)
    scene = model.scenes.touched([contact], [model.place(contact)]).full
    render = light_traced(model, scene, camera, LIGHT_PHOTONS, LIGHT_PASSES)
    return lambda batch: render(FIRST_SEED + batch)
