"""What a search has changed: pictures, coverage and numbers of two designs, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.errors import OptiSenseError, SetupError
from optisense.geometry import Sphere
from optisense.objectives import Evaluation, Settings, evaluate

PHOTONS = 1_000_000
"""Of a picture on the page: enough to look at."""

ACROSS = 320
"""Pixels across a picture."""


@dataclass(frozen=True)
class Look:
    """How a design looks from its camera.

    Attributes:
        picture: (h, w, 3) uint8, with nine balls pressed in; None where it can't be rendered.
        coverage: part of the sensing surface's triangles that the camera sees; None likewise.
        facts: more numbers, by name.
        failure: why something is missing.
    """

    picture: NDArray[np.uint8] | None = None
    coverage: float | None = None
    facts: Mapping[str, float] = field(default_factory=dict)
    failure: str | None = None


def look(
    design: SensorDesign,
    settings: Mapping[str, Any] | None = None,
    *,
    photons: int = PHOTONS,
    seed: int = 0,
) -> Look:
    """Render a design with the balls that its objectives press into it.

    Args:
        design: the sensor.
        settings: of the objectives, whose ball, depth and resolution of the rays are taken.
        photons: to trace.
        seed: of the light.

    Raises:
        SetupError: the renderer can't run on this machine.
    """
    from optisense.optics import OpticalModel

    taken = ("radius", "depth", "ray_resolution")
    shared = Settings(**{key: value for key, value in (settings or {}).items() if key in taken})
    width, height = design.camera.resolution
    size = ACROSS, max(1, round(ACROSS * height / width))
    try:
        model = OpticalModel(design)
        score = evaluate(Evaluation(model, shared), "aoap")
        if score.failure is not None:
            return Look(failure=score.failure)
        facts = {
            "upright rays (mean cosine)": score.parts["mean_cosine"],
            "pixels that see the surface": score.parts["pixels_that_see_the_surface"],
        }
        contacts = model.nine_contacts(Sphere(shared.radius), shared.depth)
        image = model.render(contacts, resolution=size, photons=photons, seed=seed)
    except SetupError:
        raise
    except OptiSenseError as error:
        return Look(failure=str(error))
    if image.interrupted:
        raise KeyboardInterrupt
    return Look(image.picture(), score.parts["coverage"], facts)
