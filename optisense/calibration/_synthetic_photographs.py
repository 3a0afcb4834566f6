"""Photographs of a model instead of a real sensor, for tests of a calibration with a known answer,
and a writer of folders of photographs.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from optisense.array_types import ByteArray
from optisense.calibration.layouts import BACKGROUND, PRESSES
from optisense.calibration.photographs import PhotographedPress, Photographs
from optisense.errors import CalibrationError
from optisense.geometry import Contact, Sphere
from optisense.picture_files import write_picture
from optisense.quality import PICTURE_PHOTONS
from optisense.writing import written_together

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

USUAL_NOISE = 2.0
"""Default standard deviation of the noise of photographs, in levels of 255: that of published ones
of a GelSight Mini.
"""


def photograph_model(
    model: OpticalModel,
    contacts: Sequence[Contact],
    *,
    exposure: float | None = None,
    resolution: tuple[int, int] | None = None,
    photons: int = PICTURE_PHOTONS,
    seed: int = 0,
    noise: float = USUAL_NOISE,
) -> Photographs:
    """Return photographs of a model as if it were a real sensor.

    Args:
        contacts: contacts of balls, one for each photograph.
        exposure: factor on the radiance; automatic if None.
        resolution: width and height in pixels; those of the camera if None.
        photons: number of photons of the light.
        seed: seed of light and noise.
        noise: standard deviation of the noise added to each pixel, levels.

    Raises:
        CalibrationError: an indenter is not a ball.
        OptiSenseError: the model can't be rendered.
    """
    balls = [each.indenter for each in contacts if isinstance(each.indenter, Sphere)]
    if len(balls) < len(contacts):
        raise CalibrationError(
            "only contacts of balls can be photographed for a calibration", hint="Press a Sphere"
        )
    blank = model.render(resolution=resolution, photons=photons, seed=seed)
    factor = blank.auto_exposure() if exposure is None else exposure
    rng = np.random.default_rng([seed, 17])

    def noisy(picture: ByteArray) -> ByteArray:
        levels = picture + noise * rng.standard_normal(picture.shape)
        return np.clip(np.round(levels), 0, 255).astype(np.uint8)

    presses = []
    for number, (contact, ball) in enumerate(zip(contacts, balls, strict=True), start=1):
        image = model.render([contact], resolution=resolution, photons=photons, seed=seed)
        picture = noisy(image.picture(factor))
        presses.append(PhotographedPress(f"press-{number:02}.png", picture, 2.0 * ball.radius))
    return Photographs(noisy(blank.picture(factor)), tuple(presses))


def save_photographs(folder: str | Path, photographs: Photographs) -> None:
    """Write photographs as a folder of `background.png`, `presses.csv` and the presses.

    Raises:
        OutputError: a file can't be written.
        CalibrationError: two presses have the same name, or a name is no name of a PNG file.
    """
    place = Path(folder)
    names = [press.name for press in photographs.presses]
    odd = [n for n in names if not n.endswith(".png") or Path(n).name != n or n == BACKGROUND]
    if odd or len(set(names)) < len(names):
        raise CalibrationError(
            "each press needs a name of its own that ends in .png",
            where=odd[0] if odd else "",
            hint="Rename them",
        )
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["file", "diameter", "column", "row", "radius"])
    for press in photographs.presses:
        column, row = press.centre or ("", "")
        radius = "" if press.radius is None else press.radius
        table.writerow([press.name, press.diameter, column, row, radius])
    with written_together("the photographs") as stage:
        write_picture(stage(place / BACKGROUND), photographs.background)
        for press in photographs.presses:
            write_picture(stage(place / press.name), press.picture)
        stage(place / PRESSES).write_text(text.getvalue(), encoding="utf-8")
