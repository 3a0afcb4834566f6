"""Pictures that patches of contacts are compared with, kept in benchmarks/.cache.

Mitsuba's `path` knows nothing of photons, cells or bins. Where it is too slow, light tracing takes
its place: it shares the photon pass and the surfaces with the radiance cache, but neither cells,
bins, kernels nor shading. Its photons fly through the scene with the ball in it, and each is seen
where it lands, without a gather radius. Where both were compared, they agree within their noise.

`benchmarks.fine_references` makes pictures with less noise on a GPU; where there are enough of
them, they are used.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.light_tracing import light_traced
from benchmarks.mitsuba_export import PATH_DEPTH, mitsuba_scene
from benchmarks.mitsuba_path import scene_with
from benchmarks.reference import window_camera
from optisense import OpticalModel
from optisense.design import SensorDesign
from optisense.geometry import Contact
from optisense.optics.imaging._film import box_around
from optisense.optics.scene import assembly

FloatArray = NDArray[np.floating]
Window = tuple[slice, slice]
Render = Callable[[int], FloatArray]
"""Renders the picture of the window (rows, columns, 3) for a number of a batch."""

CACHE = Path(__file__).parent / ".cache"
PASS_SAMPLES = 1_024
"""Number of samples per pixel in one call of the path tracer."""
LIGHT_PASSES = 4
"""Number of photon passes in a batch of light tracing."""
FEWEST_FINE = 4
"""Number of fine pictures from which on they are used: the variance of the mean of fewer is too
uncertain."""
MOST_FINE = 64
"""Largest number of fine pictures of a case."""
CHIEF_DEPTH = 12
"""Largest number of surfaces that a ray of `ray_offset_shift` meets: more than the interfaces and
mirrors in front of any built-in sensor's skin."""
LAST_NUMBER = 1 - 2**-16
"""Random number at the end of the unit interval, in single precision."""
FIRST_SEED = 9_000
"""Seed of the first batch of photons, far from the seeds of the judged images."""


class Referee(StrEnum):
    """Renderer of a reference."""

    PATH = "path"
    LIGHT = "light"


@dataclass(frozen=True)
class Effort:
    """Work for a picture of a reference.

    Attributes:
        samples: number of the path tracer's samples per pixel.
        photons: number of photons in each of the `LIGHT_PASSES` passes of light tracing.
    """

    samples: int
    photons: int

    def name(self, referee: Referee) -> str:
        """Return the effort in the digest of a picture's file."""
        if referee is Referee.PATH:
            return f"{self.samples} of {PATH_DEPTH} surfaces"
        return f"{LIGHT_PASSES}x{self.photons}"

    def count(self, referee: Referee) -> int:
        """Return the number of samples per pixel or of photons of a picture."""
        return self.samples if referee is Referee.PATH else LIGHT_PASSES * self.photons


USUAL = Effort(4_096, 1_000_000)
"""Effort for a processor. The landings of a million photons take 50 MB."""
FINE = Effort(16_384, 16_000_000)
"""Effort for a GPU with 8 GB of memory: more photons in a pass keep it busy."""


@dataclass(frozen=True)
class Reference:
    """Region of a sensor's image that a reference renderer shows.

    Attributes:
        referee: reference renderer.
        model: sensor.
        contact: contact.
        mask: mask (h, w) of the pixels that see the contact.
        margin: width of the margin around the contact, pixels.
    """

    referee: Referee
    model: OpticalModel
    contact: Contact
    mask: NDArray[np.bool_]
    margin: int

    @property
    def window(self) -> Window:
        """The rows and columns around the contact that are rendered."""
        return box_around(self.mask, self.margin)

    def paths(self, effort: Effort, batches: int) -> list[Path]:
        """Return the files of independent pictures, which may not exist."""
        more = [
            f"{self.contact.point}, {self.contact.depth}",
            repr(self.mask.shape),
            effort.name(self.referee),
        ]
        name = _digest(self.model.design, more)
        return [CACHE / f"patches-{self.referee}-{name}-{batch}.npy" for batch in range(batches)]

    def renderer(self, effort: Effort) -> Render:
        """Return the function that renders the window around the contact."""
        return self._path(effort) if self.referee is Referee.PATH else self._light(effort)

    def pictures(self, batches: int) -> tuple[FloatArray, int]:
        """Return independent pictures (n, h, w, 3), zero outside a window around the contact, and
        the number of samples per pixel or of photons of all of them.

        All fine pictures are returned if there are at least `FEWEST_FINE`; otherwise `batches`
        usual ones, which are rendered unless they are in the cache.
        """
        effort = FINE
        paths = [path for path in self.paths(FINE, MOST_FINE) if path.is_file()]
        if len(paths) < FEWEST_FINE:
            effort = USUAL
            paths = self.paths(USUAL, batches)
        found = np.zeros((len(paths), *self.mask.shape, 3))
        render = None
        for batch, path in enumerate(paths):
            if not path.is_file():
                render = render or self.renderer(effort)
                save_picture(path, render(batch))
            found[batch][self.window] = np.load(path)
        return found, len(paths) * effort.count(self.referee)

    def _path(self, effort: Effort) -> Render:
        rows, columns = self.window
        height, width = self.mask.shape
        scene = scene_with(self.model, self.contact, (width, height), PASS_SAMPLES)
        scene["sensor"]["film"] |= {
            "crop_offset_x": int(columns.start),
            "crop_offset_y": int(rows.start),
            "crop_width": int(columns.stop - columns.start),
            "crop_height": int(rows.stop - rows.start),
        }
        loaded = mi.load_dict(scene)
        passes = effort.samples // PASS_SAMPLES

        def render(batch: int) -> FloatArray:
            total = np.zeros((rows.stop - rows.start, columns.stop - columns.start, 3))
            for number in range(passes):
                picture = mi.render(loaded, spp=PASS_SAMPLES, seed=batch * passes + number)
                total += np.asarray(picture, dtype=np.float64) / passes
            return total

        return render

    def _light(self, effort: Effort) -> Render:
        camera = window_camera(self.model.camera(self.mask.shape[::-1]), self.window)
        scene = self.model.scenes.touched([self.contact], [self.model.place(self.contact)]).full
        render = light_traced(self.model, scene, camera, effort.photons, LIGHT_PASSES)
        return lambda batch: render(FIRST_SEED + batch)


def ray_offset_shift(model: OpticalModel, mask: NDArray[np.bool_]) -> tuple[float, float]:
    """Return by how many pixels, to the right and down, the path tracer's view of the pixels of a
    mask (h, w) is shifted.

    Mitsuba starts rays off surfaces, by up to 0.006 mm at 60 mm from the origin. Behind the mirrors
    of GelSight Svelte, which are met at grazing angles, the picture of a contact is shifted by 0.06
    pixels by this, which changes its narrow highlights by 5 %. Elsewhere the shift is below 0.002
    pixels.
    """
    camera = model.camera(mask.shape[::-1])
    parts = assembly.assemble(model.design)
    flux = [(1.0, 1.0, 1.0)] * len(parts.groups)
    scene = mi.load_dict(mitsuba_scene(parts.pieces, parts.emitters, camera, flux))
    points = model.chief_rays(mask.shape[::-1]).points
    right, down = (np.gradient(points, axis=axis) for axis in (1, 0))
    seen = mask & np.isfinite(right + down).all(axis=-1)
    rows, columns = np.nonzero(seen)
    ray = mi.Ray3f(*camera.rays(mi.Float(columns + 0.5), mi.Float(rows + 0.5)))
    onward = dr.full(mi.Bool, True, len(rows))
    end = dr.zeros(mi.Point3f, len(rows))
    for _ in range(CHIEF_DEPTH):
        hit = scene.ray_intersect(ray, onward)
        onward &= hit.is_valid()
        end = dr.select(onward, hit.p, end)
        bsdf = hit.bsdf(ray)
        onward &= mi.has_flag(bsdf.flags(), mi.BSDFFlags.Delta)
        # The last of the random numbers chooses the refracted lobe of an interface.
        lobe, _ = bsdf.sample(mi.BSDFContext(), hit, mi.Float(LAST_NUMBER), mi.Point2f(0), onward)
        ray = hit.spawn_ray(hit.to_world(lobe.wo))
    off = np.asarray(end).T - points[seen]
    steps = np.stack([right[seen], down[seen]], axis=-1)
    across, along = np.median((np.linalg.pinv(steps) @ off[..., None])[..., 0], axis=0)
    return float(across), float(along)


def save_picture(path: Path, picture: FloatArray) -> None:
    """Write a picture of the cache, whole or not at all."""
    path.parent.mkdir(exist_ok=True)
    unfinished = path.with_name(f".{path.name}")
    np.save(unfinished, picture.astype(np.float32))
    unfinished.replace(path)


def _digest(design: SensorDesign, more: list[str]) -> str:
    """Return a name for a design (its values that are not defaults, its meshes) and for texts."""
    digest = hashlib.sha256(design.model_dump_json(exclude_defaults=True).encode())
    for name, mesh in sorted(design.meshes.items()):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(mesh.triangles, dtype=np.float32).tobytes())
    for text in more:
        digest.update(text.encode())
    return digest.hexdigest()[:12]
