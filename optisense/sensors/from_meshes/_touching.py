"""Contacts between parts: gaps closed, overlaps ranked, the sensing surface laid on the gel."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from optisense.design import Role
from optisense.design.check import solids_beside
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.coincidence import cut, find_coincident
from optisense.geometry.joining import EXACT, join, touching_area
from optisense.geometry.mesh_points import distance_within
from optisense.geometry.overlaps import find_overlap
from optisense.geometry.solids import as_manifold
from optisense.sensors.from_meshes.recipe import Recipe

WIDE_GAP = 0.5
"""Largest gap that is reported, mm: it may be a mistake, larger ones are intended."""

MUCH = 0.2
"""Smallest area of a gap that is reported, as a share of the smaller part's area."""

MOSTLY = 0.95
"""Share of a sensing surface's area on an elastomer for the surface to count as on it."""


@dataclass
class Contacts:
    """Parts after their contacts were closed.

    Attributes:
        meshes: meshes of the solids, by part.
        priorities: priorities of all solids, by part; rigid ones are above soft ones.
        notes: changes, for the user.
    """

    meshes: dict[str, TriangleMesh]
    priorities: dict[str, int]
    notes: list[str] = field(default_factory=list)


def settle_contacts(recipe: Recipe, meshes: dict[str, TriangleMesh]) -> Contacts:
    """Join transparent solids that nearly touch, and rank those that overlap.

    Of two solids the softer one is changed, or else the later one of the recipe. Pairs in
    `air_films` keep their gap. The meshes are closed and welded.
    """
    order = [
        name
        for role in (Role.SUPPORT, Role.ELASTOMER)
        for name, part in recipe.parts.items()
        if part.role is role and name in meshes
    ]
    result = Contacts(dict(meshes), _priorities(recipe, order))
    films = {frozenset(pair) for pair in recipe.air_films}
    for fixed, mover in combinations(order, 2):
        if frozenset((fixed, mover)) not in films:
            _settle(recipe, result, fixed, mover)
    return result


def _priorities(recipe: Recipe, order: list[str]) -> dict[str, int]:
    """Return one priority per part, falling along the order, unless the recipe gives it."""
    numbers = {name: len(order) - place for place, name in enumerate(order)}
    for name in order:
        given = recipe.parts[name].priority
        if given is not None:
            numbers[name] = given
    return numbers


def _settle(recipe: Recipe, result: Contacts, fixed: str, mover: str) -> None:
    """Close the gap between two solids, and report overlaps."""
    if result.priorities[mover] > result.priorities[fixed]:
        fixed, mover = mover, fixed
    one, other = result.meshes[fixed], result.meshes[mover]
    reach = max(recipe.join, EXACT)
    if recipe.join > 0.0:
        joined = join(other, one, recipe.join)
        if joined.kind != "none":
            result.meshes[mover] = other = joined.mesh
            # Curved faces were moved this far into the other part; chords go a little farther.
            reach *= 3.0 if joined.kind == "curved" else 1.0
            what = "gap" if joined.gap >= 0.0 else "overlap"
            result.notes.append(
                f"{mover} and {fixed}: a {what} of up to {abs(joined.gap):.3f} mm was closed by "
                f"moving {'a flat face' if joined.kind == 'flat' else 'curved faces'} of {mover}"
            )
    meeting = find_overlap(other, one)
    if meeting is not None and not _only_joined(other, one, recipe.join):
        at = "({:.2f}, {:.2f}, {:.2f})".format(*meeting.place)
        result.notes.append(
            f"{mover} and {fixed} overlap near {at} mm: {fixed} keeps the place, since its "
            f"priority is higher ({result.priorities[fixed]} against {result.priorities[mover]})"
        )
        return
    smaller = min(one.area, other.area)
    wide = touching_area(other, one, WIDE_GAP)
    if wide > MUCH * smaller / 2 and touching_area(other, one, reach) < 0.5 * wide:
        result.notes.append(
            f"{mover} and {fixed} face each other over {wide:.3g} mm2 with a gap of less than "
            f"{WIDE_GAP:g} mm, which is a film of air for light. If they touch, close the gap in "
            f"the CAD tool or give a larger join; if the film is intended, add "
            f"[{mover}, {fixed}] to air_films"
        )


def _only_joined(mover: TriangleMesh, fixed: TriangleMesh, distance: float) -> bool:
    """Return whether a part reaches into another by no more than the joining has moved it."""
    import manifold3d

    solids = [as_manifold(mover), as_manifold(fixed)]
    if any(solid.status() != manifold3d.Error.NoError for solid in solids):
        return False
    common = solids[0] ^ solids[1]
    return bool(2.0 * common.volume() < 1.5 * distance * common.surface_area())


def lay_on_elastomer(
    name: str, skin: TriangleMesh, elastomers: dict[str, TriangleMesh], distance: float
) -> tuple[TriangleMesh, list[str]]:
    """Return a sensing surface on the faces of the elastomer that it lies on, to a distance (mm),
    and notes on the changes; its normals may point either way.
    """
    notes: list[str] = []
    for gel_name, gel in elastomers.items():
        overlay = find_coincident(gel, skin, max(distance, EXACT), facing=False)
        if len(overlay.pairs) == 0:
            continue
        bed = cut(gel, [overlay])[0]
        if bed.area < MOSTLY * skin.area:
            notes.append(
                f"only {100 * bed.area / skin.area:.0f} % of {name} lies on {gel_name} "
                f"(to {distance:g} mm)"
            )
            continue
        near = find_coincident(gel, skin, EXACT, facing=False)
        if len(near.pairs) and cut(gel, [near])[0].area >= 0.999 * bed.area:
            return skin, notes
        notes.append(
            f"{name} was up to {distance:g} mm off {gel_name}; faces of {gel_name} take its place"
        )
        return bed.welded(), notes
    return skin, notes


def look_inward(
    name: str,
    skin: TriangleMesh,
    solids: dict[str, TriangleMesh],
    eye: np.ndarray | None,
) -> tuple[TriangleMesh, list[str]]:
    """Turn a sensing surface so that its normals point into the solid it lies on.

    If it lies on none, or between two, they point to the camera (`eye`, (3,) mm).
    """
    chosen, front, back = solids_beside(skin, solids.values())
    ahead, behind = int((front & ~back).sum()), int((back & ~front).sum())
    if ahead == behind and eye is not None:
        centres = skin.triangles[chosen].mean(axis=1)
        toward = np.einsum("ij,ij->i", eye - centres, skin.face_normals[chosen])
        ahead, behind = int((toward > 0).sum()), int((toward <= 0).sum())
    if behind > ahead:
        return skin.flipped(), [f"the normals of {name} pointed outward and were reversed"]
    return skin, []


def refuse_contact_with_lamps(
    places: list[tuple[str, np.ndarray]], meshes: dict[str, TriangleMesh]
) -> None:
    """Raise DesignError if a light or a camera, given by its name for messages and its position
    (3,), mm, lies in a face of a part, where its side would be undefined.
    """
    for label, place in places:
        for name, mesh in meshes.items():
            if distance_within(mesh, place, EXACT) < EXACT:
                at = "({:.3f}, {:.3f}, {:.3f})".format(*place)
                raise DesignError(
                    f"{label} at {at} mm lies in a face of part '{name}'",
                    where=f"part {name}",
                    hint="Move it off the face; 0.05 mm is enough (gap: 0.05 for lights)",
                )
