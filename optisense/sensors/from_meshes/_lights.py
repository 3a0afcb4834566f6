"""Placement of the lights of a group: along a side of a part, around it, or over a surface."""

from __future__ import annotations

import numpy as np
import shapely

from optisense.array_types import FloatArray
from optisense.design import Light
from optisense.design.limits import refuse_far
from optisense.design.posing import triple
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.patches import Faces, mean_normal, middle
from optisense.geometry.surface import nearest_place
from optisense.sensors.from_meshes._board_section import BoardSection
from optisense.sensors.from_meshes.directions import Direction, axis_of, radial_vector, vector
from optisense.sensors.from_meshes.recipe_lights import LightRow, LightsOver, Ring

FLAT = 1e-4
"""Largest deviation from a plane of a reference surface that counts as flat, mm."""

SPREAD = 0.2
"""Smallest length of the mean of a surface's unit normals that defines its direction."""


def row(choice: LightRow, bounds: FloatArray) -> list[Light]:
    """Return lights along one side of a box (2, 3), mm, centred on the side."""
    across, sign = axis_of(choice.side)
    along = axis_along(choice, bounds)
    size = bounds[1] - bounds[0]
    third = 3 - across - along
    offsets = evenly(choice.count, choice.pitch, size[along])
    places = np.tile(bounds.mean(axis=0), (choice.count, 1))
    places[:, along] += offsets + choice.shift
    places[:, across] = bounds[1 if sign > 0 else 0, across] + sign * choice.gap
    if choice.height is not None:
        places[:, third] = choice.height
    into = -sign * np.eye(3)[across]
    way = into if choice.direction is None else vector(choice.direction)
    return [light(place, way, np.eye(3)[third]) for place in places]


def axis_along(choice: LightRow, bounds: FloatArray) -> int:
    """Return the axis, 0, 1 or 2, along which a row runs at its side of a box (2, 3).

    Raises:
        DesignError: the given axis points into the side itself.
    """
    across, _ = axis_of(choice.side)
    others = [axis for axis in range(3) if axis != across]
    size = bounds[1] - bounds[0]
    if choice.along is None:
        return others[0] if size[others[0]] >= size[others[1]] else others[1]
    along = "xyz".index(choice.along)
    if along == across:
        raise DesignError(
            f"a row at side {choice.side} can't run along {choice.along}",
            hint="Choose along: one of " + ", ".join("xyz"[axis] for axis in others),
        )
    return along


def ring(choice: Ring, bounds: FloatArray) -> list[Light]:
    """Return lights in a circle around a part with bounds (2, 3), mm, or evenly over an arc with
    one at each end.

    Angles count from the axis after the circle's own (x, y, z, x ...), anticlockwise seen from the
    direction of the axis.
    """
    axis, sign = axis_of(choice.axis)
    first, second = np.eye(3)[(axis + 1) % 3], sign * np.eye(3)[(axis + 2) % 3]
    size = np.delete(bounds[1] - bounds[0], axis)
    radius = choice.radius if choice.radius is not None else 0.5 * size.max() + choice.gap
    centre = bounds.mean(axis=0)
    if choice.height is not None:
        centre[axis] = choice.height
    turn = choice.end - choice.start
    full = abs(abs(turn) - 360.0) < 1e-9
    step = turn / (choice.count if full else max(choice.count - 1, 1))
    lights = []
    for number in range(choice.count):
        angle = np.radians(choice.start + number * step)
        outward = np.cos(angle) * first + np.sin(angle) * second
        way = radial_vector(choice.direction, outward)
        tangent = -np.sin(angle) * first + np.cos(angle) * second
        upright = tangent if abs(way @ np.eye(3)[axis]) > 0.9 else np.eye(3)[axis]
        lights.append(light(centre + radius * outward, way, upright))
    return lights


def over(choice: LightsOver, mesh: TriangleMesh, patches: list[Faces], where: str) -> list[Light]:
    """Return lights over a surface: one on the middle of each patch, or a row or grid on the
    largest.

    A grid follows the longer side of the surface's outline; on a curved surface its pitch is, and
    without one the available length, measured along the surface.

    Raises:
        DesignError: lights fall off the surface or in a hole, its normals point in all directions,
            or a row has no ends.
    """
    if choice.count is None:
        groups = patches if choice.patches != "largest" else patches[:1]
        spots = [(middle(mesh, patch), _mean_direction(mesh, patch, where)) for patch in groups]
        sides = [_frame(mesh, patch, where)[1] for patch in groups]
    else:
        patch = patches[0]
        if choice.patches == "all":
            patch = np.concatenate(patches)
        spots = _grid(choice, mesh, patch, where)
        sides = [_frame(mesh, patch, where)[1]] * len(spots)
    lights = []
    for (place, normal), side in zip(spots, sides, strict=True):
        way = _direction(choice.direction, normal)
        lights.append(light(place + choice.gap * normal, way, side))
    return lights


def evenly(count: int, pitch: float | None, length: float) -> FloatArray:
    """Return positions (count,) about 0, mm; without a pitch, each is in the middle of its share of
    `length`.
    """
    step = pitch if pitch is not None else length / count
    return np.asarray((np.arange(count) - 0.5 * (count - 1)) * step)


def light(place: FloatArray, way: FloatArray, up: FloatArray) -> Light:
    """Return a light with rounded numbers, which make a design easier to read.

    Raises:
        DesignError: the place is more than a metre from the origin.
    """
    refuse_far("a light", place)
    position, direction, upward = (triple(np.round(v, 6) + 0.0) for v in (place, way, up))
    parallel = np.linalg.norm(np.cross(way, up)) < 1e-6
    return Light(position=position, direction=direction, up=None if parallel else upward)


def _direction(given: Direction, normal: FloatArray) -> FloatArray:
    """Return the unit direction (3,) of a light over a surface with this normal (3,)."""
    if isinstance(given, str) and given in ("normal", "-normal"):
        return normal if given == "normal" else -normal
    return vector(given)


def _grid(
    choice: LightsOver, mesh: TriangleMesh, patch: Faces, where: str
) -> list[tuple[FloatArray, FloatArray]]:
    """Return position and normal of each light of a row or grid."""
    along, across, normal, outline = _frame(mesh, patch, where)
    count = choice.count if isinstance(choice.count, tuple) else (choice.count or 1, 1)
    pitch = choice.pitch if isinstance(choice.pitch, tuple) else (choice.pitch, choice.pitch)
    centre, size = outline
    points = mesh.vertices[np.unique(mesh.faces[patch])]
    height = (points - centre) @ normal
    if np.ptp(height) > FLAT:
        part = mesh.with_faces(mesh.faces[patch]).compacted().welded()
        return _on_curve(part, (along, across, normal, centre), count, pitch, where)
    columns, rows = evenly(count[0], pitch[0], size[0]), evenly(count[1], pitch[1], size[1])
    flat = shapely.union_all(
        shapely.polygons(
            np.stack([(mesh.triangles[patch] - centre) @ axis for axis in (along, across)], axis=2)
        )
    )
    spots = []
    for v in rows:
        for u in columns:
            if flat.distance(shapely.Point(u, v)) > FLAT:
                raise _off(where, u, v)
            place = centre + u * along + v * across + height.mean() * normal
            spots.append((np.asarray(place), normal))
    return spots


def _on_curve(
    board: TriangleMesh,
    frame: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    count: tuple[int, int],
    pitch: tuple[float | None, float | None],
    where: str,
) -> list[tuple[FloatArray, FloatArray]]:
    """Return lights as on a flat surface, but with distances measured along the surface: from its
    middle along the row through it, and from there across.

    Args:
        frame: unit vectors (3,) along and across the board and along its normal, and the middle
            (3,) of its outline, mm.
    """
    along, across, normal, centre = frame

    def section(origin: FloatArray, way: FloatArray, up: FloatArray, u: float) -> BoardSection:
        found = BoardSection.of(board, origin, way, up)
        if found is None:
            raise _off(where, u, 0.0)
        return found

    def column(u: float) -> BoardSection:
        foot = lengthwise.at(u)
        if foot is None:
            raise _off(where, u, 0.0)
        return section(foot.point, across, foot.normal, u)

    def places(number: int, line: BoardSection) -> FloatArray:
        if pitch[number] is not None:
            return evenly(count[number], pitch[number], 0.0)
        first, last = line.distances[[0, -1]]
        return evenly(count[number], None, last - first) + 0.5 * (first + last)

    lengthwise = section(centre, along, normal, 0.0)
    rows = places(1, column(0.0)).tolist()
    columns = {u: column(u) for u in places(0, lengthwise).tolist()}
    spots = []
    for v in rows:
        for u, line in columns.items():
            spot = line.at(v)
            if spot is None:
                raise _off(where, u, v)
            found = nearest_place(board, spot.point)
            if np.linalg.norm(found.point - spot.point) > FLAT:
                raise _off(where, u, v)
            spots.append((found.point, found.inward))
    return spots


def _off(where: str, u: float, v: float) -> DesignError:
    """Return the error of a light at u, v (mm) that is not over the surface."""
    return DesignError(
        f"a light ({u:.2f}, {v:.2f}) mm from the middle of the surface is off it, or in a hole",
        where=where,
        hint="Choose a smaller pitch or count, or another surface",
    )


def _mean_direction(mesh: TriangleMesh, patch: Faces, where: str) -> FloatArray:
    """Return the unit mean normal (3,) of faces.

    Raises:
        DesignError: the normals point in all directions.
    """
    normal = mean_normal(mesh, patch)
    length = float(np.linalg.norm(normal))
    if length < SPREAD:
        raise DesignError(
            "this surface faces all sides, so the places of its lights can't be derived",
            where=where,
            hint="Select faces with towards: (+z, -x, ...), or use a ring",
        )
    return normal / length


def _frame(
    mesh: TriangleMesh, patch: Faces, where: str
) -> tuple[FloatArray, FloatArray, FloatArray, tuple[FloatArray, FloatArray]]:
    """Return unit vectors along the longer and the shorter side of a surface, its normal, and the
    middle (3,) and the size (2,) of its outline, mm.
    """
    normal = _mean_direction(mesh, patch, where)
    points = mesh.vertices[np.unique(mesh.faces[patch])]
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    x = np.cross(helper, normal)
    x /= np.linalg.norm(x)
    y = np.cross(normal, x)
    box = shapely.MultiPoint(np.stack([points @ x, points @ y], axis=1)).minimum_rotated_rectangle
    corners = np.asarray(shapely.get_coordinates(box))
    sides = np.diff(corners[:3], axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    directions = [(s[0] * x + s[1] * y) / n for s, n in zip(sides, lengths, strict=True)]
    if abs(lengths[0] - lengths[1]) < 1e-3 * lengths.max():  # a square: in the order x, y, z
        order = sorted((0, 1), key=lambda k: int(np.argmax(np.abs(directions[k]))))
    else:
        order = sorted((0, 1), key=lambda k: -lengths[k])
    along = directions[order[0]]
    along = along * np.sign(along[int(np.argmax(np.abs(along)))])
    across = np.cross(normal, along)
    flat = corners[:4].mean(axis=0)
    depth = float((points @ normal).mean())
    centre = np.asarray(flat[0] * x + flat[1] * y + depth * normal)
    return along, across, normal, (centre, lengths[order])
