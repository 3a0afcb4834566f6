"""Chief rays from the camera to the sensing surface, as lines to draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.design.section_drawing import DrawnRay

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

ACROSS = 13
"""Number of rays across the picture: odd, so that one runs along the camera's axis, and small, so
that the sensor is visible behind them.
"""


@dataclass(frozen=True)
class CameraRays:
    """Paths of a grid of chief rays through glass and by way of mirrors, with nothing pressed in.

    Attributes:
        rays: rays, row by row, from the picture's upper left.
        shape: number of rows and columns of the grid, both odd.
    """

    rays: list[DrawnRay]
    shape: tuple[int, int]

    @staticmethod
    def of(model: OpticalModel) -> CameraRays:
        """Trace the rays of a model.

        Raises:
            RenderError: the camera is invalid.
        """
        from optisense.optics.ray_paths import trace_paths
        from optisense.optics.transport.chief_rays import RayOutcome

        width, height = model.design.camera.resolution
        rows = 2 * max(1, round(ACROSS * height / width / 2)) + 1
        paths = trace_paths(model, (ACROSS, rows))
        lines = np.split(paths.vertices.astype(np.float64), np.cumsum(paths.counts)[:-1])
        arrived = (paths.outcomes == RayOutcome.HIT).tolist()
        return CameraRays(
            [DrawnRay(line, hit) for line, hit in zip(lines, arrived, strict=True)], (rows, ACROSS)
        )

    def in_section(self, along_rows: bool) -> list[DrawnRay]:
        """Return the rays of the middle row, or of the middle column, of the picture."""
        rows, columns = self.shape
        middle = rows // 2 * columns
        if along_rows:
            return self.rays[middle : middle + columns]
        return self.rays[columns // 2 :: columns]

    def segments(self) -> dict[str, NDArray[np.float32]]:
        """Return the ends of the segments of every second ray along rows and columns.

        Returns:
            Pairs of ends (2 k, 3), mm: "seen" for rays that reach the sensing surface, and "lost"
            for the others.
        """
        found: dict[str, list[NDArray[np.float64]]] = {"seen": [], "lost": []}
        for row in range(0, self.shape[0], 2):
            for column in range(0, self.shape[1], 2):
                ray = self.rays[row * self.shape[1] + column]
                pairs = np.repeat(ray.points, 2, axis=0)[1:-1]
                found["seen" if ray.arrived else "lost"].append(pairs)
        return {
            name: np.concatenate(pieces or [np.empty((0, 3))]).astype(np.float32)
            for name, pieces in found.items()
        }
