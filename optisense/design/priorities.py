"""What solids of higher priority leave of a solid that they overlap."""

from __future__ import annotations

from optisense.design.parts import TRANSPARENT_SOLIDS
from optisense.design.sensor_design import SensorDesign
from optisense.geometry import TriangleMesh
from optisense.geometry.solids import without


def carved(design: SensorDesign, meshes: dict[str, TriangleMesh], name: str) -> TriangleMesh:
    """Return the mesh of a transparent solid without its overlaps with those of higher priority.

    It is the mesh itself if there are none, as where parts only touch.

    Args:
        meshes: deformed meshes of the design, mm, by part.
        name: the solid.
    """
    mesh = meshes[name]
    for other, part in design.parts.items():
        if (
            part.role in TRANSPARENT_SOLIDS
            and part.priority > design.parts[name].priority
            and other in meshes
        ):
            mesh = without(mesh, meshes[other])
    return mesh
