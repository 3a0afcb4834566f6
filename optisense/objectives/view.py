"""The share of the sensing surface that a camera sees, which every score depends on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.objectives._seen_area import seen_area
from optisense.objectives.settings import Settings
from optisense.percentages import told_apart

if TYPE_CHECKING:
    from optisense.optics import ChiefRays


@dataclass(frozen=True)
class View:
    """Measures of a camera's view of the untouched sensor.

    Attributes:
        picture: share of the pixels that see the sensing surface, 0 to 1.
        skin: share of the sensing surface's area that the pixels see, 0 to 1. It does not depend on
            the sizes of the mesh's triangles, and a place that is visible by two mirrors counts
            once.
    """

    picture: float
    skin: float

    def refuse_less(self, settings: Settings) -> None:
        """Raise ObjectiveError if the camera sees less than the settings require for a score."""
        if self.picture == 0.0:
            raise ObjectiveError(
                "the camera sees nothing of the sensing surface",
                hint="Check the camera's position, direction and field of view, and that the "
                "normals of the sensing surface point to its side",
            )
        for name, seen, least, what in (
            (
                "least_picture",
                self.picture,
                settings.least_picture,
                "of the pixels see the sensing surface",
            ),
            (
                "least_skin",
                self.skin,
                settings.least_skin,
                "of the sensing surface's area is seen",
            ),
        ):
            if seen < least:
                shown, needed = told_apart(seen, least)
                raise ObjectiveError(
                    f"only {shown} {what}, and a score needs {needed}",
                    hint="Check the camera's position, direction and field of view, or lower the "
                    f"setting '{name}'",
                )


def view_of(rays: ChiefRays, surface: TriangleMesh) -> View:
    """Return the view of chief rays.

    Args:
        rays: chief rays of the untouched sensor.
        surface: mesh of the sensing surface, mm.
    """
    return View(float(rays.hit.mean()), seen_area(rays, surface) / surface.area)
