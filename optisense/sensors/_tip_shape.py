"""Profile of a round fingertip, from flat over round to conical, and its parallel curves.

The tip is the set of points within a rounding radius of a core. The core is a cone; with a height
of 0 it is a disc and the tip is flat, with a radius of 0 too it is a point and the tip is a
hemisphere. Because every surface of the sensor (coating, gel, shell) has the same core and its own
rounding, they are parallel to one another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.sensors._shapes import arc

FEWEST = 6
"""Smallest number of pieces of a rounded edge or nose, so that small ones still look round."""


@dataclass(frozen=True)
class TipShape:
    """Family of parallel profiles: a wall, a rounded edge, a cone, a rounded nose.

    Attributes:
        core: radius of the cone inside, mm.
        cone: height of this cone, mm.
        shoulder: z at which the wall ends and the edge begins, mm.
        edge: largest rounding, mm, which determines the number of pieces of the profiles.
    """

    core: float
    cone: float
    shoulder: float
    edge: float

    @staticmethod
    def of_family(
        position: float, radius: float, height: float, least_edge: float, cone: float
    ) -> TipShape:
        """Return a member of the family from flat (0) over a hemisphere (0.5) to conical (1).

        Halfway the core is a point. Towards both ends its radius grows evenly to `radius -
        least_edge`, and towards 1 its height grows evenly to `cone` (all mm). The points of a
        profile with one normal therefore move on straight lines, like those of a mesh in a cage.
        """
        away = abs(2.0 * position - 1.0)
        core = (radius - least_edge) * away
        cone_here = cone * max(0.0, 2.0 * position - 1.0)
        shoulder = height - cone_here - (radius - core)
        return TipShape(core=core, cone=cone_here, shoulder=shoulder, edge=radius - core)

    @property
    def lean(self) -> float:
        """Angle of the cone's normal above the horizontal, degrees; 90 is flat."""
        return math.degrees(math.atan2(self.core, self.cone)) if self.cone > 0.0 else 90.0

    def profile(self, rounding: float, tessellation: float) -> NDArray[np.float64]:
        """Return the curve that lies `rounding` (above 0, at most `edge`, mm) outside the core.

        It is r and z, (n, 2) mm, from the foot of the wall (core + rounding, 0) to the axis; n is
        the same for all roundings, and so is the normal at each point. A piece of the largest
        profile is about `tessellation` mm long.
        """
        lean = self.lean
        slant = math.hypot(self.core, self.cone)
        top = self.shoulder + self.cone

        def pieces(length: float, least: int = 1) -> int:
            return max(least, math.ceil(length / tessellation))

        edge_pieces = pieces(self.edge * math.radians(lean), FEWEST)
        edge = arc((self.core, self.shoulder), rounding, 0.0, lean, edge_pieces)
        nose = np.array([[0.0, top + rounding]])
        if self.cone > 0.0:
            nose_pieces = pieces(self.edge * math.radians(90.0 - lean), FEWEST)
            nose = arc((0.0, top), rounding, lean, 90.0, nose_pieces)
        foot = np.array([self.core + rounding, 0.0])
        parts = [_between(foot, edge[0], pieces(self.shoulder)), edge[:-1]]
        if slant > 0.0:
            parts.append(_between(edge[-1], nose[0], pieces(slant)))
        points = np.concatenate([*parts, nose])
        points[-1, 0] = 0.0
        return points


def _between(
    start: NDArray[np.float64], end: NDArray[np.float64], pieces: int
) -> NDArray[np.float64]:
    """Return points from `start` on, without `end`, (pieces, 2)."""
    share = np.arange(pieces)[:, None] / pieces
    return np.asarray((1.0 - share) * start + share * end)
