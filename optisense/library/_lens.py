"""Check that the numbers of a camera's lens agree with each other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

LENS_MISFIT = 0.1
"""Largest relative difference between the focal length and that of the field of view. Vendors round
and lenses distort; of the Raspberry Pi cameras the worst is off by 5 %, half of this."""

PROJECTIONS: dict[str, Callable[[float], float]] = {
    "perspective": lambda half: float(np.tan(half)) if half < np.pi / 2.0 else np.inf,
    "equidistant": lambda half: half,
}
"""Ratio of image height to focal length for a ray at an angle (radians) to the axis."""


def lens_misfit(
    projection: str,
    fov: float,
    resolution: tuple[int, int],
    pixel_size: float | None,
    focal_length: float | None,
) -> tuple[str, str] | None:
    """Return the problem of a field of view that does not fit the focal length and image width.

    A perspective lens of focal length f shows 2 atan(w / 2f) across a width w, an equidistant one w
    / f.

    Args:
        projection: perspective or equidistant.
        fov: field of view across the image width, degrees.
        resolution: pixels of the sensor, width and height.
        pixel_size: pixel size, micrometres.
        focal_length: focal length, mm.

    Returns:
        The problem and its remedy; None if they agree within `LENS_MISFIT`, or if the focal length
        or the pixel size is unknown.
    """
    if pixel_size is None or focal_length is None:
        return None
    width, height = (0.001 * pixel_size * pixels for pixels in resolution)

    def misfit(size: float, law: str) -> float:
        """Return the relative difference of the focal length from that of such a lens."""
        with np.errstate(over="ignore", divide="ignore"):  # infinity is a misfit, too
            focal = 0.5 * size / PROJECTIONS[law](np.radians(0.5 * fov))
            return float(abs(focal / focal_length - 1.0))

    if misfit(width, projection) <= LENS_MISFIT:
        return None
    half = 0.5 * width / focal_length
    angle = np.degrees(2.0 * (half if projection == "equidistant" else np.arctan(half)))
    message = (
        f"a field of view of {fov:g} degrees does not fit a focal length of {focal_length:g} mm "
        f"and an image {width:.3g} mm wide ({resolution[0]} pixels of {pixel_size:g} "
        f"micrometres): as {projection} they give {angle:.1f} degrees"
    )
    other = "perspective" if projection == "equidistant" else "equidistant"
    reasons = [
        (
            misfit(float(np.hypot(width, height)), projection),
            "It fits the image's diagonal: give the angle across the width",
        ),
        (
            misfit(height, projection),
            "It fits the image's height: give the angle across the width",
        ),
        (misfit(width, other), f"It fits another projection: give 'projection: {other}'"),
    ]
    least, reason = min(reasons)
    if least > LENS_MISFIT:
        reason = (
            "Correct the one that is wrong; where the lens fits no projection, leave out "
            "focal_length"
        )
    return message, reason
