"""Points, outlines and shells of Open CASCADE, with the extra `step`."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.workshop._profiles import pieces

Lift = Callable[[FloatArray], FloatArray]
"""Map from points of an outline, (n, 2), to points in the sensor, (n, 3)."""

SEWN = 1e-5
"""Largest distance between edges of neighbouring faces that are joined, mm."""


def point(place: FloatArray) -> Any:
    """Return a point of Open CASCADE at a position (3,), mm."""
    from OCP.gp import gp_Pnt

    return gp_Pnt(*(float(value) for value in place))


def array_of(kind: str) -> Any:
    """Return the class of a table of points, named otherwise before release 8 of Open CASCADE."""
    try:
        module, name = importlib.import_module("OCP.collections"), f"{kind}_gp_Pnt"
    except ImportError:
        module, name = importlib.import_module("OCP.TColgp"), f"TColgp_{kind}OfPnt"
    return getattr(module, name)


def numbers(values: NDArray[Any]) -> Any:
    """Return an array (n,) as a table of Open CASCADE, whose class has another name before release
    8."""
    whole = np.issubdtype(values.dtype, np.integer)
    try:
        module = importlib.import_module("OCP.collections")
        made = getattr(module, "Array1_int" if whole else "Array1_double")(1, len(values))
    except ImportError:
        module = importlib.import_module("OCP.TColStd")
        name = "TColStd_Array1OfInteger" if whole else "TColStd_Array1OfReal"
        made = getattr(module, name)(1, len(values))
    for number, value in enumerate(values.tolist(), start=1):
        made.SetValue(number, value)
    return made


def poles(grid: FloatArray) -> Any:
    """Return a grid of points (m, n, 3), mm, as a table of Open CASCADE."""
    table = array_of("Array2")(1, grid.shape[0], 1, grid.shape[1])
    for u, v in np.ndindex(grid.shape[:2]):
        table.SetValue(u + 1, v + 1, point(grid[u, v]))
    return table


def wire(corners: FloatArray, lift: Lift, closing: bool = False) -> Any:
    """Return the lines, arcs and curves through the corners (n, 2), mm, of an outline, joined, and
    a line from the last corner to the first if it is to be closed.
    """
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.GeomAPI import GeomAPI_Interpolate

    maker = BRepBuilderAPI_MakeWire()
    for piece in pieces(corners):
        ends = [point(place) for place in lift(piece.points)]
        if piece.kind == "line":
            maker.Add(BRepBuilderAPI_MakeEdge(ends[0], ends[-1]).Edge())
        elif piece.kind == "arc":
            maker.Add(BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(*ends).Value()).Edge())
        else:
            through = array_of("HArray1")(1, len(ends))
            for number, each in enumerate(ends, start=1):
                through.SetValue(number, each)
            curve = GeomAPI_Interpolate(through, False, 1e-7)
            curve.Perform()
            maker.Add(BRepBuilderAPI_MakeEdge(curve.Curve()).Edge())
    if closing:
        first, last = (point(place) for place in lift(corners[[0, -1]]))
        maker.Add(BRepBuilderAPI_MakeEdge(last, first).Edge())
    return maker.Wire()


def compound(shapes: Sequence[Any]) -> Any:
    """Return one shape that holds several; a single shape is returned as it is."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    if len(shapes) == 1:
        return shapes[0]
    builder, compound = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


def sewn(faces: Sequence[Any], solid: bool) -> Any | None:
    """Return faces joined along their edges; for a solid, None if they do not close."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing
    from OCP.BRepLib import BRepLib
    from OCP.TopAbs import TopAbs_SHELL
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    sewing = BRepBuilderAPI_Sewing(SEWN)
    for face in faces:
        sewing.Add(face)
    sewing.Perform()
    if not solid:
        return sewing.SewedShape()
    if sewing.NbFreeEdges() > 0:
        return None
    cast = getattr(TopoDS, "Shell_s", None) or TopoDS.Shell
    bodies = []
    explorer = TopExp_Explorer(sewing.SewedShape(), TopAbs_SHELL)
    while explorer.More():
        body = BRepBuilderAPI_MakeSolid(cast(explorer.Current())).Solid()
        BRepLib.OrientClosedSolid_s(body)
        bodies.append(body)
        explorer.Next()
    return compound(bodies) if bodies else None
