"""Picture chain: from the light of a scene to the picture that a camera stores.

The order is that of a real camera:

1. the lens: blur;
2. the sensor: crosstalk between the channels, the shading by lens and pixels, which is measured of
   each channel, overexposure (`CameraResponse`), stray light, noise, black level, full pixels;
3. its processor: the black level is subtracted, the shading corrected, the colours are balanced and
   mixed by a matrix, levels are clipped, and the tone curve gives what is stored.

A sensor saturates before its processor amplifies, so a white pixel of the picture may be a clipped
red. Noise is added before pixels are full, so that a pixel far beyond that is white, and before the
gains, with which it grows.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.design.fields import Colour, PositiveRGB
from optisense.design.lenses.blur import LEAST_WIDTH, LensBlur, LensView, blurred, reach_of
from optisense.design.lenses.film import PictureWindow, film_coordinates, film_places
from optisense.design.lenses.shading import LensShading
from optisense.design.responses.base import EXPOSURE_TARGET, CameraResponse, FullWellResponse
from optisense.design.responses.electronics import (
    BlackLevel,
    ChannelMatrix,
    NoiseSeed,
    SensorNoise,
    mixed,
    normal_numbers,
)
from optisense.design.responses.tone_curve import ToneCurve

LEAST_ROOM = 0.2
"""Smallest share of its target that automatic exposure gives to the light, where stray light and
black level leave less: the picture is then brighter than the target, but still shows the light."""

USUAL_RESPONSE = FullWellResponse()
"""Response of a camera whose design names none."""


@dataclass(frozen=True)
class SoftFocus:
    """Blur of a lens over the picture.

    Attributes:
        deviation: standard deviation over the camera's film as a share of the picture's width,
            (h, w) or (1, 1).
        film: height of the film over its width; that of each picture if None.
    """

    deviation: FloatingArray
    film: float | None = None

    @classmethod
    def of(
        cls, blur: LensBlur, camera: LensView, vergences: FloatingArray | None = None
    ) -> SoftFocus:
        """Return the blur of a lens.

        It has the same standard deviation in all directions: the root mean square of those in the
        two principal planes, so that its variance is that of the astigmatic blur.

        Args:
            vergences: the principal vergences (h, w, 2), 1/mm; needed if it depends on depth.
        """
        given = np.zeros((1, 1, 1)) if vergences is None else vergences
        deviation = np.broadcast_to(blur.deviation(camera, given), given.shape)
        width, height = camera.resolution
        return cls(np.sqrt(np.mean(np.square(deviation), axis=-1)), height / width)

    def in_pixels(self, window: PictureWindow) -> FloatingArray:
        """Return the standard deviation (h, w), in pixels, for a window of a picture."""
        from scipy.ndimage import map_coordinates  # takes a third of a second to load

        rows, columns = self.deviation.shape
        across, down = film_coordinates(window.height, window.width, self.film)
        at = np.meshgrid(
            down[window.rows] * rows - 0.5, across[window.columns] * columns - 0.5, indexing="ij"
        )
        return window.width * map_coordinates(self.deviation, at, order=1, mode="nearest")

    def span(self, width: int) -> tuple[float, float]:
        """Return the smallest and largest standard deviation in a picture of a width, pixels."""
        return width * float(self.deviation.min()), width * self.largest

    @property
    def largest(self) -> float:
        """Largest standard deviation, as a share of the picture's width."""
        return float(self.deviation.max())


@dataclass(frozen=True)
class PictureChain:
    """All steps of a camera from radiance to the stored picture.

    Steps that are None are left out; a chain with only a response does what that response does.

    Attributes:
        response: saturation of its sensor.
        focus: blur of its lens.
        crosstalk: shares of the R, G and B of the light in each channel of the sensor.
        shading: dimming of each channel by position, and the share that its processor corrects.
        stray_light: uniform light on the sensor at R, G and B, as shares of a full pixel.
        noise: noise of its sensor.
        black_level: black level of its sensor, and the share that is subtracted.
        white_balance: gains of R, G and B.
        colour_matrix: matrix by which its processor mixes R, G and B.
        tone_curve: curve of the stored levels, in place of the response's own curve.
        film: height of the camera's film over its width, on which the shading is given; that of
            each picture if None.
    """

    response: CameraResponse = field(default_factory=lambda: USUAL_RESPONSE)
    focus: SoftFocus | None = None
    crosstalk: ChannelMatrix | None = None
    shading: LensShading | None = None
    stray_light: Colour | None = None
    noise: SensorNoise | None = None
    black_level: BlackLevel | None = None
    white_balance: PositiveRGB | None = None
    colour_matrix: ChannelMatrix | None = None
    tone_curve: ToneCurve | None = None
    film: float | None = None

    @property
    def is_plain(self) -> bool:
        """True if the response alone makes the picture, apart from its tone curve."""
        lens = (self.shading, self.focus, self.crosstalk, self.stray_light)
        sensor = (self.noise, self.black_level, self.white_balance, self.colour_matrix)
        return all(each is None for each in (*lens, *sensor))

    def without_noise(self) -> PictureChain:
        """Return the same camera without noise, as the mean of many pictures has none."""
        return self if self.noise is None else replace(self, noise=None)

    def respond(
        self, exposed: FloatingArray, window: PictureWindow | None = None, seed: NoiseSeed = 0
    ) -> NDArray[np.float32]:
        """Return the linear levels (h, w, 3), 0 to 1, from which the tone curve makes the picture.

        Args:
            exposed: radiance times the exposure, (h, w, 3), of a picture or of a part of it.
            window: window of the part, if it is one.
            seed: seed of the noise; the same one gives a pixel the same noise.
        """
        place = window or PictureWindow.whole(*exposed.shape[:2])
        if self.is_plain:
            return self.response.respond(exposed, place.width)
        level = self.response.light_in_pixels(self._on_sensor(exposed, place), place.width)
        return self._processed(self._read(level, place, seed), place)

    def linear(self, exposed: FloatingArray) -> NDArray[np.float32]:
        """Return levels (h, w, 3) without noise, overexposure and clipping.

        These levels are additive: those of a sum of lights are the sum of their levels.

        Args:
            exposed: radiance times the exposure, (h, w, 3).
        """
        if self.is_plain:
            return np.asarray(exposed, dtype=np.float32)
        window = PictureWindow.whole(*exposed.shape[:2])
        transmission = None if self.shading is None else self._transmission(window)
        level = self._balanced(self._on_sensor(exposed, window), transmission)
        return np.asarray(level, dtype=np.float32)

    def _on_sensor(self, exposed: FloatingArray, window: PictureWindow) -> FloatingArray:
        """Return the levels that fill the pixels of the sensor, before they saturate."""
        level: FloatingArray = np.asarray(exposed, dtype=np.float32)
        if self.focus is not None:
            level = blurred(level, self.focus.in_pixels(window), self.focus.span(window.width))
        if self.crosstalk is not None:
            level = mixed(level, self.crosstalk)
        return level if self.shading is None else level * self._transmission(window)

    def _read(self, level: FloatingArray, window: PictureWindow, seed: NoiseSeed) -> FloatingArray:
        """Return the sensor's output for filled pixels, minus the black level."""
        if self.stray_light is not None:
            level = level + np.array(self.stray_light, dtype=np.float32)
        if self.noise is not None:
            normal = normal_numbers(seed, window.height, window.width)[window.box]
            level = self.noise.add(level, normal)
        if self.black_level is not None:
            return self.black_level.subtract(self.black_level.read(level))
        return np.clip(level, 0.0, 1.0)

    def _processed(self, level: FloatingArray, window: PictureWindow) -> NDArray[np.float32]:
        """Return the processor's output for levels above black."""
        level = self._balanced(level, None if self.shading is None else self._transmission(window))
        return np.clip(level, 0.0, 1.0).astype(np.float32, copy=False)

    def _balanced(self, level: FloatingArray, transmission: FloatingArray | None) -> FloatingArray:
        if self.shading is not None and transmission is not None:
            level = level * self.shading.correction(transmission).astype(np.float32)
        if self.white_balance is not None:
            level = level * np.array(self.white_balance, dtype=np.float32)
        return level if self.colour_matrix is None else mixed(level, self.colour_matrix)

    def _transmission(self, window: PictureWindow) -> FloatingArray:
        assert self.shading is not None
        shown = _Shown(self.shading, self.shading.model_dump_json())
        return _transmission(shown, window.height, window.width, self.film)[window.box]

    def metered(
        self,
        radiance: FloatingArray,
        where: NDArray[np.bool_] | None = None,
        target: float | None = None,
    ) -> NDArray[np.floating]:
        """Return the input of automatic exposure: levels, proportional to the exposure, that reach
        the target at the exposure at which the picture's levels do.

        The picture's are the larger of the levels on the sensor and those after its processor,
        without blur, noise and overexposure. Stray light and a black level that is not subtracted
        leave less for the light: the levels are divided by the share of the target that is left,
        which counts as `LEAST_ROOM` if it is smaller.

        Args:
            radiance: radiance (h, w, 3) of a picture, or (n, 3) of the pixels of a mask.
            where: mask (h, w).
            target: level in the picture, the full one if None.
        """
        if self.is_plain:
            return radiance
        reached = self.full_level() if target is None else target
        level: FloatingArray = np.asarray(radiance, dtype=np.float32)
        transmission = None
        if self.crosstalk is not None:
            level = mixed(level, self.crosstalk)
        if self.shading is not None:
            height, width = radiance.shape[:2] if where is None else where.shape
            whole = self._transmission(PictureWindow.whole(height, width))
            transmission = whole if where is None else whole[where]
            level = level * transmission
        stray = np.array(self.stray_light or (0.0, 0.0, 0.0), dtype=np.float32)
        if self.black_level is None:
            lit, dark = level, stray
        else:
            lit, dark = (
                self.black_level.scale() * level,
                self.black_level.subtract(self.black_level.read(stray)),
            )
        return np.maximum(
            _with_room(level, stray, reached),
            _with_room(
                self._balanced(lit, transmission), self._balanced(dark, transmission), reached
            ),
        )

    def auto_exposure(self, radiance: FloatingArray) -> float:
        """Return the exposure, a factor on radiance (h, w, 3), for a well exposed picture."""
        target = EXPOSURE_TARGET * self.full_level()
        return self.response.auto_exposure(self.metered(radiance, target=target))

    def full_level(self) -> float:
        """Return the level that automatic exposure must not exceed."""
        return self.response.full_level()

    def reach(self, width: int) -> int:
        """Return the distance, pixels, over which light in one pixel changes others, in a picture
        of a width, pixels.
        """
        own = self.response.reach(width)
        return own if not self._softens(width) else own + reach_of(self._largest, width)

    def spreads(self, exposed: FloatingArray, window: PictureWindow | None = None) -> bool:
        """Return whether light in some pixel changes others.

        Args:
            exposed: radiance times the exposure, (h, w, 3), of a picture or of a part of it.
            window: window of the part, if it is one.
        """
        if self.is_plain:
            return self.response.spreads(exposed)
        place = window or PictureWindow.whole(*exposed.shape[:2])
        return self._softens(place.width) or self.response.spreads(self._on_sensor(exposed, place))

    @property
    def _largest(self) -> float:
        return 0.0 if self.focus is None else self.focus.largest

    def _softens(self, width: int) -> bool:
        return self._largest * width >= LEAST_WIDTH

    def curve(self, linear: FloatingArray) -> NDArray[np.float64]:
        """Return the stored levels (...), 0 to 1 before rounding, of linear levels (...)."""
        return (self.tone_curve or self.response).curve(linear)

    def encode(self, linear: FloatingArray) -> NDArray[np.uint8]:
        """Return the stored levels (...) in 8 bits of linear levels (...), 0 to 1."""
        return (self.tone_curve or self.response).encode(linear)


def _with_room(lit: FloatingArray, dark: FloatingArray, target: float) -> FloatingArray:
    """Return levels (..., 3) of light, divided by the share of a target that levels in the dark,
    (3,) or (..., 3), leave.
    """
    if not dark.any():
        return lit
    return lit / np.maximum(1.0 - dark / np.float32(target), np.float32(LEAST_ROOM))


@dataclass(frozen=True)
class _Shown:
    """Shading that is compared by its numbers."""

    shading: LensShading = field(compare=False)
    data: str


@lru_cache(maxsize=4)
def _transmission(shown: _Shown, height: int, width: int, film: float | None) -> FloatingArray:
    found = shown.shading.transmission(film_places(height, width, film)).astype(np.float32)
    found.setflags(write=False)
    return found
