"""Shapes as a STEP file, with the extra `step` (Open CASCADE through cadquery-ocp).

Bodies of revolution, prisms and deformed boxes are recognised and written with exact surfaces. The
faces of all others are the triangles of their meshes; those that lie in one plane are merged into
one face.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from optisense.design.colour import ROLE_LOOKS
from optisense.errors import OutputError
from optisense.geometry import TriangleMesh
from optisense.geometry.solids import bodies
from optisense.geometry.step import no_step
from optisense.version import __version__
from optisense.workshop._exact_shapes import WORTH_IT, exact_body
from optisense.workshop._occ import compound
from optisense.workshop.shapes import Shape


def require_step() -> None:
    """Raise SetupError if the extra that writes STEP files is not installed."""
    try:
        import OCP.STEPCAFControl  # noqa: F401
    except ImportError as error:
        raise no_step(error, "writing", "export STL, OBJ or 3MF files") from error


def write_step(path: Path, shapes: Sequence[Shape], title: str = "sensor") -> list[str]:
    """Write a STEP file (AP214, mm): an assembly with a product for each shape, in its colour.

    Returns:
        Notes on shapes that remain triangulated, one sentence each.

    Raises:
        SetupError: the extra is not installed.
        OutputError: the file can't be written.
    """
    require_step()
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_AsIs
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_DocumentTool

    from optisense.geometry.step import quiet

    quiet()
    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    assembly = tool.NewShape()
    _name(assembly, title)
    notes = []
    for shape in shapes:
        body = exact_body(shape)
        if body is None and len(shape.mesh.faces) >= WORTH_IT:
            notes.append(
                f"{shape.name} is written as {len(shape.mesh.faces):,} triangles, since its exact "
                "shape is not known; a CAD model from which it comes, if any, is exact"
            )
        label = tool.AddShape(_boundary(shape) if body is None else body, False)
        _name(label, shape.name)
        _name(tool.AddComponent(assembly, label, TopLoc_Location()), shape.name)
        colours.SetColor(label, _colour(shape), XCAFDoc_ColorGen)
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    # Without curves in the parameter space of surfaces, which readers can compute, files are half
    # as large.
    Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)
    writer.SetNameMode(True)
    writer.SetColorMode(True)
    transferred = writer.Transfer(document, STEPControl_AsIs)
    _sign(writer)
    content = io.BytesIO()  # Open CASCADE opens no file whose name is not UTF-8
    if not transferred or "RetDone" not in str(writer.WriteStream(content)):
        raise OutputError("Open CASCADE can't write the bodies as STEP", where=str(path))
    path.write_bytes(content.getvalue())
    return notes


def _name(label: Any, text: str) -> None:
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name

    TDataStd_Name.Set_s(label, TCollection_ExtendedString(text))


def _colour(shape: Shape) -> Any:
    """Return the colour in which parts of its role are drawn elsewhere."""
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB

    hexadecimal = ROLE_LOOKS[shape.role.value][0].lstrip("#")
    red, green, blue = (int(hexadecimal[k : k + 2], 16) / 255.0 for k in (0, 2, 4))
    return Quantity_Color(red, green, blue, Quantity_TOC_sRGB)


def _sign(writer: Any) -> None:
    """Write the name of the program into the file's head, instead of a placeholder."""
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.TCollection import TCollection_HAsciiString

    head = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    text = TCollection_HAsciiString(f"OptiSense Studio {__version__}")
    head.SetAuthorValue(1, text)
    head.SetOriginatingSystem(text)


def _boundary(shape: Shape) -> Any:
    """Return a solid, several solids, or the shell of a sheet."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid

    if not shape.is_solid:
        return _shell(shape.mesh, closed=False)
    solids = []
    for outside, *cavities in bodies(shape.mesh):
        maker = BRepBuilderAPI_MakeSolid(_shell(outside, closed=True))
        for cavity in cavities:
            maker.Add(_shell(cavity, closed=True))
        solids.append(maker.Solid())
    return compound(solids)


def _shell(mesh: TriangleMesh, closed: bool) -> Any:
    """Return a shell with a face for each flat piece of a mesh."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeShapeOnMesh
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
    from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS, TopoDS_Shell

    on_mesh = BRepBuilderAPI_MakeShapeOnMesh(_triangulation(mesh))
    on_mesh.Build()
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    explorer = TopExp_Explorer(on_mesh.Shape(), TopAbs_FACE)
    while explorer.More():
        builder.Add(shell, explorer.Current())
        explorer.Next()
    shell.Closed(closed)
    unify = ShapeUpgrade_UnifySameDomain(shell, True, True, False)
    unify.Build()
    merged = unify.Shape()
    if merged.ShapeType() != TopAbs_SHELL:
        return shell if closed else merged
    cast = getattr(TopoDS, "Shell_s", None) or TopoDS.Shell
    return cast(merged)


def _triangulation(mesh: TriangleMesh) -> Any:
    from OCP.gp import gp_Pnt
    from OCP.Poly import Poly_Triangle, Poly_Triangulation

    result = Poly_Triangulation(len(mesh.vertices), len(mesh.faces), False)
    for number, vertex in enumerate(mesh.vertices.tolist(), start=1):
        result.SetNode(number, gp_Pnt(*vertex))
    for number, corners in enumerate((mesh.faces + 1).tolist(), start=1):
        result.SetTriangle(number, Poly_Triangle(*corners))
    return result
