"""Comparison of a built-in sensor with a picture of a real one under the same press."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.design.colour import decode
from optisense.geometry import Contact, Sphere
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics import OpticalModel, RenderProgress

SENSOR = "gelsight-mini"
"""Built-in sensor of which there is a real picture."""

PICTURE = "gelsight-mini-ball.png"
"""Picture of a real GelSight Mini, 320 x 240; `real/NOTICE.md` names its source."""

BALL_RADIUS = 4.75
"""Radius of the ball in the picture, mm, as its publishers state it."""

BALL_PLACE = 261.8, 147.5
"""Column and row of the ball's middle in the picture, located in it to about 2.5 pixels."""

CONTACT_RADIUS = 2.1
"""Radius of the contact in the picture, mm: 33.5 pixels, at about 0.0625 mm per pixel."""

AROUND = 1.6
"""Distance from the ball, in radii of its contact, beyond which the background is measured, since
no shadow of the ball falls there.
"""

DARK, BRIGHT = 5.0, 95.0
"""Percentiles of the background between which its evenness is measured; single bright or dark
pixels do not change them."""


@dataclass(frozen=True)
class RealComparison:
    """Real picture, the model's picture of the same press, and measures of both.

    Attributes:
        real, model: pictures (h, w, 3), uint8; the model has the exposure at which its picture is
            closest to the real one.
        difference: root mean square difference of pixels, levels of 255.
        own_spread: root mean square deviation of the real picture's pixels from their mean, for
            comparison, levels.
        shares: shares (2, 3) of the real and of the model's light in red, green and blue.
        evenness: ratio (2, 3) of the linear brightness of the background's dark to bright parts.
        shading: correlation (3,) of both pictures' linear brightness over the ball.
    """

    real: NDArray[np.uint8]
    model: NDArray[np.uint8]
    difference: float
    own_spread: float
    shares: FloatArray
    evenness: FloatArray
    shading: FloatArray

    def rows(self) -> list[tuple[str, str, str]]:
        """Return labels and measures of the real and the model's picture, in red, green, blue."""
        shares, evenness = 100.0 * self.shares, self.evenness
        return [
            ("light in red / green / blue, %", _channels(shares[0], 0), _channels(shares[1], 0)),
            (
                "dark over bright parts of the background",
                _channels(evenness[0], 2),
                _channels(evenness[1], 2),
            ),
        ]


def has_real_picture(design: SensorDesign) -> bool:
    """Return whether a design is the sensor of the real picture."""
    from optisense.design.difference import differences
    from optisense.library import with_own_lights
    from optisense.sensors import load

    if set(design.parts) != set((built_in := load(SENSOR)).parts):
        return False
    return not differences(with_own_lights(built_in), with_own_lights(design))


def compare_with_real(
    model: OpticalModel,
    photons: int = PICTURE_PHOTONS,
    seed: int = 0,
    progress: Callable[[RenderProgress], None] | None = None,
) -> RealComparison | None:
    """Press the ball of the real picture into a model, at the same place and with the same contact
    radius.

    Returns:
        Comparison, or None if too few photons were traced for a picture.

    Args:
        model: model of a sensor for which `has_real_picture` is true.
        photons: number of photons; the light of an earlier image with as many is reused.
        progress: function that is called during the rendering; it may raise KeyboardInterrupt.

    Raises:
        KeyboardInterrupt: Ctrl-C ended the rendering.
        OptiSenseError: the model can't be rendered.
    """
    from optisense.calibration.model_pictures import levels_of, matched_exposure
    from optisense.errors import RenderError
    from optisense.picture_files import read_picture

    with as_file(files("optisense.report") / "real" / PICTURE) as path:
        real = read_picture(path, RenderError)
    height, width = real.shape[:2]
    column, row = BALL_PLACE
    x, y, z = model.chief_rays((width, height)).points[int(row), int(column)].tolist()
    depth = BALL_RADIUS - math.sqrt(BALL_RADIUS**2 - CONTACT_RADIUS**2)
    contact = Contact(Sphere(BALL_RADIUS), point=(x, y, z), depth=depth)
    image = model.render(
        [contact], resolution=(width, height), photons=photons, seed=seed, progress=progress
    )
    if not np.median(image.radiance) > 0.0:  # too few photons for a picture
        return None
    chain = image.chain.without_noise()
    exposure = matched_exposure(image.radiance, chain, real)
    drawn = np.round(levels_of(image.radiance, chain, exposure)).clip(0, 255).astype(np.uint8)
    linear, seen = decode(real), decode(drawn)
    rows, columns = np.mgrid[:height, :width] + 0.5
    radius = math.sqrt(image.contact_mask.sum() / math.pi)
    away = np.hypot(columns - column, rows - row) > AROUND * radius
    mask = image.contact_mask
    backgrounds = [linear[away], seen[away]]
    edges = [np.percentile(each, [DARK, BRIGHT], axis=0) for each in backgrounds]
    levels = real.astype(np.float64)
    return RealComparison(
        real=real,
        model=drawn,
        difference=_rms(drawn - levels),
        own_spread=_rms(levels - levels.mean(axis=(0, 1))),
        shares=np.array([each.mean(axis=0) / each.mean(axis=0).sum() for each in backgrounds]),
        evenness=np.array([dark / bright for dark, bright in edges]),
        shading=np.array(
            [np.corrcoef(linear[mask][:, c], seen[mask][:, c])[0, 1] for c in range(3)]
        ),
    )


def _channels(values: FloatArray, digits: int) -> str:
    return " / ".join(f"{value:.{digits}f}" for value in values)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt((values**2).mean()))
