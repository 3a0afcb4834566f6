"""Repair of meshes from CAD files, as far as it needs no guessing.

Repaired are vertices that differ by rounding, faces that coincide, and faces and whole shells that
are turned inside out. Refused, with the place, are holes, edges of more than two faces, faces that
cut through each other, and bodies that overlap; these must be corrected in the CAD tool.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import BoolArray, FloatArray
from optisense.errors import MeshError
from optisense.geometry._grid_welding import first_faces
from optisense.geometry._mesh_checks import with_consistent_winding
from optisense.geometry._welding import merged_vertices
from optisense.geometry.coincidence import boxes_overlap, find_coincident
from optisense.geometry.connected import connected_components
from optisense.geometry.containment import inside
from optisense.geometry.crossings import TOUCH, near_pairs, self_crossings
from optisense.geometry.mesh import IntArray, TriangleMesh
from optisense.geometry.patches import inner_edges, sides_of_faces
from optisense.geometry.solids import as_manifold, thick_place

WELDS = (1e-6, 1e-5, 1e-4, 1e-3)
"""Distances (mm) below which vertices are merged, tried in ascending order until the mesh is
closed: from the rounding of single precision to a tenth of the usual tolerance of a part."""

NARROWER = 1e-6
"""Share of the width of a surface by which an opening in it is narrower at least: the rounding of
single precision."""

FLAT = 1e-9
"""Volume of a shell, as a share of its area to the power of 1.5, below which it encloses none: a
sphere has a tenth, and a square sheet as thin as a millionth of its side 4e-7."""

SAME_AREA = 1e-6
"""Largest difference of the areas of two pieces of a surface that coincide, as a share of them: the
rounding of single precision."""

_UNITE = (
    "In the CAD tool: combine the overlapping bodies into one (Boolean union), or export each to "
    "its own file"
)
"""Advice on bodies that overlap."""


def repaired(mesh: TriangleMesh, name: str, closed: bool) -> tuple[TriangleMesh, list[str]]:
    """Repair the mesh of a part if that is safe.

    Args:
        mesh: the mesh as read from a file, mm.
        name: name of the part, for messages.
        closed: whether it must enclose a volume.

    Returns:
        The welded mesh without shading normals (closed meshes have outward face normals), and a
        list of the changes, one sentence each.

    Raises:
        MeshError: no faces, not finite, holes, edges of more than two faces, faces that cut through
            each other, bodies that overlap, or no volume; the message says where, and what to do
            in the CAD tool.
    """
    where = f"part {name}"
    if not np.isfinite(mesh.vertices).all():
        raise MeshError(
            "some coordinates are not finite numbers",
            where=where,
            hint="Export the part again from the CAD tool",
        )
    if len(mesh.faces) == 0 or not mesh.area > 0.0:
        raise MeshError(
            "the file has no faces",
            where=where,
            hint="In the CAD tool: show the body, select it, and export a solid or a surface as a "
            "mesh; sketches, points and hidden bodies have no faces",
        )
    notes: list[str] = []
    mended, doubled = _without_doubles(mesh.welded())
    if doubled:
        notes.append(f"{doubled} duplicate faces were dropped")
    sealed = _sealed(mended, notes)
    if closed:
        if sealed is None:
            raise _hole(merged_vertices(mended, WELDS[0]), where)
        _refuse_crowded_edges(sealed, where)
        _refuse_crossings(sealed, where)
        mended = _outward(sealed, where, notes)
    elif sealed is not None and (sealed.edges[1] == 2).all():
        mended = outward(with_consistent_winding(sealed))
        _tell_of_turned((mended.faces != sealed.faces).any(axis=1), notes)
    else:
        mended = _consistent(mended if sealed is None else sealed, notes)
    return mended, notes


def narrow_openings(mesh: TriangleMesh) -> str | None:
    """Return a clause that tells the openings of a surface that are narrower than it, so that the
    surface may be meant to be closed; None if there are none. The rim of a plain sheet is as wide
    as the sheet, and its mesh welded.
    """
    labels = shells(mesh)
    owner = np.zeros(len(mesh.vertices), dtype=np.int64)
    owner[mesh.faces] = labels[:, None]
    widths = np.array([_width(each.vertices) for each in _shapes_of(mesh, labels)])
    found = [
        edges
        for edges in _openings(mesh)
        if _width(mesh.vertices[edges]) < (1.0 - NARROWER) * widths[owner[edges[0, 0]]]
    ]
    return _told(mesh, found) if found else None


def outward(mesh: TriangleMesh) -> TriangleMesh:
    """Return a closed mesh, whose faces agree with their neighbours, with bodies that look outward.

    A shell inside a body is a cavity if it is drawn contrary to the innermost body around it, and a
    body if it is drawn alike. Bodies may overlap.
    """
    labels = shells(mesh)
    cones = np.einsum("ij,ij->i", mesh.triangles[:, 0], mesh.face_vectors) / 6.0
    inward = np.bincount(labels, cones) < -FLAT * np.bincount(labels, mesh.face_areas) ** 1.5
    if not inward.any():
        return mesh
    if not inward.all():
        within = _within(_shapes_of(mesh, labels), None)
        inward = inward != _cavities(within, inward)
    over = inward[labels]
    return mesh.with_faces(np.where(over[:, None], mesh.faces[:, ::-1], mesh.faces))


def refuse_bad_sheet(mesh: TriangleMesh, name: str) -> None:
    """Raise MeshError if an open mesh can't be walked from face to face, as an edge has more than
    two faces, or faces cut through each other.
    """
    _refuse_crowded_edges(mesh.welded(), f"part {name}")
    _refuse_crossings(mesh.welded(), f"part {name}")


def shells(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Return the number (m,) int64 of the shell that each face belongs to: faces joined by edges.

    Bodies that only share corners are different shells.
    """
    return connected_components(len(mesh.faces), *inner_edges(mesh)[1].T)


def _without_doubles(mesh: TriangleMesh) -> tuple[TriangleMesh, int]:
    """Drop faces that coincide; return the mesh and the number of dropped faces.

    Of faces with the same corners and the same winding, one is kept. If edges then still belong to
    more than two faces, pieces of the surface that coincide are dropped: all but one, as for a
    surface that is drawn from both sides, or else all, as for the wall between bodies that touch.
    """
    first = first_faces(mesh.faces, len(mesh.vertices))
    best = once = mesh.with_faces(mesh.faces[first])
    if (once.edges[1] > 2).any():
        kept = [mesh.with_faces(mesh.faces[k]).compacted() for k in _without_coincident(mesh)]
        best = next((each for each in kept if 0 < each.edges[1].max(initial=0) <= 2), once)
    return best, len(mesh.faces) - len(best.faces)


def _without_coincident(mesh: TriangleMesh) -> tuple[BoolArray, BoolArray]:
    """Return masks (m,) of the faces that remain if all but one of the pieces of the surface that
    coincide are dropped, and if all are; the pieces are bounded by edges of more than two faces.
    """
    count, face = mesh.edges[1], sides_of_faces(mesh)[1]
    edge, times = np.repeat(np.arange(len(count)), count), np.repeat(count, count)
    labels = connected_components(len(mesh.faces), *face[times == 2].reshape(-1, 2).T)
    area = np.bincount(labels, mesh.face_areas)
    weighted = mesh.face_areas[:, None] * mesh.triangles.mean(axis=1)
    sums = np.stack([np.bincount(labels, each) for each in weighted.T], axis=1)
    middle = sums / np.maximum(area, np.finfo(np.float64).tiny)[:, None]
    rims: dict[bytes, list[int]] = {}
    crowded = np.flatnonzero(times > 2)
    crowded = crowded[np.argsort(labels[face[crowded]], kind="stable")]
    owner, begin = np.unique(labels[face[crowded]], return_index=True)
    extra, every = np.zeros(len(area), dtype=bool), np.zeros(len(area), dtype=bool)
    for piece, rim in zip(owner.tolist(), np.split(edge[crowded], begin[1:]), strict=True):
        others = rims.setdefault(rim.tobytes(), [])
        twins = [
            each
            for each in others
            if np.abs(middle[each] - middle[piece]).max() < TOUCH
            and abs(area[each] - area[piece]) < SAME_AREA * area[piece]
        ]
        extra[piece] = bool(twins)
        every[[*twins, piece]] |= bool(twins)
        others.append(piece)
    return ~extra[labels], ~every[labels]


def _sealed(mesh: TriangleMesh, notes: list[str]) -> TriangleMesh | None:
    """Return a mesh, welded as far as needed to close it; None if it has holes."""
    for distance in WELDS:
        welded = merged_vertices(mesh, distance)
        if not len(welded.open_edges):
            if distance > WELDS[0]:
                notes.append(f"vertices up to {distance:g} mm apart were joined")
            return welded
    return None


def _hole(mesh: TriangleMesh, where: str) -> MeshError:
    """Return the error for open edges, with the number of holes and the place of the widest one."""
    return MeshError(
        f"the solid is not closed: it has {_told(mesh, _openings(mesh))}",
        where=where,
        hint="In the CAD tool: close the opening (knit or thicken the surfaces into a solid body) "
        "and export the solid again",
    )


def _openings(mesh: TriangleMesh) -> list[IntArray]:
    """Return the open edges (k, 2) of each opening of a mesh."""
    edges = mesh.open_edges
    group = connected_components(len(mesh.vertices), edges[:, 0], edges[:, 1])[edges[:, 0]]
    return [edges[group == rim] for rim in np.unique(group)]


def _told(mesh: TriangleMesh, openings: list[IntArray]) -> str:
    """Return the number of openings, and the size and the place of the widest one, as text."""
    widest = max((mesh.vertices[np.unique(edges)] for edges in openings), key=_width)
    holes = "a hole" if len(openings) == 1 else f"{len(openings)} holes, the widest"
    return (
        f"{holes} of {_width(widest):.3g} mm near {_point(widest.mean(axis=0))} mm "
        f"({sum(map(len, openings))} edges have a face on one side only)"
    )


def _width(points: FloatArray) -> float:
    """Return the diagonal of the box around points (..., 3), mm."""
    return float(np.linalg.norm(np.ptp(points.reshape(-1, 3), axis=0)))


def _refuse_crowded_edges(mesh: TriangleMesh, where: str) -> None:
    edges, count = mesh.edges
    crowded = edges[count > 2]
    if len(crowded) == 0:
        return
    place = mesh.vertices[crowded[0]].mean(axis=0)
    raise MeshError(
        f"the mesh is not manifold: {len(crowded)} edges belong to more than two faces, one of "
        f"them near {_point(place)} mm",
        where=where,
        hint="In the CAD tool: remove faces inside the body, and join bodies that only touch "
        "along an edge, or export each body to its own file",
    )


def _refuse_crossings(mesh: TriangleMesh, where: str) -> None:
    found = self_crossings(mesh)
    if len(found.pairs) == 0:
        return
    bodies = shells(mesh)
    two = bool((bodies[found.pairs[:, 0]] != bodies[found.pairs[:, 1]]).any())
    raise MeshError(
        f"the mesh cuts through itself: {len(found.pairs)} pairs of faces cross, one of them near "
        f"{_point(found.places[0])} mm",
        where=where,
        hint=_UNITE
        if two
        else "In the CAD tool: look for a fillet, offset or loft that folds over itself there, "
        "make it smaller, and export again",
    )


def _consistent(mesh: TriangleMesh, notes: list[str]) -> TriangleMesh:
    """Return an open mesh whose faces agree with their neighbours, by majority in each shell."""
    faces = with_consistent_winding(mesh).faces
    turned = (faces != mesh.faces).any(axis=1)
    labels = shells(mesh)
    area = np.bincount(labels, mesh.face_areas)
    outvoted = 2.0 * np.bincount(labels, mesh.face_areas * turned) > area
    turned ^= outvoted[labels]
    if turned.any():
        notes.append(f"{turned.sum()} faces were turned over to agree with their neighbours")
    return mesh.with_faces(np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))


def _outward(mesh: TriangleMesh, where: str, notes: list[str]) -> TriangleMesh:
    """Return a mesh with consistent winding and each shell outward, or inward if it is a cavity.

    The note on a shell that was drawn as a body, and becomes a cavity, names it.
    """
    labels = shells(mesh)
    faces = with_consistent_winding(mesh).faces.copy()
    bodies = _shapes_of(mesh.with_faces(faces), labels)
    for body in bodies:
        if not abs(body.volume) > FLAT * body.area**1.5:
            raise MeshError(
                f"the mesh encloses no volume near {_point(body.triangles[0].mean(axis=0))} mm",
                where=where,
                hint="In the CAD tool: export a solid body, not a flat one",
            )
    within = _within(bodies, where)
    cavities = _cavities(within)
    for label, body in enumerate(bodies):
        if (body.volume > 0.0) == cavities[label]:
            faces[labels == label] = faces[labels == label][:, ::-1]
    turned = (faces != mesh.faces).any(axis=1)
    # A shell was drawn inside out if most of its area had to be turned.
    area = np.bincount(labels, mesh.face_areas)
    over = 2.0 * np.bincount(labels, mesh.face_areas * turned) > area
    for label in [] if turned.all() else np.flatnonzero(cavities).tolist():
        if over[label] != over[_innermost_body(within, cavities, label)]:
            turned[labels == label] = False
            notes.append(
                f"the body near {_point(bodies[label].bounds.mean(axis=0))} mm, which lies inside "
                f"another one, became a cavity of {abs(bodies[label].volume):.3g} mm^3; if the "
                "part is solid there, delete the inner body in the CAD tool"
            )
    _tell_of_turned(turned, notes)
    return mesh.with_faces(faces)


def _cavities(within: BoolArray, inward: BoolArray | None = None) -> BoolArray:
    """Return a mask (n,) of the shells that are cavities: those inside a body. A shell in empty
    space is a body.

    Args:
        within: mask (n, n) of the shells (rows) that lie inside others (columns).
        inward: mask (n,) of the shells that are drawn inward. If it is given, shells drawn like the
            innermost body around them are bodies, too.
    """
    cavities = np.zeros(len(within), dtype=bool)
    for shell in np.argsort(within.sum(axis=1), kind="stable").tolist():  # from outside to inside
        bodies = within[shell] @ np.where(cavities, -1, 1)
        cavities[shell] = bodies > 0 and (
            inward is None or inward[shell] != inward[_innermost_body(within, cavities, shell)]
        )
    return cavities


def _innermost_body(within: BoolArray, cavities: BoolArray, shell: int) -> int:
    """Return the number of the innermost body that contains a shell, which lies inside one."""
    return int(np.argmax(np.where(within[shell] & ~cavities, within.sum(axis=1), -1)))


def _tell_of_turned(turned: BoolArray, notes: list[str]) -> None:
    """Add a note on the faces (m,) of a closed mesh that were turned over."""
    if turned.all():
        notes.append("it was inside out and has been turned over")
    elif turned.any():
        notes.append(
            f"{turned.sum()} of {len(turned)} faces were inside out; they were turned over"
        )


def _shapes_of(mesh: TriangleMesh, labels: NDArray[np.int64]) -> list[TriangleMesh]:
    """Return each shell of a mesh by itself; `labels` are those of `shells`."""
    return [mesh.with_faces(mesh.faces[labels == k]).compacted() for k in range(labels.max() + 1)]


def _within(bodies: list[TriangleMesh], where: str | None) -> BoolArray:
    """Return a mask (n, n) of the bodies (rows) that lie inside others (columns).

    The bodies are closed shells of either winding, and may touch from outside. With `where`, the
    part for messages, two that overlap in part, or have a part of their surfaces in common, so that
    one is no cavity of the other, raise MeshError.
    """

    @cache
    def solid(number: int) -> Any:
        body = bodies[number]
        return as_manifold(body if body.volume > 0.0 else body.flipped())

    result = np.zeros((len(bodies), len(bodies)), dtype=bool)
    for one, body in enumerate(bodies):
        for two in range(one):
            other = bodies[two]
            if not boxes_overlap(body, other, TOUCH):
                continue
            if next(near_pairs(body, other), None) is None:  # surfaces that keep apart
                result[one, two] = inside(body.vertices[0], other)[0]
                result[two, one] = inside(other.vertices[0], body)[0]
                continue
            place = thick_place(solid(one) ^ solid(two), TOUCH)
            if place is None:
                continue
            result[one, two] = thick_place(solid(one) - solid(two), TOUCH) is None
            result[two, one] = thick_place(solid(two) - solid(one), TOUCH) is None
            if where is None:
                continue
            shared = len(find_coincident(body, other, TOUCH, facing=False).pairs) > 0
            if shared or result[one, two] == result[two, one]:
                raise MeshError(
                    f"the mesh cuts through itself: two of its bodies overlap near {_point(place)} "
                    "mm",
                    where=where,
                    hint=_UNITE,
                )
    return result


def _point(place: FloatArray) -> str:
    return "({:.3f}, {:.3f}, {:.3f})".format(*place)
