"""A sensor as a rigid body: its meshes, mass, inertia and frames, in metres and kilograms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from optisense.array_types import FloatArray
from optisense.design import Role, SensorDesign
from optisense.design.colour import ROLE_LOOKS
from optisense.design.projection import image_edges
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh_points import closest_points
from optisense.geometry.overlaps import CONTACT
from optisense.geometry.solids import as_manifold, of_manifold, thick_place, united
from optisense.mechanics import elasticity_of
from optisense.robots._collision import COVERED, depth_in, free_hulls, gel_hulls
from optisense.robots._densities import density_of
from optisense.workshop.export import file_name
from optisense.workshop.shapes import Shape, is_air, shapes

METRES = 1e-3
"""Length of one mm, m: robot files are in metres, designs in mm."""
KILOGRAMS = 1e-6
"""Mass of one mm^3 of a density of 1 g/cm^3, kg."""
ASIDE = 1e-2
"""Distance (mm) by which the centroid of a skin is moved to the right to find the point next to it:
far above the rounding of coordinates in mesh files (2e-6 mm), and far below the size of a skin."""
UPWARD = 0.05
"""Share of `ASIDE` by which the centroid is moved upward as well, since two facets of a tube may be
equally far to the right. It is small, so that right decides before up, yet above rounding."""
WIDEST_PINHOLE = 170.0
"""Largest vertical angle (degrees) of the pinhole camera that stands for a fisheye. A pinhole sees
less than 180 degrees, and near this limit nearly all of its picture shows the rim of its view."""
LEAST_INERTIA = 1e-13
"""Smallest principal moment of inertia, kg m^2: MuJoCo takes 1e-15 for 0. A cube of 1 mm of plastic
has 2e-13, and a sensor more."""
RESERVED = "world"
"""Name that the body without motion has in simulators, and no other one can have."""


@dataclass(frozen=True, eq=False)
class Frame:
    """Pose in the frame of the sensor.

    Attributes:
        origin: (3,) m.
        axes: (3, 3) unit vectors x, y and z, as columns.
    """

    origin: FloatArray
    axes: FloatArray


@dataclass(frozen=True)
class BodyMesh:
    """Mesh of a part.

    Attributes:
        name: name, also of its file.
        mesh: mesh in the frame of the sensor, m.
        colour: R, G, B and opacity, 0 to 1.
        is_closed: whether it encloses a volume.
        is_gel: whether it is of an elastomer.
    """

    name: str
    mesh: TriangleMesh
    colour: tuple[float, float, float, float]
    is_closed: bool
    is_gel: bool


@dataclass(frozen=True, eq=False)
class Skin:
    """Sensing surface.

    Attributes:
        suffix: what the names of its frame and its touch sensor end with: nothing for the only
            skin of a sensor, else `-` and the name of the part.
        frame: the origin is its point next to its centroid (of several, the one farthest to the
            right in the picture), z points out of the sensor and x as near to the right of the
            picture as it can, or to its top if z points to the right.
        box: middle and half the sides of a box around the skin, in its frame, m.
    """

    suffix: str
    frame: Frame
    box: tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class SensorBody:
    """Sensor as a rigid body, in the frame of the design but in metres.

    Attributes:
        name: name of the design, of letters, digits, '-' and '_'; `world-sensor` for `world`.
        looks: meshes to be shown.
        hulls: convex meshes for contacts.
        mass: kg.
        centre: (3,) centre of mass, m.
        inertia: (3, 3) about the centre of mass along the axes of the frame, kg m^2.
        camera: pose of the camera: x to the right and y down in the picture, z where it looks.
        camera_angle: vertical angle of view of a pinhole camera with its axis in the middle of the
            picture, degrees.
        camera_middle: place (across, down) of the camera's axis in the picture, in shares of its
            width and height.
        resolution: width and height of the picture, pixels.
        skins: the sensing surfaces, in the order of the design.
        friction: friction of the gel.
        notes: what a user must know, one sentence each.
    """

    name: str
    looks: list[BodyMesh]
    hulls: list[BodyMesh]
    mass: float
    centre: FloatArray
    inertia: FloatArray
    camera: Frame
    camera_angle: float
    camera_middle: tuple[float, float]
    resolution: tuple[int, int]
    skins: list[Skin]
    friction: float
    notes: list[str] = field(default_factory=list)


def sensor_body(
    design: SensorDesign,
    *,
    mass: float | None = None,
    densities: Mapping[str, float] | None = None,
) -> SensorBody:
    """Return a design as a rigid body.

    Solids that overlap are cut out of each other as in the simulation: opaque parts out of
    transparent ones, and those of higher priority out of others.

    Args:
        mass: mass of the whole sensor (g), such as a real one weighs; masses of parts are scaled to
            it. Without it the mass is that of the parts.
        densities: densities (g/cm^3) of parts by name; the others have those of
            `optisense.robots._densities`.

    Raises:
        DesignError: a part has no mesh or lies outside of its cage; nothing of the sensor is solid,
            or only within air; there is no sensing surface; a mass or density is not above 0, or so
            small that the inertia is none; or a density is of no solid part.
    """
    made = shapes(design)
    skins = [each for each in made if each.role is Role.SENSING_SURFACE]
    if not skins:
        raise DesignError("the design has no sensing surface", where=design.where("parts"))
    solids = [each for each in made if each.is_solid]
    given = dict(densities or {})
    _check(design, solids, mass, given)
    notes: list[str] = []
    real = _without_overlaps(design, solids)
    # The faces of solids that lie in one plane but for rounding leave slivers.
    for each in [each for each in solids if thick_place(real[each.name], CONTACT) is None]:
        solids.remove(each)
        notes.append(
            f"{each.name} has neither mass nor contacts, as other parts fill all of its space"
        )
    notes += [
        f"{each.name} has neither mass nor contacts, as it is a sheet without a thickness"
        for each in made
        if not each.is_solid and each.role is not Role.SENSING_SURFACE
    ]
    if not solids:
        raise DesignError("parts of air fill the space of all solids", where=design.where("parts"))
    masses = [given.get(each.name, density_of(each)) * KILOGRAMS for each in solids]
    total, centre, inertia = mass_properties([real[each.name] for each in solids], masses)
    if mass is None:
        of = ", ".join(f"{s.name} {m / KILOGRAMS:g}" for s, m in zip(solids, masses, strict=True))
        notes.append(
            f"the mass is {1e3 * total:.3g} g by densities in g/cm^3 ({of}), without what "
            "the design does not contain, such as screws; you can give what a real sensor weighs"
        )
    else:
        inertia *= 1e-3 * mass / total
        total = 1e-3 * mass
    least = float(np.linalg.eigvalsh(inertia)[0])
    if least < LEAST_INERTIA:
        raise DesignError(
            f"with a mass of {1e3 * total:.3g} g, the smallest moment of inertia is {least:.2g} "
            "kg m^2, which simulators take for 0",
            hint="Give a larger mass, or check densities (g/cm^3) and the size of parts (mm)",
        )
    hulls = _hulls(solids, real, TriangleMesh.joined([each.mesh for each in skins]), notes)
    camera = design.camera
    right, up, forward = camera.axes()
    _tell_of_camera(design, notes)
    name = file_name(design.name)
    return SensorBody(
        name=f"{name}-sensor" if name == RESERVED else name,
        looks=[_body_mesh(each.name, each.mesh, each) for each in made],
        hulls=hulls,
        mass=total,
        centre=centre,
        inertia=inertia,
        camera=Frame(METRES * np.array(camera.position), np.stack([right, -up, forward], axis=1)),
        camera_angle=_vertical_angle(design),
        camera_middle=(0.5, 0.5) if camera.distortion is None else camera.distortion.centre,
        resolution=camera.resolution,
        skins=[
            _skin(each.mesh, f"-{each.name}" if len(skins) > 1 else "", right, up) for each in skins
        ],
        friction=elasticity_of(design).friction,
        notes=notes,
    )


def _check(
    design: SensorDesign, solids: list[Shape], mass: float | None, densities: dict[str, float]
) -> None:
    names = [each.name for each in solids]
    if not names:
        raise DesignError("no part of the design is solid", where=design.where("parts"))
    for name in densities:
        if name not in names:
            raise DesignError(
                f"there is no solid part '{name}' to have a density",
                hint=f"The solid parts are {', '.join(names)}",
            )
    numbers = {f"the density of '{name}'": value for name, value in densities.items()}
    if mass is not None:
        numbers["the mass"] = mass
    for what, value in numbers.items():
        if not (np.isfinite(value) and value > 0.0):
            raise DesignError(f"{what} is {value:g}", hint="Give a number above 0")


def _without_overlaps(design: SensorDesign, solids: list[Shape]) -> dict[str, Any]:
    """Return the space that each solid keeps, as manifolds by name."""
    transparent = (Role.ELASTOMER, Role.SUPPORT)

    def rank(name: str) -> tuple[bool, int]:
        part = design.parts[name]
        return part.role not in transparent, part.priority

    bodies = {each.name: as_manifold(each.mesh) for each in solids}
    meshes = design.deformed_meshes()
    air = [name for name in design.parts if is_air(design, name) and meshes[name].is_closed]
    bodies |= {name: as_manifold(united(meshes[name])) for name in air}
    kept, taken = {}, None
    for name in sorted(bodies, key=rank, reverse=True):
        body = bodies[name]
        kept[name] = body if taken is None else body - taken
        taken = body if taken is None else taken + body
    return kept


def mass_properties(
    bodies: list[Any], densities: list[float]
) -> tuple[float, FloatArray, FloatArray]:
    """Return the mass (kg), the centre (3,), m, and the inertia (3, 3), kg m^2, about it, of closed
    bodies (`manifold3d.Manifold`, mm), with the mass (kg) of one mm^3 of each.
    """
    from trimesh.triangles import mass_properties as properties_of

    found = [
        properties_of(of_manifold(body).triangles, density=density)
        for body, density in zip(bodies, densities, strict=True)
    ]
    masses = np.array([each.mass for each in found])
    centres = METRES * np.array([each.center_mass for each in found])
    centre = masses @ centres / masses.sum()
    inertia = METRES**2 * np.sum([np.asarray(each.inertia) for each in found], axis=0)
    for mass, offset in zip(masses, centres - centre, strict=True):  # the parallel axis theorem
        inertia += mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return float(masses.sum()), centre, inertia


def _hulls(
    solids: list[Shape], real: dict[str, Any], skin: TriangleMesh, notes: list[str]
) -> list[BodyMesh]:
    """Return the convex bodies for contacts."""
    found: list[BodyMesh] = []
    for shape in solids:
        is_gel = shape.role is Role.ELASTOMER
        if is_gel:
            hulls, left_out = gel_hulls(real[shape.name], skin.vertices), False
        else:
            hulls, left_out = free_hulls(real[shape.name], skin.vertices)
        if left_out:
            notes.append(
                f"a piece of {shape.name} takes no part in contacts, as its convex hull would "
                "cover the skin"
            )
        off = 0.0
        for number, hull in enumerate(hulls, start=1):
            mesh = of_manifold(hull)
            if is_gel:
                off = max(off, float(depth_in(skin.vertices, ConvexHull(mesh.vertices)).max()))
            name = f"{shape.name}-hull{f'-{number}' if len(hulls) > 1 else ''}"
            found.append(_body_mesh(name, mesh, shape))
        if off > COVERED:
            notes.append(f"the convex hulls of {shape.name} stand up to {off:.2g} mm off the skin")
    return found


def _body_mesh(name: str, mesh: TriangleMesh, shape: Shape) -> BodyMesh:
    if len(mesh.vertices) < 4:
        mesh = _divided(mesh)
    text, opacity = ROLE_LOOKS[shape.role.value]
    red, green, blue = (int(text[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return BodyMesh(
        name,
        TriangleMesh(METRES * mesh.vertices, mesh.faces),
        (red, green, blue, opacity),
        shape.is_solid,
        shape.role is Role.ELASTOMER,
    )


def _divided(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh with a vertex in the middle of each face: MuJoCo takes none of fewer than 4."""
    middles = len(mesh.vertices) + np.arange(len(mesh.faces), dtype=mesh.faces.dtype)
    ends = [np.column_stack([mesh.faces[:, [k, (k + 1) % 3]], middles]) for k in range(3)]
    vertices = np.concatenate([mesh.vertices, mesh.triangles.mean(axis=1)])
    return TriangleMesh(vertices, np.concatenate(ends))


def _skin(mesh: TriangleMesh, suffix: str, right: FloatArray, up: FloatArray) -> Skin:
    """Return a sensing surface with its frame and the box around it."""
    frame = _skin_frame(mesh, right, up)
    local = METRES * mesh.vertices @ frame.axes - frame.origin @ frame.axes
    low, high = local.min(axis=0), local.max(axis=0)
    return Skin(suffix, frame, ((low + high) / 2.0, (high - low) / 2.0))


def _skin_frame(skin: TriangleMesh, right: FloatArray, up: FloatArray) -> Frame:
    """Return the pose of the skin at its point next to its centroid.

    Of several points at the same distance, as on a tube, it is the one farthest to the right in
    the picture.
    """
    areas = np.linalg.norm(skin.face_vectors, axis=1)
    centroid = (areas[:, None] * skin.triangles.mean(axis=1)).sum(axis=0) / areas.sum()
    aside = centroid + ASIDE * (right + UPWARD * up)
    face = int(np.nanargmin(np.linalg.norm(closest_points(skin, aside) - aside, axis=1)))
    nearest = closest_points(skin, centroid)[face]
    # Faces of the sensing surface are wound so that their normals point into the sensor.
    z = -skin.face_normals[face]
    across = right if abs(right @ z) < 0.9 else up
    x = across - (across @ z) * z
    x /= np.linalg.norm(x)
    return Frame(METRES * nearest, np.stack([x, np.cross(z, x), z], axis=1))


def _vertical_angle(design: SensorDesign) -> float:
    """Return the vertical angle of view of the pinhole camera, degrees."""
    high = image_edges(design.camera)[1]
    angle = 2.0 * (high if design.camera.projection == "equidistant" else np.arctan(high))
    return float(min(np.degrees(angle), WIDEST_PINHOLE))


def _tell_of_camera(design: SensorDesign, notes: list[str]) -> None:
    """Say what a pinhole camera in a robot simulator leaves out."""
    if design.camera.projection == "equidistant":
        notes.append("the camera is a fisheye, and a simulator's camera is a pinhole")
    lens = design.camera.distortion
    if lens is not None and any(lens.coefficients()):
        notes.append("the camera's lens distorts, which a simulator's camera does not")
    if design.parts_of(Role.MIRROR):
        notes.append("the camera looks by way of mirrors, which a simulator's camera does not")
