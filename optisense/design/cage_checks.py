"""Checks of parts that cages deform: folds, and parts pushed into others or off them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from optisense.design.arrangement import may_overlap, one_medium
from optisense.design.cage import Cage
from optisense.design.parts import TRANSPARENT_SOLIDS, Role
from optisense.design.problems import Diagnostic
from optisense.design.sensor_design import Meshes, SensorDesign
from optisense.geometry import TriangleMesh
from optisense.geometry.cage import cage_weights
from optisense.geometry.containment import inside
from optisense.geometry.folds import chord_error, find_fold
from optisense.geometry.mesh_points import distance_within
from optisense.geometry.overlaps import (
    CONTACT,
    find_overlap,
    near_surface,
    touching_vertices,
)
from optisense.geometry.rays import ray_hits
from optisense.geometry.solids import without

AT_REST = 1e-9
"""Largest displacement of a control point that counts as rest, mm; a margin for rounding."""

COARSE = 0.1
"""Largest distance, mm, between the straight edges of a mesh and the smooth shape that its cage
gives; a larger one is reported."""

BESIDE = 1.0
"""Largest distance of a light from a part that it lies beside, mm: the height of an LED's package,
whose window is that far from the board or the part on which it stands."""

LEFT_BEHIND = 1.0
"""Least motion of a part, mm, after which a warning names lights that did not move with it: by less
than the height of its package, a light still lies at the part."""

FOLDS = {
    "inside out": "is turned inside out by cage '{cage}' near {place}: {count} of its vertices",
    "collapsed": "is squeezed to nothing by cage '{cage}' near {place}: {count} of its triangles",
    "through itself": "is bent through itself by cage '{cage}' near {place}",
}

Overlap = Literal["no", "odd", "yes"]


def cage_problems(design: SensorDesign, meshes: Meshes | None = None) -> list[Diagnostic]:
    """Return the problems of the shapes that cages give to parts.

    They are: parts that are folded, collapsed, turned inside out or bent through themselves;
    deformed parts that cut into, or lie inside, a part from which they were separate before; and
    deformed parts that have lost contact with a part that they lay on (a warning). Parts in one
    cage move together and are not compared. Of overlapping solids with different priorities one is
    cut out of the other, which is a warning; solids of one medium may overlap. The check
    is fast enough for searches: displacements of ordinary size take milliseconds.

    Args:
        meshes: deformed meshes of the design, if they are known already.

    Raises:
        DesignError: a vertex of a caged part lies outside the cage's box.
    """
    moved, bent = _moved_cages(design, meshes)
    problems: list[Diagnostic] = []
    done: set[frozenset[str]] = set()
    for cage_name, cage in moved.items():
        parts = [name for name in cage.parts if name in bent and name in design.meshes]
        for name in parts:
            problems += _folds(design, cage_name, name, bent[name])
            problems += _coarse(design, cage_name, name, bent[name])
        for name in parts:
            for other in bent:
                pair = frozenset((name, other))
                if other in cage.parts or pair in done:
                    continue
                done.add(pair)
                problems += _meetings(design, cage_name, name, other, bent)
    return problems


def fold_problems(design: SensorDesign) -> list[Diagnostic]:
    """Return the problems of parts that cages have folded, collapsed, turned inside out or bent
    through themselves.

    Raises:
        DesignError: a vertex of a caged part lies outside the cage's box.
    """
    moved, bent = _moved_cages(design)
    problems: list[Diagnostic] = []
    for cage_name, cage in moved.items():
        for name in cage.parts:
            if name in bent and name in design.meshes:
                problems += _folds(design, cage_name, name, bent[name])
    return problems


def contact_problems(design: SensorDesign) -> list[Diagnostic]:
    """Return the problems of deformed parts that have lost contact with a part that they lay on, or
    cut into a transparent part from which they were separate.

    These are the problems of `cage_problems` that a search checks at every point.

    Raises:
        DesignError: a vertex of a caged part lies outside the cage's box.
    """
    moved, bent = _moved_cages(design)
    problems: list[Diagnostic] = []
    for cage_name, cage in moved.items():
        others = [other for other in bent if other not in cage.parts]
        for name in (name for name in cage.parts if name in bent):
            for other in others:
                solids = all(
                    design.parts[each].role in TRANSPARENT_SOLIDS for each in (name, other)
                )
                if solids or len(touching_vertices(design.meshes[name], design.meshes[other])):
                    problems += _meetings(design, cage_name, name, other, bent)
    return problems


def half_caged(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Return warnings about cages around a sensing surface without the solid that it coats.

    The same holds for the solid without the surface: deforming one of them tears the two apart.
    Cages that have moved are left to `cage_problems`.
    """
    solids = [name for name in meshes if design.parts[name].role in TRANSPARENT_SOLIDS]
    problems: list[Diagnostic] = []
    for cage_name, cage in design.cages.items():
        for surface in design.parts_of(Role.SENSING_SURFACE):
            for solid in solids:
                inner = [name for name in (surface, solid) if name in cage.parts]
                if len(inner) != 1 or _has_moved(cage):
                    continue
                if not _coats(design.meshes[surface], design.meshes[solid]):
                    continue
                (outer,) = {surface, solid} - {*inner}
                problems.append(
                    Diagnostic(
                        f"cage '{cage_name}' is around part '{inner[0]}' without part '{outer}', "
                        "which it touches: to bend one of them tears the two apart",
                        design.where("cages", cage_name, "parts"),
                        f"Put '{outer}' into the cage too",
                        severity="warning",
                    )
                )
    return problems


def left_lights(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Return warnings about lights that stay in place while a cage moves parts away from them or
    across them, one for each cage and group.
    """
    problems: list[Diagnostic] = []
    moved, bent = _moved_cages(design, meshes)
    for cage_name, cage in moved.items():
        names = [name for name in cage.parts if name in bent and name in design.meshes]
        for group_name, group in design.lights.items():
            left = 0
            parts: set[str] = set()
            for light in group.lights:
                place = np.array(light.position)
                passed = {
                    name for name in names if _leaves(cage, place, design.meshes[name], bent[name])
                }
                left, parts = left + bool(passed), parts | passed
            if left:
                problems.append(
                    Diagnostic(
                        f"{left} of {len(group.lights)} lights of group '{group_name}' stay in "
                        f"place while cage '{cage_name}' moves the parts beside them: "
                        f"{', '.join(name for name in names if name in parts)}",
                        design.where("lights", group_name),
                        "Move the lights too, or move the control points back: cages move parts "
                        "only",
                        severity="warning",
                    )
                )
    return problems


def _leaves(cage: Cage, place: NDArray[np.float64], rest: TriangleMesh, bent: TriangleMesh) -> bool:
    """Return whether a part that a cage bends moves away from a place (3,), mm, or across it."""
    inner = place.clip(*np.array(cage.box))
    if np.linalg.norm(place - inner) > BESIDE:
        return False
    weights = cage_weights(inner, cage.box, cage.resolution)
    way = (weights @ cage.offsets_at_rest())[0]
    if np.linalg.norm(way) <= CONTACT:
        return False
    # The cage would carry the place along `way`; a part in between has moved across it.
    if (ray_hits(bent, place + way, -way).distance < 1.0).any():
        return True
    before = distance_within(rest, place, BESIDE)
    away = before + LEFT_BEHIND
    return before <= BESIDE and distance_within(bent, place, away) > away


def _coats(surface: TriangleMesh, solid: TriangleMesh) -> bool:
    """Return whether a surface lies on a solid with whole faces, not with its rim alone."""
    rests = np.zeros(len(surface.vertices), dtype=bool)
    rests[touching_vertices(surface, solid)] = True
    flat = rests[surface.faces].any(axis=1)
    middles = surface.triangles[flat].mean(axis=1)
    return bool(np.isfinite(near_surface(middles, solid)).any())


def _moved_cages(
    design: SensorDesign, meshes: Meshes | None = None
) -> tuple[dict[str, Cage], Meshes]:
    """Return the cages whose points are not at rest, by name, and the deformed meshes of all parts,
    or no meshes if there is no such cage.
    """
    moved = {name: cage for name, cage in design.cages.items() if _has_moved(cage)}
    return moved, (meshes or design.deformed_meshes()) if moved else {}


def _has_moved(cage: Cage) -> bool:
    return bool(np.abs(cage.offsets_at_rest()).max() > AT_REST)


def _overlap(design: SensorDesign, name: str, other: str) -> Overlap:
    """Return whether two parts may overlap: solids of one medium may ("yes"), solids of different
    priority are cut out of each other, which is unusual ("odd"), and others may not ("no").
    """
    if one_medium(design, name, other):
        return "yes"
    return "odd" if may_overlap(design, name, other) else "no"


def _folds(design: SensorDesign, cage_name: str, name: str, bent: TriangleMesh) -> list[Diagnostic]:
    cage = design.cages[cage_name]
    points = cage.current_points()
    fold = find_fold(design.meshes[name], bent, cage.box, cage.resolution, points)
    if fold is None:
        return []
    text = FOLDS[fold.kind].format(cage=cage_name, place=_text(fold.place), count=fold.affected)
    return [
        Diagnostic(
            f"part '{name}' {text}",
            _where(design, cage_name),
            f"Move {_mover(design, cage_name, name, fold.vertex)} back: control points must not "
            "pass their neighbours",
        )
    ]


def _coarse(
    design: SensorDesign, cage_name: str, name: str, bent: TriangleMesh
) -> list[Diagnostic]:
    cage = design.cages[cage_name]
    distance, place = chord_error(
        design.meshes[name], bent, cage.box, cage.resolution, cage.current_points()
    )
    if distance <= COARSE:
        return []
    return [
        Diagnostic(
            f"part '{name}' has too large triangles to follow cage '{cage_name}': near "
            f"{_text(place)} it is {distance:.2g} mm off the shape that the cage gives",
            design.where("parts", name, "mesh"),
            "Give the part a finer mesh (Subdivide in Blender, cut_every: 1 in a recipe): only "
            "vertices are bent, and between them it stays straight",
            severity="warning",
        )
    ]


def _meetings(
    design: SensorDesign, cage_name: str, name: str, other: str, bent: Meshes
) -> list[Diagnostic]:
    """Return the problems between a deformed part and one that is not in the same cage."""
    if Role.INDENTER in (design.parts[name].role, design.parts[other].role):
        return []
    overlap = _overlap(design, name, other)
    meeting = find_overlap(bent[name], bent[other])
    if meeting is None:
        return _partings(design, cage_name, name, other, bent, overlap)
    if overlap == "yes" or find_overlap(design.meshes[name], design.meshes[other]) is not None:
        return []  # one medium, or an overlap at rest, which is intended
    distance = np.linalg.norm(bent[name].vertices - meeting.place, axis=1)
    mover = _mover(design, cage_name, name, int(np.argmin(distance)))
    return [
        Diagnostic(
            f"part '{name}', bent by cage '{cage_name}', {meeting.kind} part '{other}' "
            f"near {_text(meeting.place)}",
            _where(design, cage_name),
            f"Move {mover} back towards its place at rest, or put '{other}' into the cage too"
            + _outer_face_hint(design, name, other),
            severity="error" if overlap == "no" else "warning",
        )
    ]


def _partings(
    design: SensorDesign, cage_name: str, name: str, other: str, bent: Meshes, overlap: Overlap
) -> list[Diagnostic]:
    """Return the problems where a deformed part lost contact with one that it touched at rest."""
    mesh, rest = design.meshes[name], design.meshes[other]
    change = np.linalg.norm(bent[name].vertices - mesh.vertices, axis=1)
    rows = touching_vertices(mesh, rest)
    if bent[other] is rest:
        rows = rows[change[rows] > CONTACT]
    off = rows[np.isinf(near_surface(bent[name].vertices[rows], bent[other]))]
    if len(off) == 0:
        return []
    worst = int(off[np.argmax(change[off])])
    place = bent[name].vertices[worst]
    mover = _mover(design, cage_name, name, worst)
    pushed = bent[other].is_closed and bool(inside(place[None], bent[other])[0])
    if pushed and overlap == "yes":
        return []
    if _shares_space(mesh, rest) and _shares_space(bent[name], bent[other]):
        return []  # it reaches into the other part, and only the ends of their overlap moved
    what = "is pushed into" if pushed else "has come off"
    return [
        Diagnostic(
            f"part '{name}', bent by cage '{cage_name}', {what} part '{other}', on which it lies "
            f"at rest, near {_text(place)}",
            _where(design, cage_name),
            f"Put '{other}' into the cage too, or move {mover} back"
            + _outer_face_hint(design, name, other),
            severity="error" if pushed and overlap == "no" else "warning",
        )
    ]


def _shares_space(one: TriangleMesh, other: TriangleMesh) -> bool:
    """Return whether two solids share more space than parts that touch."""
    return one.is_closed and other.is_closed and without(one, other) is not one


def _outer_face_hint(design: SensorDesign, name: str, other: str) -> str:
    """Return how to bend only the outer face of a gel that lies on a rigid part; else nothing."""
    roles = design.parts[name].role, design.parts[other].role
    if roles != (Role.ELASTOMER, Role.SUPPORT):
        return ""
    return (
        f"; to bend only the outer face of '{name}', let its mesh reach into '{other}', and give "
        f"'{other}' the higher priority"
    )


def _mover(design: SensorDesign, cage_name: str, name: str, vertex: int) -> str:
    """Return, in words, the control point that moves a vertex the most."""
    cage = design.cages[cage_name]
    weights = cage_weights(design.meshes[name].vertices[vertex], cage.box, cage.resolution)[0]
    index = int(np.argmax(weights * np.linalg.norm(cage.offsets_at_rest(), axis=1)))
    i, j, k = (int(value) for value in np.unravel_index(index, cage.resolution))
    return f"control point {index} ({i},{j},{k})"


def _where(design: SensorDesign, cage_name: str) -> str:
    field = "points" if design.cages[cage_name].blend is None else "blend"
    return design.where("cages", cage_name, field)


def _text(place: NDArray[np.float64]) -> str:
    return "({:.2f}, {:.2f}, {:.2f}) mm".format(*place)
