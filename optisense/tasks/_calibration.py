"""Calibration of a simulated sensor by the usual method for real ones: balls are pressed at known
places, and a reader of the surface's tilt from colours is fitted to the pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from optisense.array_types import FloatArray
from optisense.design.difference import fingerprint
from optisense.errors import ContactError, TaskError
from optisense.geometry import Contact, Sphere
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays
from optisense.reading.camera_noise import add_camera_noise
from optisense.reading.integration import NormalIntegrator
from optisense.reading.tilts import normals_of, tilts_of
from optisense.reading.untouched import UntouchedSurface
from optisense.tasks._colour_to_normal import METHODS, TiltReader, fit_reader
from optisense.tasks._draws import Places
from optisense.tasks._sample_settings import SampleRendering

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, TactileImage

WIDTH = 320
"""Default width of the pictures (pixels), that of GelSight's own software."""

MOST_SAMPLES = 20_000
"""Largest number of pixels that a reader is fitted to, drawn from all presses, which bounds the
time of the fit."""

ATTEMPTS = 50
"""Number of presses tried for each one that is needed, as some miss the surface or the view; where
50 fail, the sensor or the settings are at fault.
"""

LEAST_PIXELS = 20
"""Smallest number of pixels of a seen contact; fewer contribute little to the fit of a reader."""

QUIET = 3.0
"""Difference from the untouched picture (levels of 255, in each channel) below which the tilt is
read as 0, twice the usual noise: small errors over a flat surface would add up in the depth."""

QUIET_BLUR = 1.5
"""Standard deviation (pixels) of the Gaussian blur of a picture before it is compared with the
untouched one; it averages the noise of some 28 pixels.
"""

_PLACE, _CAMERA, _SAMPLES, _SENSOR = 5, 6, 7, 10
"""Numbers that are hashed with the seed, one for each kind of random draw, so that the draws are
independent. They are unique among the modules of this package."""

_NEXT_READER = 1009
"""Offset of seeds between the readers of a fit: a prime larger than usual differences of seeds."""


@dataclass(frozen=True)
class ReconstructionSettings(SampleRendering):
    """Settings of the fit and the test of a reader.

    Attributes:
        method: "network" or "table" (see `colour_to_normal`).
        presses: number of balls that the reader is fitted to.
        radius: radius of these balls, mm.
        depth: smallest and largest depth (mm); the largest sets the steepest slope learned.
        seed: seed of places, depths, noise and network.
        camera_noise: standard deviation of the noise of all pictures, levels of 255.
        resolution: (width, height) pixels; if None, `width` wide in the camera's proportions.
        width: width (pixels) if no resolution is given.
        photons: number of photons of the light that all pictures share.
        skin: "elastic" or "conforming"; see docs/mechanics.md.
    """

    method: str = "network"
    presses: int = 40
    radius: float = 1.5
    depth: tuple[float, float] = (0.2, 0.6)
    width: int = WIDTH

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.method not in METHODS:
            raise TaskError(
                f"there is no method '{self.method}'", hint="Use one of " + ", ".join(METHODS)
            )
        low, high = self.depth
        if not (self.presses >= 1 and self.radius > 0 and 0 < low <= high <= self.radius):
            raise TaskError(
                f"{self.presses} presses of a ball of {self.radius:g} mm, {low:g} to {high:g} mm "
                "deep, are impossible",
                hint="Press at least one ball, above 0 mm and not deeper than its radius",
            )


class CalibratedSensor:
    """A simulated sensor to which a reader of tilts has been fitted by ball presses."""

    def __init__(
        self,
        model: OpticalModel,
        settings: ReconstructionSettings,
        progress: Callable[[int], None] = lambda done: None,
        readers: int = 1,
        kept: KeptArrays = NOTHING_KEPT,
    ) -> None:
        """Press the balls and fit the reader.

        Args:
            settings: settings of presses and reader.
            progress: function that is called with the number of balls pressed.
            readers: number of readers fitted to the same presses, each to other pixels and with
                another seed, so that the variation between fits can be separated from the sensor.
            kept: store of the balls' pixels.
        """
        self._model = model
        self._settings = settings
        self.resolution = settings.resolution or model.design.camera.size_at(settings.width)
        self.untouched = UntouchedSurface.of(model.chief_rays(self.resolution))
        self._frames = model.surface.tangents(self.untouched.normals)
        self._integrator = NormalIntegrator(self.untouched)
        blank = self._render([])
        self._exposure = blank.auto_exposure()
        # The background of a real sensor is the mean of many pictures and so has no noise.
        self._background = blank.without_noise().picture(self._exposure).astype(np.float64)
        self.inputs: tuple[object, ...] = (fingerprint(model.design), settings)
        learned = []
        for index in range(settings.presses):
            progress(index)
            inputs = ["ball", *self.inputs, index]
            learned.append(kept.arrays(inputs, partial(self._press, index), ["pixels"])["pixels"])
        known = np.concatenate(learned)
        self.fitted_pixels = min(len(known), MOST_SAMPLES)
        self.readers = readers
        self._readers = [self._fitted(known, number) for number in range(readers)]

    def _fitted(self, known: FloatArray, number: int) -> TiltReader:
        """Fit a reader to colours, places and tilts (n, 7); its number changes its seeds."""
        settings = self._settings
        if len(known) > MOST_SAMPLES:
            seed = [settings.seed, _SAMPLES, *([number] if number else [])]
            rng = np.random.default_rng(seed)
            known = known[rng.choice(len(known), MOST_SAMPLES, replace=False)]
        seed_of_fit = (settings.seed + _NEXT_READER * number) % 2**32
        return fit_reader(settings.method, known[:, :3], known[:, 3:5], known[:, 5:], seed_of_fit)

    def read(self, picture: NDArray[np.uint8], reader: int = 0) -> tuple[FloatArray, FloatArray]:
        """Return normals (h, w, 3) and depth (h, w), mm, that a reader finds in a picture."""
        seen = self.untouched.seen
        colours, places = self._features(picture)
        tilts = np.zeros((*seen.shape, 2))
        changed = np.abs(gaussian_filter(colours, (QUIET_BLUR, QUIET_BLUR, 0))).max(axis=2) >= QUIET
        read = seen & changed
        if read.any():
            tilts[read] = self._readers[reader].tilts(colours[read], places[read])
        normals = normals_of(tilts, *self._frames, self.untouched.normals)
        return normals, self._integrator.depths(normals)

    def take_picture(
        self, contact: Contact, number: int = 0
    ) -> tuple[TactileImage, NDArray[np.uint8]]:
        """Return the image of a contact, and the picture (h, w, 3) that the camera stores; each
        number of a picture has noise of its own.
        """
        image = self._render([contact])
        seed = [self._settings.seed, self._settings.presses + number, _CAMERA]
        return image, self._picture(image, seed)

    def _press(self, index: int) -> dict[str, FloatArray]:
        """Return colours, places and tilts (n, 7) of pixels in, near and far from a ball press."""
        settings = self._settings
        image = None
        for attempt in range(ATTEMPTS):
            rng = np.random.default_rng([settings.seed, index, _PLACE, attempt])
            x, y, z = self._places.draw(rng)[0].tolist()
            ball = Contact(
                Sphere(settings.radius), point=(x, y, z), depth=float(rng.uniform(*settings.depth))
            )
            try:
                image = self._render([ball])
            except ContactError:
                continue
            if image.contact_mask.sum() >= LEAST_PIXELS:
                break
        else:
            if image is not None:
                width, height = self.resolution
                raise TaskError(
                    f"a ball of {settings.radius:g} mm covers {image.contact_mask.sum()} pixels of "
                    f"a picture of {width}x{height}, and a reader needs {LEAST_PIXELS}",
                    hint="Use larger pictures, press deeper, or check the camera's direction",
                )
            raise TaskError(
                f"no ball of {settings.radius:g} mm could be pressed within the camera's view",
                hint="Press less deep, or check the camera's direction",
            )
        assert image is not None
        colours, places = self._features(self._picture(image, [settings.seed, index, _CAMERA]))
        tilts = tilts_of(image.normals, *self._frames)
        chosen = _pixels_to_learn(image.contact_mask, self.untouched.seen, rng)
        return {"pixels": np.hstack([colours[chosen], places[chosen], tilts[chosen]])}

    @cached_property
    def _places(self) -> Places:
        return Places.of(self._model, self.resolution)

    def _render(self, contacts: Sequence[Contact]) -> TactileImage:
        return self._settings.render(self._model, contacts, self.resolution)

    def _picture(self, image: TactileImage, seed: list[int]) -> NDArray[np.uint8]:
        picture = image.picture(self._exposure, (*seed, _SENSOR))
        return add_camera_noise(picture, self._settings.camera_noise, seed)

    def _features(self, picture: NDArray[np.uint8]) -> tuple[FloatArray, FloatArray]:
        """Return the colour differences (h, w, 3), levels of 255, and places (h, w, 2)."""
        height, width = picture.shape[:2]
        y, x = np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")
        return picture - self._background, np.stack([x, y], axis=-1)


def _pixels_to_learn(
    inside: NDArray[np.bool_], seen: NDArray[np.bool_], rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels that a reader is fitted to.

    It selects all pixels of a contact, half as many around it, where its shadow falls, and half as
    many elsewhere, so that the reader learns that those are not tilted.
    """
    count = int(inside.sum())
    chosen = inside & seen
    reach = 2.0 * np.sqrt(count / np.pi)
    near = distance_transform_edt(~inside) < reach
    for region in (near & ~inside & seen, ~near & seen):
        pixels = np.flatnonzero(region)
        kept = rng.permutation(pixels)[: count // 2]
        chosen.flat[kept] = True
    return chosen
