"""View of a design from its camera: a picture, its chief rays, and their distortion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.errors import OptiSenseError, SetupError
from optisense.objectives import Evaluation, Settings, evaluate
from optisense.quality import PICTURE_PHOTONS
from optisense.report.camera_rays import CameraRays
from optisense.report.trial_pictures import Ball, find_balls, nine_balls

ACROSS = 320
"""Width of each of the two pictures compared, pixels: both fit side by side on a page."""

STRETCHED = 90.0
"""Percentile of the pixels' stretching that represents the worst tenth."""


@dataclass(frozen=True)
class RayFigures:
    """Measures of a design that follow from chief rays alone; NaN where they are undefined.

    Attributes:
        aoap: score AOAP.
        coverage: share of the sensing surface's area that the camera sees.
        upright: mean cosine between ray and surface normal, over all pixels.
        seeing: share of the pixels that see the surface.
        evenness: score 2to3PW.
        stretching: median over the pixels of the ratio of length to width on the surface of a small
            circle of the picture; 1 is undistorted.
        worst_stretching: stretching that a tenth of the pixels exceed.
        map: stretching (h, w) of each pixel, NaN where there is none.
    """

    aoap: float
    coverage: float
    upright: float
    seeing: float
    evenness: float
    stretching: float
    worst_stretching: float
    map: NDArray[np.float64] = field(repr=False)


@dataclass(frozen=True)
class DesignView:
    """View of a design from its camera. Fields are None if they could not be computed or were not
    requested.

    Attributes:
        picture: picture (h, w, 3), uint8, with nine balls pressed in.
        balls: balls in the picture.
        pressed: radius and depth of the balls, mm.
        figures: measures of the chief rays.
        rays: chief rays to draw.
        failure: reason why a field is missing.
    """

    picture: NDArray[np.uint8] | None = None
    balls: tuple[Ball, ...] = ()
    pressed: tuple[float, float] | None = None
    figures: RayFigures | None = None
    rays: CameraRays | None = None
    failure: str | None = None


def design_view(
    design: SensorDesign,
    settings: Mapping[str, Any] | None = None,
    *,
    pictures: bool = True,
    photons: int = PICTURE_PHOTONS,
) -> DesignView:
    """Trace a design's chief rays, and render it with the balls that its objectives press into it.

    Args:
        settings: settings of the objectives, of which ball, depth and ray resolution are used.
        pictures: whether to render; the rays alone take a tenth of a second.
        photons: number of photons for the picture.

    Raises:
        SetupError: the renderer can't run on this machine.
    """
    from optisense.optics import OpticalModel

    taken = ("radius", "depth", "ray_resolution", "skin")
    shared = Settings(**{key: value for key, value in (settings or {}).items() if key in taken})
    found: dict[str, Any] = {}
    try:
        model = OpticalModel(design)
        found["rays"] = CameraRays.of(model)
        found["figures"] = ray_figures(Evaluation(model, shared))
        if pictures:
            found["pressed"] = shared.radius, shared.depth
            image, contacts = nine_balls(model, shared, ACROSS, photons)
            found["picture"] = image.picture()
            places = np.array([contact.point for contact in contacts], dtype=np.float64)
            found["balls"] = find_balls(image.points, image.contact_mask, places)
    except SetupError:
        raise
    except OptiSenseError as error:
        return DesignView(**found, failure=str(error))
    return DesignView(**found)


def ray_figures(evaluation: Evaluation) -> RayFigures:
    """Return the measures of a sensor's chief rays.

    Raises:
        RenderError, ObjectiveError: the rays can't be traced.
    """
    from optisense.optics.transport.chief_rays import pixel_stretching

    scores = evaluate(evaluation, ["aoap", "2to3pw"])
    parts = scores["aoap"].parts
    stretching = pixel_stretching(evaluation.chief_rays)
    known = stretching[np.isfinite(stretching)]
    middle, worst = np.percentile(known, [50.0, STRETCHED]) if len(known) else (np.nan, np.nan)
    return RayFigures(
        aoap=scores["aoap"].value,
        coverage=parts.get("coverage_by_area", np.nan),
        upright=parts.get("mean_cosine", np.nan),
        seeing=parts.get("pixels_that_see_the_surface", np.nan),
        evenness=scores["2to3pw"].value,
        stretching=float(middle),
        worst_stretching=float(worst),
        map=stretching,
    )
