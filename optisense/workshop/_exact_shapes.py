"""Recognised shapes as exact bodies of Open CASCADE, with the extra `step`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from scipy.interpolate import make_interp_spline

from optisense.array_types import FloatArray
from optisense.design import Cage
from optisense.geometry import TriangleMesh
from optisense.geometry.cage import bernstein, deformed
from optisense.geometry.connected import connected_components
from optisense.geometry.step import triangles
from optisense.workshop._occ import SEWN, Lift, compound, numbers, point, poles, sewn, wire
from optisense.workshop._profiles import SMOOTH
from optisense.workshop._recognised import (
    SAME,
    Dome,
    Extrusion,
    Revolution,
    across,
    box_sides,
    dome,
    extrusion_of,
    rims,
    smooth_patches,
    turned,
)
from optisense.workshop.shapes import Shape

SAME_PLACE = 0.1
"""Largest difference between the ends of a body and of its mesh along x, y or z, mm."""

RIGHT_SIDE = 0.5
"""Largest difference between a plate's ends and those of its mesh, as a share of its thickness,
where that is less: a plate on the wrong side of its sheet is off by the whole thickness."""


WORTH_IT = 60
"""Smallest number of triangles for a recognition of shapes; a smaller mesh is written as it is,
with its flat faces merged."""

MESH_ERROR = 0.015
"""Largest relative difference of a mesh's volume (or area) from that of the body; a circle of 24
corners has 1.1 % less area, one of 48 0.3 %."""


def exact_body(shape: Shape) -> Any | None:
    """Return a body with planes, cylinders, cones, spheres and smooth surfaces instead of
    triangles.

    The result is None if the shape is not recognised, or if the body is invalid or of another size.
    """
    if len(shape.mesh.faces) < WORTH_IT:
        return None
    if shape.sheet is not None and shape.thickness is not None:
        # The sheet is tried first: corners of the far face that end an arc are not mitred like the
        # others, and lie on another circle.
        for body in _plates(shape.sheet, shape.thickness):
            if _agrees(body, shape):
                return body
    body = _body(shape)
    return body if body is not None and _agrees(body, shape) else None


def _plates(sheet: Shape, thickness: float) -> Iterator[Any]:
    """Yield the bodies that Open CASCADE makes of a sheet by a parallel surface, mitred."""
    from OCP.BRepOffset import BRepOffset_MakeOffset, BRepOffset_Skin
    from OCP.GeomAbs import GeomAbs_Intersection
    from OCP.TopAbs import TopAbs_SOLID

    surfaces = [exact_body(piece) for piece in _apart(sheet)]
    for offset in (thickness, -thickness):
        made = []
        for surface in surfaces:
            if surface is None:
                return
            maker = BRepOffset_MakeOffset()
            maker.Initialize(
                surface, offset, SEWN, BRepOffset_Skin, False, False, GeomAbs_Intersection, True
            )
            maker.MakeThickSolid()
            if maker.IsDone() and maker.Shape().ShapeType() == TopAbs_SOLID:
                made.append(maker.Shape())
        if len(made) == len(surfaces):
            yield made[0] if len(made) == 1 else compound(made)


def _apart(sheet: Shape) -> list[Shape]:
    """Return the pieces of a sheet that do not touch one another."""
    mesh = sheet.mesh
    ends = np.concatenate([mesh.faces[:, :2], mesh.faces[:, 1:]])
    labels = connected_components(len(mesh.vertices), ends[:, 0], ends[:, 1])
    if not labels.any():
        return [sheet]
    owner = labels[mesh.faces[:, 0]]
    return [
        replace(sheet, mesh=mesh.with_faces(mesh.faces[owner == k]).compacted())
        for k in np.unique(owner)
    ]


def _body(shape: Shape) -> Any | None:
    found = turned(shape.mesh)
    if found is not None:
        return _turned_body(found, shape.is_solid)
    outline = extrusion_of(shape.mesh)
    if outline is not None:
        return _drawn_body(outline, shape.is_solid)
    if shape.cage is not None and shape.rest is not None:
        sides = box_sides(shape.rest)
        if sides:
            return _bent_box(sides, shape.cage, shape.is_solid)
    rounded = dome(shape.mesh)
    if rounded is not None:
        return _dome_body(rounded, shape.is_solid)
    return _patched_body(shape.mesh, shape.is_solid)


def _dome_body(found: Dome, solid: bool) -> Any | None:
    """Return a body with a smooth surface through all rings, on a wall of one face."""
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakeWire,
    )
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Trsf, gp_Vec

    surface = _through(found)
    rim = surface.VIso(0.0)
    down = gp_Vec(0.0, 0.0, found.foot - float(found.rings[0, 0, 2]))
    wall = BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeEdge(rim).Edge(), down).Shape()
    faces = [BRepBuilderAPI_MakeFace(surface, SEWN).Face(), wall]
    if solid:
        move = gp_Trsf()
        move.SetTranslation(down)
        edge = BRepBuilderAPI_MakeEdge(rim.Transformed(move)).Edge()
        faces.append(BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakeWire(edge).Wire()).Face())
    return sewn(faces, solid)


def _through(found: Dome) -> Any:
    """Return a cubic B-spline surface through the rings of a dome: u runs around, v up."""
    from OCP.Geom import Geom_BSplineSurface

    rings = np.concatenate([found.rings, np.tile(found.top, (1, found.rings.shape[1], 1))])
    grid = np.concatenate([rings, rings[:, :1]], axis=1).swapaxes(0, 1)
    around, up = (_lengths(grid, axis) for axis in (0, 1))
    one = make_interp_spline(around, grid, k=3, axis=0)
    both = make_interp_spline(up, one.c, k=3, axis=1)
    table = poles(both.c.swapaxes(0, 1))  # SciPy puts the axis of the last spline first
    knots, counts = zip(*(np.unique(t, return_counts=True) for t in (one.t, both.t)), strict=True)
    return Geom_BSplineSurface(
        table, *(numbers(each) for each in knots), *(numbers(each) for each in counts), 3, 3
    )


def _lengths(grid: FloatArray, axis: int) -> FloatArray:
    """Return the mean arc length along an axis of a grid of points (m, n, 3), from 0 to 1."""
    steps = np.linalg.norm(np.diff(grid, axis=axis), axis=2).mean(axis=1 - axis)
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum())


def _patched_body(mesh: TriangleMesh, solid: bool) -> Any | None:
    """Return a body of flat faces and of extruded outlines; None if a smooth patch is neither."""
    faces = []
    for patch in smooth_patches(mesh, SMOOTH):
        piece = mesh.with_faces(mesh.faces[patch]).compacted()
        outline = extrusion_of(piece)
        if outline is not None:
            faces.append(_drawn_body(outline, False))
            continue
        flat = _flat_face(piece)
        if flat is None:
            return None
        faces.append(flat)
    return sewn(faces, solid)


def _flat_face(mesh: TriangleMesh) -> Any | None:
    """Return a flat patch as one face with its holes; None if it is not flat."""
    normal = mesh.face_normals[int(mesh.face_areas.argmax())]
    origin = mesh.vertices[0]
    if np.abs((mesh.vertices - origin) @ normal).max() > SAME:
        return None
    loops = rims(mesh)
    if loops is None:
        return None
    first = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    first /= np.linalg.norm(first)
    frame = np.array([first, np.cross(normal, first)])

    def lift(points: FloatArray) -> FloatArray:
        return np.asarray(origin + points @ frame)

    outlines = [(mesh.vertices[loop] - origin) @ frame.T for loop in loops]
    outlines.sort(key=lambda outline: -abs(shapely.Polygon(outline).area))
    return _face(outlines, lift)


def _face(outlines: Sequence[FloatArray], lift: Lift) -> Any:
    """Return the flat face in an outline (n, 2) mm, the first one, with the others as holes."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    outer, *holes = outlines
    face = BRepBuilderAPI_MakeFace(wire(_anticlockwise(outer, True), lift))
    for hole in holes:
        face.Add(wire(_anticlockwise(hole, False), lift))
    return face.Face()


def _turned_body(found: Revolution, solid: bool) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir

    i = across(found.axis)[0]

    def lift(points: FloatArray) -> FloatArray:
        result = np.tile(found.centre, (len(points), 1))
        result[:, i] += points[:, 0]
        result[:, found.axis] = points[:, 1]
        return result

    axis = gp_Ax1(point(found.centre), gp_Dir(*np.eye(3)[found.axis].tolist()))
    closed = bool((found.profile[0] == found.profile[-1]).all())
    line = wire(found.profile, lift, closing=solid and not closed)
    profile = BRepBuilderAPI_MakeFace(line).Face() if solid else line
    return BRepPrimAPI_MakeRevol(profile, axis).Shape()


def _drawn_body(found: Extrusion, solid: bool) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Vec

    i, j = across(found.axis)

    def lift(points: FloatArray) -> FloatArray:
        result = np.empty((len(points), 3))
        result[:, i], result[:, j] = points[:, 0], points[:, 1]
        result[:, found.axis] = found.low
        return result

    way = gp_Vec(*((found.high - found.low) * np.eye(3)[found.axis]).tolist())
    if not solid:
        return compound([BRepPrimAPI_MakePrism(wire(o, lift), way).Shape() for o in found.outlines])
    faces = [_face(outlines, lift) for outlines in _with_holes(found.outlines)]
    return compound([BRepPrimAPI_MakePrism(face, way).Shape() for face in faces])


def _anticlockwise(outline: FloatArray, wanted: bool) -> FloatArray:
    return outline if shapely.is_ccw(shapely.LinearRing(outline)) == wanted else outline[::-1]


def _with_holes(outlines: Sequence[FloatArray]) -> list[list[FloatArray]]:
    """Return outlines by bodies: each outer one with the holes in it."""
    rings = [shapely.Polygon(outline) for outline in outlines]
    depth = [sum(k != n and other.contains(ring) for k, other in enumerate(rings))
             for n, ring in enumerate(rings)]  # fmt: skip
    bodies = {n: [outlines[n]] for n in range(len(rings)) if depth[n] % 2 == 0}
    for n, ring in enumerate(rings):
        if depth[n] % 2 == 1:
            owner = max((k for k in bodies if rings[k].contains(ring)), key=lambda k: depth[k])
            bodies[owner].append(outlines[n])
    return list(bodies.values())


def _bent_box(sides: Sequence[FloatArray], cage: Cage, solid: bool) -> Any:
    """Return a box as a cage deforms it: each side is, exactly, one Bezier surface."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.Geom import Geom_BezierSurface

    faces = []
    for corners in sides:
        surface = Geom_BezierSurface(poles(_bezier_points(corners, cage)))
        faces.append(BRepBuilderAPI_MakeFace(surface, SEWN).Face())
    return sewn(faces, solid)


def _bezier_points(corners: FloatArray, cage: Cage) -> FloatArray:
    """Return the control points of a deformed rectangle, (m, n, 3) mm.

    Along each side the cage is a polynomial of one degree less than its number of points there, so
    that the surface through as many points is exactly the deformed rectangle.
    """
    way_u, way_v = corners[1, 0] - corners[0, 0], corners[0, 1] - corners[0, 0]
    counts = [cage.resolution[int(np.argmax(np.abs(way)))] for way in (way_u, way_v)]
    share_u, share_v = (np.linspace(0.0, 1.0, count) for count in counts)
    grid = corners[0, 0] + share_u[:, None, None] * way_u + share_v[None, :, None] * way_v
    at_rest = TriangleMesh(grid.reshape(-1, 3), np.zeros((0, 3), dtype=np.int32))
    bent = deformed(at_rest, cage.box, cage.resolution, cage.current_points()).vertices
    table = bent.reshape(*counts, 3)
    to_u, to_v = (
        np.linalg.inv(bernstein(share, count))
        for share, count in zip((share_u, share_v), counts, strict=True)
    )
    return np.asarray(np.einsum("ai,bj,ijk->abk", to_u, to_v, table))


def _agrees(body: Any, shape: Shape) -> bool:
    """Return whether a body is valid, and has the volume (a sheet: the area) of its mesh.

    Both are computed from triangles of the body: Open CASCADE's own integrals over a dome of many
    spans are off by a percent.
    """
    from OCP.BRepCheck import BRepCheck_Analyzer

    if not BRepCheck_Analyzer(body).IsValid():
        return False
    cut = triangles(body, chord=0.02, bend=15.0)
    near = SAME_PLACE if shape.thickness is None else min(SAME_PLACE, RIGHT_SIDE * shape.thickness)
    if np.abs(cut.bounds - shape.mesh.bounds).max() > near:
        return False
    if shape.is_solid:
        found, wanted = cut.volume, abs(shape.mesh.volume)
    else:
        found, wanted = cut.area, shape.mesh.area
    return abs(found - wanted) <= MESH_ERROR * wanted
