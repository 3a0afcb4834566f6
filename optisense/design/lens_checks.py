"""Check for lenses that show a point twice."""

from __future__ import annotations

from optisense.design.camera import Camera
from optisense.design.problems import Diagnostic
from optisense.design.projection import folding_angle


def fold_problems(camera: Camera, where: str) -> list[Diagnostic]:
    """Return the problem of a distortion that folds within the picture.

    Args:
        where: place of the lens's distortion in the design.
    """
    angle = folding_angle(camera)
    if angle is None:
        return []
    return [
        Diagnostic(
            f"the lens's distortion folds {angle:.3g} degrees off its axis, inside the picture: "
            "points beyond are shown twice, or some pixels show nothing",
            where,
            "Give coefficients nearer to 0, or a smaller field of view (fov); a calibration is "
            "valid only where its marks were",
        )
    ]
