"""Draft: the smallest draft angle of bent sheets on the mould that they are formed on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ObjectiveError
from optisense.objectives._bend_radius import mostly_above
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.geometry import TriangleMesh
    from optisense.objectives.evaluation import Evaluation


@objective(
    "draft",
    title="Draft",
    range=(-90.0, 90.0),
    unit="degrees",
    rays_only=True,
    numbers=(),
)
def draft(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The smallest draft angle of the sheets that cages bend, in degrees.

    A sheet is pulled off its mould along the mean of its normals, by area. The draft of a place is
    the angle between the surface there and this direction: 90 where the mould is flat, 0 where its
    wall is parallel to the direction, and negative in an undercut, where the sheet cannot be
    removed. Castings usually need 1 to 3 degrees. One hundredth of a sheet's area may be steeper,
    as in `bend_radius`. Closed bodies are left out; a gel is formed by the skin on it.
    """
    design = evaluation.design
    bent = design.deformed_meshes()
    names = dict.fromkeys(part for cage in design.cages.values() for part in cage.parts)
    found = {name: draft_of(bent[name]) for name in names if not bent[name].is_closed}
    if not found:
        raise ObjectiveError(
            "no cage bends a sheet of the design", hint="Make a cage with optisense cage"
        )
    return min(found.values()), {"of_parts": found}


def draft_of(mesh: TriangleMesh) -> float:
    """Return the draft angle (degrees) that all but `SHARE` of a sheet's area exceed."""
    normals, areas = mesh.face_normals, mesh.face_areas
    pull: NDArray[np.float64] = (normals * areas[:, None]).sum(axis=0)
    length = float(np.linalg.norm(pull))
    if length <= 0.0:  # a closed ring: half of it is undercut for any direction of removal
        return -90.0
    angles = np.degrees(np.arcsin(np.clip(normals @ pull / length, -1.0, 1.0)))
    return mostly_above(angles, areas)
