"""Check of a whole design without rendering it."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np
from numpy.typing import NDArray

from optisense.design._focus_checks import focus_problem
from optisense.design.addressing import get_value
from optisense.design.arrangement import films, overlaps
from optisense.design.cage_checks import cage_problems, half_caged, left_lights
from optisense.design.camera_checks import (
    lens_problem,
    place_problem,
    uniqueness_problem,
    view_problem,
)
from optisense.design.limits import absorption_problems, index_problems, placed_things, unit_slips
from optisense.design.part_faces import finished_faces
from optisense.design.parts import TRANSPARENT_SOLIDS, Role
from optisense.design.problems import Diagnostic, invalid_values, kind_problems
from optisense.design.sensor_design import Meshes, SensorDesign
from optisense.errors import DesignError, MeshError
from optisense.geometry import TriangleMesh
from optisense.geometry.containment import inside
from optisense.near import suggestion

OPAQUE_ROLES = frozenset({Role.BLOCKER, Role.MIRROR, Role.INDENTER})

PROBE = 0.05
"""Distance from the sensing surface to look up its medium, mm; less than any gel's thickness."""

PROBES = 64
"""Number of faces, spread over the sensing surface, beside which its medium is looked up; all faces
of a sound surface have the same one."""


def check_design(
    design: SensorDesign, light_names: Collection[str] | None = None
) -> list[Diagnostic]:
    """Return all problems of a design that can be found without tracing light.

    They are: meshes that are empty, not closed or not finite, wrong units, missing meshes, unknown
    lights, lights or a camera inside something opaque, a camera inside a solid or too near to a
    part, a field of view that no lens has, a distortion that shows a point twice, a refractive
    index that no transparent material has, kinds that fail or return what can't be simulated,
    transparent parts that absorb all light, a sensing surface that faces the wrong way, lies off
    the elastomer, is mostly out of the camera's view or out of its focus, parts that cages have
    folded or pushed together, cages that would tear a sensing surface off its elastomer, solids
    that overlap with one priority, and provenance of values that don't exist. Fields, ranges and
    references between parts are checked when a design is created; they are checked again first, for
    edits inside lists and sections, and no other problem is looked for if one of them is wrong.

    Args:
        design: design to check.
        light_names: names of the lights of the library; None skips the check of light models.

    Returns:
        Problems in the order of the design file; an empty list if there are none.
    """
    problems = invalid_values(design)
    if problems:  # the other checks rely on valid values
        return problems
    meshes: Meshes = {}
    for name in design.parts:
        problems += _check_mesh(design, name, meshes)
    problems += unit_slips(design, meshes)
    of_kinds = kind_problems(design)
    lens = lens_problem(design.camera, design.where("camera", "fov"))
    folded = None if of_kinds else uniqueness_problem(design)  # this calls methods of kinds
    problems += [problem for problem in (lens, folded) if problem is not None]
    problems += [] if of_kinds else index_problems(design)
    problems += _check_finishes(design, meshes)
    problems += _check_lights(design, light_names)
    problems += of_kinds
    if not any(problem.severity == "error" for problem in problems):
        try:
            meshes = {n: m for n, m in design.deformed_meshes().items() if n in meshes}
        except DesignError as error:
            place = error.where or design.where("cages")
            problems.append(Diagnostic(error.message, place, error.hint))
        else:
            problems += _check_poses(design, meshes)
            problems += _check_sensing_surfaces(design, meshes)
            checks = (place_problem, view_problem, focus_problem)
            found = (check(design, meshes) for check in checks)
            problems += [problem for problem in found if problem is not None]
            problems += absorption_problems(design, meshes)
            bent = cage_problems(design, meshes)
            problems += bent
            problems += half_caged(design, meshes)
            problems += left_lights(design, meshes)
            if not any(problem.severity == "error" for problem in bent):
                problems += overlaps(design, meshes)
                problems += films(design, meshes)
    problems += _check_provenance(design)
    return problems


def _check_mesh(design: SensorDesign, name: str, meshes: Meshes) -> list[Diagnostic]:
    """Put the part's mesh into `meshes` unless it has a problem."""
    part = design.parts[name]
    place = design.where("parts", name, "mesh")
    try:
        mesh = design.valid_mesh(name)
    except (DesignError, MeshError) as error:
        return [Diagnostic(error.message, place, error.hint)]
    meshes[name] = mesh
    if part.role is Role.SENSING_SURFACE and mesh.is_closed:
        return [
            Diagnostic(
                f"part '{name}' is a sensing_surface, but its mesh is closed",
                place,
                "A sensing surface is open: only the coated faces of the elastomer",
                severity="warning",
            )
        ]
    return []


def _check_finishes(design: SensorDesign, meshes: Collection[str]) -> list[Diagnostic]:
    """Check that frosted and painted faces exist."""
    problems = []
    for name, part in design.parts.items():
        for label, finish in (part.faces or {}).items():
            if name not in meshes:
                continue
            where = design.where("parts", name, "faces", label)
            try:
                finished_faces(design.meshes[name], finish, f"'{label}' of part '{name}'", where)
            except DesignError as error:
                problems.append(Diagnostic(error.message, where, error.hint))
    return problems


def _check_lights(design: SensorDesign, light_names: Collection[str] | None) -> list[Diagnostic]:
    problems: list[Diagnostic] = []
    if sum(group.flux * len(group.lights) for group in design.lights.values()) <= 0.0:
        problems.append(
            Diagnostic(
                "no light is on: every picture will be black",
                design.where("lights"),
                "Add a light group, or set a flux above 0",
                severity="warning",
            )
        )
    for name, group in design.lights.items():
        if group.emitter is None and light_names is not None and group.model not in light_names:
            problems.append(
                Diagnostic(
                    f"light group '{name}' has an unknown model '{group.model}'",
                    design.where("lights", name, "model"),
                    unknown_light_hint(group.model, light_names),
                )
            )
    return problems


def unknown_light_hint(model: str, light_names: Collection[str]) -> str:
    """Return the hint for a light that the library lacks; it may be known on another machine."""
    near = suggestion(model, light_names) or "Name a light of the library"
    return (
        f"{near}{' ' if near.endswith('?') else '. '}If it is of somebody's own library, add it "
        "here with `optisense library add`, or describe it in the design under 'emitter'"
    )


def _check_poses(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Check that no light and no camera is inside an opaque solid."""
    opaque = {
        name: mesh
        for name, mesh in meshes.items()
        if design.parts[name].role in OPAQUE_ROLES and mesh.is_closed
    }
    if not opaque:
        return []
    poses = placed_things(design)
    points = np.array([position for _, position, _ in poses])
    problems = []
    for part, mesh in opaque.items():
        role = design.parts[part].role.value
        for (label, position, path), within in zip(poses, inside(points, mesh), strict=True):
            if within:
                at = ", ".join(f"{value:g}" for value in position)
                problems.append(
                    Diagnostic(
                        f"{label} is inside the opaque part '{part}' ({role}) at ({at})",
                        design.where(*path),
                        "Move it out, or make a hole in the part",
                    )
                )
    return problems


def _check_sensing_surfaces(design: SensorDesign, meshes: Meshes) -> list[Diagnostic]:
    """Check that normals of a sensing surface point into the medium behind it."""
    solids = [mesh for n, mesh in meshes.items() if design.parts[n].role in TRANSPARENT_SOLIDS]
    problems: list[Diagnostic] = []
    if not solids:
        return problems
    for name in design.parts_of(Role.SENSING_SURFACE):
        chosen, front, back = solids_beside(meshes[name], solids)
        place = design.where("parts", name, "mesh")
        outward = np.count_nonzero(back & ~front) / len(chosen)
        if outward > 0.0:
            share = "" if outward == 1.0 else f" on {100 * outward:.0f} % of its faces"
            problems.append(
                Diagnostic(
                    f"the sensing surface '{name}' faces outward{share}: its normals must look "
                    "into the elastomer, to where the light comes from",
                    place,
                    "Turn these faces of the mesh over",
                    severity="error" if outward > 0.5 else "warning",
                )
            )
        if np.count_nonzero(front | back) < len(chosen) / 2:
            problems.append(
                Diagnostic(
                    f"most of the sensing surface '{name}' does not lie on a transparent solid",
                    place,
                    "Let it share its faces with the elastomer, unless light reaches it in air",
                    severity="warning",
                )
            )
    return problems


def _check_provenance(design: SensorDesign) -> list[Diagnostic]:
    problems = []
    for path in design.provenance:
        try:
            get_value(design, path)
        except DesignError as error:
            problems.append(
                Diagnostic(
                    f"provenance is given for '{path}', which does not exist",
                    design.where("provenance", path),
                    error.hint,
                    severity="warning",
                )
            )
    return problems


def solids_beside(
    skin: TriangleMesh, solids: Iterable[TriangleMesh]
) -> tuple[NDArray[np.intp], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the numbers (k,) of up to `PROBES` faces spread over a sensing surface, and whether a
    solid lies in front (k,) and behind (k,) each of them, at a distance of `PROBE`.
    """
    chosen = np.linspace(0, len(skin.faces) - 1, min(PROBES, len(skin.faces))).astype(int)
    centres, normals = skin.triangles[chosen].mean(axis=1), skin.face_normals[chosen]
    front, back = np.zeros(len(chosen), dtype=bool), np.zeros(len(chosen), dtype=bool)
    for solid in solids:
        front |= inside(centres + PROBE * normals, solid)
        back |= inside(centres - PROBE * normals, solid)
    return chosen, front, back
