"""DIGIT: a domed gel on a thick acrylic window, lit through the window's edge by three LEDs.

Frame: the origin is the top of the gel, over the middle of its outline; +z points out of the
sensor, the half-round end points to +y and the straight end to -y. Outline, thicknesses, positions
of the LEDs along the edge, and camera are those of the published design; the height of the LEDs,
the scattering of the acrylic's edge and the material of the gel are not published and marked as
assumed.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from optisense import library
from optisense.array_types import FloatArray
from optisense.design import Cage, FaceFinish, Light, LightGroup, Part, Role, SensorDesign
from optisense.design.colour import NAMED_COLOURS
from optisense.geometry import TriangleMesh
from optisense.sensors._digit_sources import provenance
from optisense.sensors._half_round import HalfRound, stacked
from optisense.sensors._shapes import axial_camera
from optisense.sensors._sources import balanced_flux
from optisense.sensors.dimensions import Dimensions, Length, Positive, WholeNumber, builds, require

NAME = "digit"
GEL, WINDOW, HOUSING = "silicone-solaris", "acrylic", "black-plastic"
LED = "everlight-19-337"
CAMERA = "ovm7692"

CORNERS = (1.3, 0.5)
"""Radius of the corners at the straight end of gel and acrylic, mm, from the published CAD of DIGIT
(`_digit_sources`)."""

HALF_OVERHANG = 0.05
"""Distance by which the gel is wider than the acrylic on each side, mm, from the published CAD."""

OPENING_GAP = 0.09
"""Distance between the gel and the opening of the housing, mm: 18.58 mm for a gel of 18.4."""

CAVITY = (1.25, 2.5)
"""Room around the acrylic for the strip with the LEDs, mm: at its sides and round end, and at its
straight end (a cavity of 20.8 x 30 mm)."""

HOUSING_WALL = 1.5
"""Thickness of wall and floor of the housing, mm, an assumption; no light passes the walls."""

BEHIND_PUPIL = 2.0
"""Distance from the camera's pupil to the floor of the housing, mm, an assumption; the floor is
behind the camera and out of its sight."""

SMOOTHER = 16
"""Sides of the outline that the rings of the dome are cut from, for each side of a ring: their
corners lie on the outline itself but for 1/256 of the height of a ring's arcs over its sides."""

EDGE_STEPS = 6
"""Number of rings of the rounded edge of the gel: about 13 degrees each."""

SIDES = {
    "edge_right": (1.0, 0.0, 0.0),
    "edge_left": (-1.0, 0.0, 0.0),
    "edge_round": (0.0, 1.0, 0.0),
    "edge_straight": (0.0, -1.0, 0.0),
}
"""Faces of the acrylic's edge, and the direction in which each points."""


class DigitDimensions(Dimensions):
    """Dimensions of a DIGIT.

    Attributes:
        gel_width: width of the gel, mm; the half-round end has half of it as its radius, and the
            acrylic is 0.1 mm narrower.
        straight_length: distance from the straight end to the centre of the half round, mm.
        gel_thickness: thickness of the gel in its middle, mm.
        wall_height: height of the vertical wall around the gel, mm.
        dome_rise: height of the middle of the gel above the upper end of its rounded edge, mm.
        edge_inset: distance by which the rounded edge reaches inward, mm.
        window_thickness: thickness of the acrylic, mm.
        edge_roughness: GGX alpha of the acrylic's edge; 0 for a polished one.
        led_height: height of the middle of the LEDs above the acrylic's lower face, mm.
        led_pitch: distance along the acrylic's edge from the blue LED, in the middle of the
            straight end, to the red and the green one, mm.
        led_gap: air gap between an LED's window and the acrylic's edge, mm.
        led_flux: radiant flux of each LED, mW; None takes that of its weakest colour (library).
        pupil_distance: distance from the top of the gel to the camera's entrance pupil, mm.
        fov: field of view across the image width, degrees (46.83 across 240 of 240 x 320 pixels are
            60 along the 320).
        resolution: width and height of the picture, pixels.
        coating: name of a coating of the library.
        tessellation: approximate edge length of the largest triangles, mm.
    """

    sensor: ClassVar[str] = NAME

    gel_width: Positive = 18.4
    straight_length: Positive = 15.85
    gel_thickness: Positive = 4.07
    wall_height: Positive = 1.35
    dome_rise: Positive = 1.94
    edge_inset: Positive = 0.6
    window_thickness: Positive = 6.15
    edge_roughness: Length = 0.6
    led_height: Length = 4.6
    led_pitch: Positive = 34.0
    led_gap: Positive = 0.2
    led_flux: Length | None = None
    pupil_distance: Positive = 21.7
    fov: Length = 46.83
    resolution: tuple[WholeNumber, WholeNumber] = (240, 320)
    coating: str = "diffuse-grey"
    tessellation: Positive = 0.6


@builds(DigitDimensions)
def digit(size: DigitDimensions) -> SensorDesign:
    """Build a DIGIT.

    Args:
        size: the dimensions.

    Raises:
        DesignError: dimensions contradict one another; the message says which.
        LibraryError: there is no such coating.
    """
    centre = 0.5 * (size.straight_length - 0.5 * size.gel_width)
    outline = HalfRound(size.gel_width, size.straight_length, CORNERS[0], centre)
    edge = HalfRound(size.gel_width - 2.0 * HALF_OVERHANG, size.straight_length, CORNERS[1], centre)
    _check(outline, size.gel_thickness, size.wall_height + size.dome_rise, size.edge_inset)
    window_top = -size.gel_thickness
    window_bottom = window_top - size.window_thickness
    _check_lights(edge, size.window_thickness, size.led_height, size.led_pitch, size.edge_roughness)
    require(
        size.pupil_distance > size.gel_thickness + size.window_thickness,
        f"the camera's pupil, {size.pupil_distance:g} mm under the top of the gel, is inside the "
        f"acrylic, which ends {-window_bottom:g} mm under it",
        "Make pupil_distance larger, or window_thickness or gel_thickness smaller",
    )
    flux = balanced_flux(LED) if size.led_flux is None else size.led_flux
    lamp_z = window_bottom + size.led_height
    places = {"red": size.led_pitch, "green": -size.led_pitch, "blue": 0.0}
    design = SensorDesign(
        name=NAME,
        description="DIGIT, domed gel",
        coating=library.coating(size.coating),
        materials={name: library.material(name) for name in (GEL, WINDOW, HOUSING)},
        parts={
            "skin": Part(role=Role.SENSING_SURFACE, mesh="meshes/skin.obj"),
            "gel": Part(role=Role.ELASTOMER, mesh="meshes/gel.obj", material=GEL),
            "acrylic": Part(
                role=Role.SUPPORT,
                mesh="meshes/acrylic.obj",
                material=WINDOW,
                faces=_frosted(size.edge_roughness),
            ),
            "housing": Part(role=Role.BLOCKER, mesh="meshes/housing.obj", material=HOUSING),
        },
        lights={
            name: _led(edge, places[name], size.led_gap, lamp_z, NAMED_COLOURS[name], flux)
            for name in places
        },
        camera=axial_camera(CAMERA, size.fov, size.resolution, -size.pupil_distance),
        provenance=provenance(SIDES if size.edge_roughness else ()),
    )
    gel = _gel(
        outline,
        (size.gel_thickness, size.wall_height, size.dome_rise, size.edge_inset),
        size.tessellation,
    )
    design.meshes.update(
        skin=_coated(gel),
        gel=gel,
        acrylic=stacked(
            [_ring(edge.points(size.tessellation), z) for z in (window_bottom, window_top)]
        ),
        housing=_housing(
            outline,
            edge,
            (window_top, window_top + size.wall_height, -size.pupil_distance),
            size.tessellation,
        ),
    )
    design.cages = {"skin": Cage.around(["skin", "gel"], gel.bounds)}
    size.describe(design)
    return design


def _check(outline: HalfRound, thickness: float, curved: float, inset: float) -> None:
    """Check lengths in mm; `curved` is the height of wall and dome together."""
    require(
        outline.straight > outline.radius + CORNERS[0],
        f"straight_length {outline.straight:g} mm leaves no straight side: the half round takes "
        f"{outline.radius:g} mm of it",
        "Make straight_length larger or gel_width smaller",
    )
    require(
        curved < thickness,
        f"wall_height and dome_rise are together {curved:g} mm, the gel is only "
        f"{thickness:g} mm thick",
        "Make gel_thickness larger, or wall_height or dome_rise smaller",
    )
    require(
        inset < 0.5 * outline.radius,
        f"edge_inset {inset:g} mm leaves no dome on a gel {outline.width:g} mm wide",
        "Make edge_inset smaller",
    )


def _check_lights(
    edge: HalfRound, thickness: float, height: float, pitch: float, roughness: float
) -> None:
    """Check the positions of the LEDs, all lengths in mm."""
    require(
        0.0 < height < thickness,
        f"led_height {height:g} mm is not on the acrylic's edge, {thickness:g} mm high",
        f"Give a height between 0 and {thickness:g} mm",
    )
    require(
        pitch <= edge.half_way,
        f"led_pitch {pitch:g} mm passes the middle of the half round, which is "
        f"{edge.half_way:.4g} mm from the blue LED",
        "Make led_pitch smaller",
    )
    require(
        0.0 <= roughness <= 1.0,
        f"edge_roughness is {roughness:g}",
        "Give a GGX alpha from 0 (polished) to 1",
    )


def _frosted(roughness: float) -> dict[str, FaceFinish] | None:
    """Return the finish of the acrylic's edge, or None if it is polished."""
    if roughness == 0.0:
        return None
    return {
        name: FaceFinish(direction=direction, within=50.0, roughness=roughness)
        for name, direction in SIDES.items()
    }


def _led(
    edge: HalfRound,
    along: float,
    gap: float,
    z: float,
    colour: tuple[float, float, float],
    flux: float,
) -> LightGroup:
    """Return an LED that shines into the edge, `along` mm from the middle of its straight end."""
    (x, y), (nx, ny) = edge.at(along)
    light = Light(
        position=(x + gap * nx, y + gap * ny, z), direction=(-nx, -ny, 0.0), up=(0.0, 0.0, 1.0)
    )
    return LightGroup(model=LED, colour=colour, flux=flux, lights=[light])


def _ring(points: FloatArray, z: float | FloatArray) -> FloatArray:
    return np.column_stack([points, np.broadcast_to(z, len(points))])


def _gel(
    outline: HalfRound, heights: tuple[float, float, float, float], tessellation: float
) -> TriangleMesh:
    """Return a plate with a vertical wall, a rounded edge and a dome, with its top at z = 0.

    The dome rises with the square of the distance from its rim towards the middle. The rounded edge
    is a parabola that begins vertical at the wall and meets the dome at the dome's mean slope, so
    all corners lie in horizontal rings. `heights` are those of the whole gel, its wall and its
    dome, and the inset of the edge, mm.
    """
    thickness, wall, rise, inset = heights
    rim_z = -rise
    wall_z = wall - thickness
    edge = outline.inset(inset)
    foot, rim = outline.points(tessellation), edge.like(outline, tessellation)
    smooth = edge.points(tessellation / SMOOTHER)
    reach = np.linalg.norm(rim, axis=1)
    slope = 2.0 * rise / reach * np.linalg.norm(foot - rim, axis=1)
    steep = max(rim_z - float(slope.mean()), 0.5 * (wall_z + rim_z))
    rings = [_ring(foot, -thickness), _ring(foot, wall_z)]
    for t in np.linspace(0.0, 1.0, EDGE_STEPS + 1)[1:-1]:
        out, bend, end = (1.0 - t) ** 2, 2.0 * t * (1.0 - t), t * t
        rings.append(
            _ring((out + bend) * foot + end * rim, out * wall_z + bend * steep + end * rim_z)
        )
    rings.append(_ring(rim, rim_z))
    count = max(4, math.ceil(reach.mean() / tessellation))
    for share in np.linspace(1.0, 0.0, count + 1)[1:-1]:
        corners = max(12, math.ceil(share * len(rim)))
        rings.append(_ring(share * _resampled(smooth, corners), -rise * share * share))
    mesh = stacked(rings)
    vertices = mesh.vertices.copy()
    vertices[-1, 2] = 0.0  # the top
    return mesh.with_vertices(vertices)


def _resampled(polygon: FloatArray, count: int) -> FloatArray:
    """Return points (count, 2) spread over the sides of a closed polygon by their numbers."""
    where = np.arange(count) * (len(polygon) / count)
    closed = np.concatenate([polygon, polygon[:1]])
    steps = np.arange(len(closed))
    return np.column_stack([np.interp(where, steps, closed[:, axis]) for axis in (0, 1)])


def _coated(gel: TriangleMesh) -> TriangleMesh:
    """Return all faces of the gel but its flat underside, on its vertices, turned into the gel."""
    bottom = gel.bounds[0, 2]
    coated = ~(gel.triangles[:, :, 2] == bottom).all(axis=1)
    return gel.with_faces(gel.faces[coated]).compacted().flipped()


def _housing(
    gel: HalfRound, edge: HalfRound, levels: tuple[float, float, float], tessellation: float
) -> TriangleMesh:
    """Return a tub with an opening for the gel in its roof, closed behind the camera; its levels
    (mm) are z of the roof's underside, of its top, and of the camera's pupil.
    """
    roof, top, pupil = levels
    floor = pupil - BEHIND_PUPIL

    def around(inner: HalfRound, aside: float, end: float) -> HalfRound:
        return HalfRound(
            inner.width + 2.0 * aside, inner.straight + aside + end, inner.corner + aside,
            inner.centre,
        )  # fmt: skip

    opening = around(gel, OPENING_GAP, 0.0)
    cavity = around(edge, *CAVITY)
    outside = around(cavity, HOUSING_WALL, 0.0)
    hole, room, wall = (each.like(cavity, tessellation) for each in (opening, cavity, outside))
    return stacked(
        [
            _ring(room, floor),
            _ring(room, roof),
            _ring(hole, roof),
            _ring(hole, top),
            _ring(wall, top),
            _ring(wall, floor - HOUSING_WALL),
        ]
    ).flipped()
