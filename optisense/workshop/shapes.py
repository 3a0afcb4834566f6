"""Shapes of a design for manufacturing: bent by their cages, in one piece, normals outward."""

from __future__ import annotations

from dataclasses import dataclass

from optisense.design import Cage, Role, SensorDesign
from optisense.design.arrangement import carved
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.repair import outward
from optisense.geometry.solids import united
from optisense.workshop._thickened import thickened

AIR = 1.0
"""Refractive index of a part that is not made but left empty."""


@dataclass(frozen=True)
class Shape:
    """Part to make.

    Attributes:
        name: name of the part.
        role: role of the part.
        material: name of its material in the design, None for a coated or an absorbing part.
        mesh: mesh in the frame of the design, mm; coincident corners are one vertex.
        rest: mesh before its cage deformed it, None if it has no cage.
        cage: cage that deforms it.
        thickness: thickness of a sheet for manufacturing, mm; None for others or if unknown.
        sheet: shape of such a sheet without its thickness.
    """

    name: str
    role: Role
    material: str | None
    mesh: TriangleMesh
    rest: TriangleMesh | None = None
    cage: Cage | None = None
    thickness: float | None = None
    sheet: Shape | None = None

    @property
    def is_solid(self) -> bool:
        """True if the mesh encloses a volume; else it is a sheet."""
        return self.mesh.is_closed

    @property
    def volume(self) -> float | None:
        """Volume of a solid, mm^3; None for a sheet."""
        return abs(self.mesh.volume) if self.is_solid else None


def is_air(design: SensorDesign, name: str) -> bool:
    """Return whether a part is a gap that the design contains, such as the air gap under a belt."""
    material = design.materials.get(design.parts[name].material or "")
    medium = None if material is None else material.medium()
    return medium is not None and medium.ior == AIR


def shapes(design: SensorDesign) -> list[Shape]:
    """Return all parts of a design except its indenters and those of air, in their current shape.

    Bodies of one part that overlap are one body, sheets have the thickness that the design gives
    for manufacturing, and gels have only the space that solids of higher priority leave them.

    Raises:
        DesignError: a part has no mesh, or lies outside of the cage that deforms it.
    """
    meshes = design.deformed_meshes()
    found = []
    for name, part in design.parts.items():
        if part.role is Role.INDENTER or is_air(design, name):
            continue
        if name not in meshes:
            raise DesignError(
                f"part '{name}' has no mesh",
                where=design.where("parts", name, "mesh"),
                hint="Set design.meshes[name]",
            )
        mesh = meshes[name].welded()
        cage = next((each for each in design.cages.values() if name in each.parts), None)
        if mesh.is_closed:
            mesh = outward(mesh)
            if (whole := united(mesh)) is not mesh:
                mesh, cage = whole, None
        if part.role is Role.ELASTOMER:
            left = carved(design, meshes, name)
            if left is not meshes[name]:
                mesh, cage = left.welded(), None
        rest = None if cage is None else design.meshes[name].welded()
        shape = Shape(name, part.role, part.material, mesh, rest, cage)
        found.append(_as_made(shape, part.thickness))
    return found


def _as_made(shape: Shape, thickness: float | None) -> Shape:
    """Return a sheet as the plate that it is made of, if the design gives its thickness."""
    if thickness is None or shape.is_solid or shape.role is Role.SENSING_SURFACE:
        return shape
    plate = thickened(shape.mesh, thickness)
    if plate is None:
        return shape
    return Shape(shape.name, shape.role, shape.material, plate, thickness=thickness, sheet=shape)
