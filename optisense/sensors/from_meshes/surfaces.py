"""Reference surfaces: faces selected from the mesh of a file or of another part."""

from __future__ import annotations

import numpy as np

from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.patches import (
    Faces,
    angle_to_nearest,
    faces_towards,
    patches,
    smoothly_joined,
)
from optisense.sensors.from_meshes.directions import direction_text, vector
from optisense.sensors.from_meshes.recipe_parts import ShapeReference

WITHIN = 30.0
"""Largest angle of a face's normal to the direction if the recipe gives none, degrees."""


def pick(mesh: TriangleMesh, shape: ShapeReference, where: str) -> list[Faces]:
    """Return the faces of a welded mesh that a shape selects, all without `towards`, as patches,
    the largest first.

    Raises:
        DesignError: no face points in that direction.
    """
    if shape.towards is None:
        return patches(mesh, np.flatnonzero(mesh.face_areas > 0.0))
    way, within = vector(shape.towards), WITHIN if shape.within is None else shape.within
    faces = faces_towards(mesh, way, within)
    if len(faces) == 0:
        nearest = angle_to_nearest(mesh, way)
        raise DesignError(
            f"no face points to {direction_text(shape.towards)} within {within:g} "
            f"degrees; the nearest one is {nearest:.0f} degrees off",
            where=where,
            hint="Change towards, the direction, or give a larger angle within",
        )
    if not shape.tangent:
        return patches(mesh, faces)
    # Each patch is grown separately: the largest region that is joined smoothly may point
    # elsewhere.
    grown: list[Faces] = []
    for patch in patches(mesh, faces):
        if not any(np.isin(patch[0], done) for done in grown):
            grown.append(smoothly_joined(mesh, patch))
    return sorted(grown, key=lambda group: -float(mesh.face_areas[group].sum()))


def chosen(mesh: TriangleMesh, shape: ShapeReference, where: str) -> tuple[TriangleMesh, list[str]]:
    """Return the faces that a shape selects as a separate mesh, and notes on omitted ones.

    Without `towards` it is the whole mesh; else the largest patch, unless all are requested.
    """
    if shape.towards is None:
        return mesh, []
    found = pick(mesh, shape, where)
    if shape.patches == "all" or len(found) == 1:
        return mesh.with_faces(mesh.faces[np.concatenate(found)]).compacted(), []
    left = sum(float(mesh.face_areas[patch].sum()) for patch in found[1:])
    count = "another patch" if len(found) == 2 else f"{len(found) - 1} smaller patches"
    taken = float(mesh.face_areas[found[0]].sum())
    note = (
        f"{count} of {left:.3g} mm2 beside the {taken:.3g} mm2 chosen "
        f"also point to {direction_text(shape.towards)}; 'patches: all' includes them"
    )
    return mesh.with_faces(mesh.faces[found[0]]).compacted(), [note]
