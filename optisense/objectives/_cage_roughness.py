"""Cage roughness: the unevenness of the displacements of the control points of cages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ObjectiveError
from optisense.geometry.cage import Resolution
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


@objective(
    "cage_roughness",
    title="Cage roughness",
    range=(0.0, math.inf),
    unit="mm",
    lower_is_better=True,
    rays_only=True,
    numbers=("largest",),
)
def cage_roughness(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The unevenness of the displacements of the control points of cages, in mm.

    It is the root mean square, over all points with two neighbours along an axis of the lattice, of
    the difference between a point's displacement and the mean displacement of these neighbours. It
    is 0 if the lattice is moved, stretched or sheared as a whole, which bends nothing. The value is
    that of the roughest cage; `largest` is the largest such difference.
    """
    found, largest = {}, 0.0
    for name, cage in evaluation.design.cages.items():
        moved = cage.offsets_at_rest()
        uneven = unevenness(moved, cage.resolution)
        found[name] = float(np.sqrt((uneven**2).mean())) if len(uneven) else 0.0
        largest = max(largest, float(uneven.max(initial=0.0)))
    if not found:
        raise ObjectiveError("the design has no cage", hint="Make a cage with optisense cage")
    return max(found.values()), {"of_cages": found, "largest": largest}


def unevenness(moved: NDArray[np.float64], resolution: Resolution) -> NDArray[np.float64]:
    """Return the distance (k,), mm, between the displacement of each control point and the mean
    displacement of its neighbours.

    Args:
        moved: (nx * ny * nz, 3) displacement of each point, mm.
        resolution: number of points along x, y and z.
    """
    ways = moved.reshape(*resolution, 3)
    found = [
        0.5 * np.linalg.norm(np.diff(ways, 2, axis=axis), axis=-1).ravel()
        for axis in range(3)
        if resolution[axis] > 2
    ]
    return np.concatenate(found) if found else np.zeros(0)
