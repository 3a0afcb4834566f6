"""Frosted and painted faces of parts: their triangles, and checks of the finishes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from optisense.design.fields import InconsistentValueError, Steps
from optisense.design.materials import Material, kinds_for
from optisense.design.parts import TRANSPARENT_SOLIDS, FaceFinish, Part, Role
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.patches import angle_to_nearest, faces_towards
from optisense.near import suggestion

BOX_TOLERANCE = 1e-6
"""Distance by which faces may protrude from a box that selects them, mm, for rounding."""


def check_finishes(name: str, part: Part, materials: Mapping[str, Material]) -> None:
    """Refuse finishes of parts that can't have them, and paints that are no opaque materials.

    Raises:
        InconsistentValueError: the part is no transparent solid, or a paint unknown or transparent.
    """
    for label, finish in (part.faces or {}).items():
        path: Steps = ("parts", name, "faces", label)
        if part.role is Role.SENSING_SURFACE:
            raise InconsistentValueError(
                f"part '{name}' is a sensing_surface: it has the coating, and can't be frosted "
                "or painted",
                path,
                "Change the coating, or name faces of the elastomer that it does not cover",
            )
        if part.role not in TRANSPARENT_SOLIDS:
            raise InconsistentValueError(
                f"part '{name}' ({part.role.value}) is no transparent solid, whose faces can be "
                "frosted or painted",
                path,
                "Give the part another material",
            )
        if finish.paint is None:
            continue
        if finish.paint not in materials:
            raise InconsistentValueError(
                f"faces '{label}' of part '{name}' are painted with an unknown material "
                f"'{finish.paint}'",
                (*path, "paint"),
                suggestion(finish.paint, materials),
            )
        if Role.BLOCKER not in materials[finish.paint].roles:
            raise InconsistentValueError(
                f"material '{finish.paint}' is no paint: it is a {materials[finish.paint].kind}",
                (*path, "paint"),
                "Use a material of kind " + " or ".join(kinds_for(Role.BLOCKER)),
            )


def finished_faces(
    mesh: TriangleMesh, finish: FaceFinish, name: str, where: str
) -> NDArray[np.int64]:
    """Return the indices (k,) of the triangles of a part at rest that a finish selects, at least
    one; messages have the name of part and faces, and the place in the file.

    Raises:
        DesignError: the finish selects no face; the message has the direction of the nearest.
    """
    chosen = np.flatnonzero(mesh.face_areas > 0.0)
    hint = None
    if finish.direction is not None:
        chosen = faces_towards(mesh, finish.direction, finish.within)
        off = angle_to_nearest(mesh, finish.direction)
        hint = (
            f"The nearest face looks {off:.1f} degrees off: turn the direction, or widen 'within'"
        )
    if finish.box is not None and len(chosen):
        corners = mesh.triangles[chosen]
        low, high = np.array(finish.box)
        out = (corners < low - BOX_TOLERANCE) | (corners > high + BOX_TOLERANCE)
        chosen = chosen[~out.any(axis=(1, 2))]
        span = " to ".join("({:.3g}, {:.3g}, {:.3g})".format(*corner) for corner in mesh.bounds)
        hint = f"Triangles must lie in the box wholly; the part spans {span} mm"
    if not len(chosen):
        raise DesignError(f"there are no faces {name}", where=where, hint=hint)
    return chosen
