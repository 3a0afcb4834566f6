"""Check that a gel is held by a part of its design, as an unbonded gel resists no press."""

from __future__ import annotations

from functools import lru_cache

from optisense.design import SensorDesign
from optisense.design.parts import Role
from optisense.errors import ContactError
from optisense.geometry import TriangleMesh
from optisense.geometry.coincidence import boxes_overlap, find_coincident
from optisense.geometry.overlaps import find_overlap, touching_vertices
from optisense.geometry.rays import GLUE


def is_attached(design: SensorDesign) -> bool:
    """Return whether any part of a design other than the skin touches its gel."""
    meshes = design.deformed_meshes()
    gels = [meshes[name] for name in design.parts_of(Role.ELASTOMER)]
    others = [
        meshes[name]
        for name, part in design.parts.items()
        if part.role not in (Role.ELASTOMER, Role.SENSING_SURFACE, Role.INDENTER)
    ]
    return any(_hold_each_other(gel, other) for gel in gels for other in others)


def refuse_loose_gel(design: SensorDesign) -> None:
    """Raise if a design has a gel that no part holds.

    Raises:
        ContactError: nothing touches the gel but the skin.
    """
    names = design.parts_of(Role.ELASTOMER)
    if names and not is_attached(design):
        raise ContactError(
            f"the gel ('{names[0]}') is attached to nothing: no part touches it but the skin, so "
            "it resists no press",
            where=design.where("parts", names[0]),
            hint=f"Add a support that lies on its far side, to {GLUE:g} mm, or take the conforming "
            "skin (--skin conforming)",
        )


@lru_cache(maxsize=64)
def _hold_each_other(gel: TriangleMesh, other: TriangleMesh) -> bool:
    if not boxes_overlap(gel, other, -GLUE):
        return False
    return (
        len(find_coincident(gel, other, GLUE, facing=False).pairs) > 0
        or len(touching_vertices(gel, other)) > 0
        or len(touching_vertices(other, gel)) > 0
        or find_overlap(gel, other) is not None
    )
