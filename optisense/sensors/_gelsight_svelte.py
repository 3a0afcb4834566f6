"""GelSight Svelte: a finger whose single camera sees the whole palm by a flat and a curved mirror.

Frame: the origin is the camera's entrance pupil, x points from the back of the finger to its palm,
z from the base to the tip, y across. Light from the palm is reflected by the curved mirror M1 on
the back and the flat mirror M2 under the palm, and enters the camera.

No drawing of the sensor is published. The side view was measured in an animation on its first
author's web site, to about a pixel, at an assumed scale of 0.70 mm a pixel. Derived and assumed
numbers are marked in the design.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import SkipValidation

from optisense import library
from optisense.design import Cage, Camera, LightGroup, Part, Role, SensorDesign, Share
from optisense.design.cage import as_points
from optisense.design.colour import NAMED_COLOURS
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.cage import cage_points
from optisense.sensors._shapes import ribbon, row_of_lights, strip
from optisense.sensors._sources import balanced_flux
from optisense.sensors._svelte_body import LED, check_mirrors, housing, led_covers
from optisense.sensors._svelte_profile import CurvedMirror, FlatMirror, Palm, Points
from optisense.sensors._svelte_sources import provenance
from optisense.sensors.dimensions import Dimensions, Length, Positive, WholeNumber, builds, require

NAME = "gelsight-svelte"
GEL, MIRROR = "silicone-xp565", "mirror-silver"

VIEWS = ("m2", "palm")

PALM_OUTLINE = (
    (25.6, 22.0), (22.6, 32.6), (20.3, 41.7), (18.4, 49.3), (17.5, 54.6), (17.4, 59.2),
    (18.1, 67.6), (19.2, 76.6), (20.3, 84.6), (19.2, 89.5), (15.3, 92.4),
)  # fmt: skip
"""Outline of the palm as (x, z), mm, from base to tip; `_svelte_sources` has its provenance."""

BACK_OUTLINE = (
    (-9.0, -7.7), (-9.0, 5.0), (-1.7, 10.2), (-2.9, 14.4), (-4.8, 26.5), (-5.7, 35.6),
    (-5.7, 43.3), (-4.1, 56.9), (-1.3, 72.9), (2.9, 85.0), (6.6, 93.0),
)  # fmt: skip
"""Outline of the back as (x, z) in mm, from the bottom of the base to the tip."""


class GelSightSvelteDimensions(Dimensions):
    """Dimensions of a GelSight Svelte.

    Attributes:
        palm_outline: points (x, z) of the coated face of the skin, from base to tip, mm.
        back_outline: corners (x, z) of the body's back, from base to tip, mm.
        gel_thickness: thickness of the gel, mm.
        gel_width: width of gel and skin, mm.
        m1_ends: ends (x, z) of M1 at the base and at the tip, when bent by `m1_sagitta`, mm.
        m1_sagitta: distance of the middle of M1 behind the chord between its ends, mm.
        m1_width: width of M1, mm.
        m1_grid: number of vertices of M1 along and across the finger.
        mirror_thickness: thickness of M1 and M2 for manufacturing, behind their faces, mm; light
            meets the faces.
        wall_thickness: thickness of body, side walls and LED covers for manufacturing, outside of
            their inner faces, mm.
        clearance: distance between the most curved M1 and the skin, mm.
        m2_bottom: end (x, z) of M2 at the base, mm.
        m2_tilt: angle of M2 to the z axis, degrees, its upper end towards the palm.
        m2_length: length of M2, mm; None takes 24.3 mm or as much of it as can see M1 past the gel.
        m2_width: width of M2, mm.
        view: aim of the camera: "m2" is the whole length of M2, of which the lowest part looks past
            M1; "palm" is only the part that shows the palm, as a picture cropped to the finger.
        fov: field of view across the image width, which runs along the finger, degrees; None takes
            the one for `view`.
        resolution: width and height of the picture, pixels.
        leds_per_side: number of LEDs in each of the two rows along the finger.
        led_pitch: distance between LEDs of a row, mm.
        led_gap: air gap between an LED's window and the gel, mm; above 0.
        led_flux: radiant flux of each LED, mW; None takes that of its weakest colour (library).
        tip_leds: number of blue LEDs behind the gel's end at the tip.
        coating: name of a coating of the library.
        tessellation: edge length of the triangles of the skin, mm.
    """

    sensor: ClassVar[str] = NAME

    palm_outline: SkipValidation[Points] = PALM_OUTLINE
    back_outline: SkipValidation[Points] = BACK_OUTLINE
    gel_thickness: Positive = 3.5
    gel_width: Positive = 20.0
    m1_ends: SkipValidation[Points] = ((5.8, 13.3), (10.4, 88.2))
    m1_sagitta: Positive = 5.5
    m1_width: Positive = 22.0
    m1_grid: tuple[WholeNumber, WholeNumber] = (168, 45)
    mirror_thickness: Positive = 1.0
    wall_thickness: Positive = 1.0
    clearance: Positive = 0.5
    m2_bottom: tuple[Length, Length] = (16.7, -2.8)
    m2_tilt: Length = 22.4
    m2_length: Positive | None = None
    m2_width: Positive = 18.0
    view: str = "m2"
    fov: Positive | None = None
    resolution: tuple[WholeNumber, WholeNumber] = (320, 240)
    leds_per_side: WholeNumber = 8
    led_pitch: Positive = 8.0
    led_gap: Positive = 0.2
    led_flux: Length | None = None
    tip_leds: WholeNumber = 0
    coating: str = "diffuse-grey"
    tessellation: Positive = 0.5


@builds(GelSightSvelteDimensions)
def gelsight_svelte(size: GelSightSvelteDimensions) -> SensorDesign:
    """Build a GelSight Svelte.

    The mirror M1 is stored flat. Its cage of 27 points takes it from flat (`c_min`) to the largest
    curvature that keeps `clearance` from the skin (`c_max`, found from the shapes), with its middle
    at rest; `blend` is set so that it has the measured curvature, `m1_sagitta`.

    Args:
        size: the dimensions.

    Raises:
        DesignError: the dimensions contradict each other (a mirror through the skin, a gel thicker
            than the palm's bends, ...); the message says which one, and the remedy.
        LibraryError: there is no such coating.
    """
    led_flux = balanced_flux(LED) if size.led_flux is None else size.led_flux
    require(
        min(size.m1_grid) >= 2 and size.leds_per_side >= 1 and size.tip_leds >= 0,
        f"m1_grid {size.m1_grid}, leds_per_side {size.leds_per_side} or tip_leds {size.tip_leds} "
        "is too small",
        "M1 needs 2 x 2 vertices or more, each side one LED or more",
    )
    require(size.view in VIEWS, f"there is no view '{size.view}'", f"Give {' or '.join(VIEWS)}")
    palm = Palm.through(size.palm_outline, size.tessellation)
    inner = palm.offset(size.gel_thickness)
    gel_outline = np.concatenate([palm.points, inner[::-1]])
    m1 = CurvedMirror.from_arc(size.m1_ends[0], size.m1_ends[1], size.m1_sagitta)
    most = m1.largest_sagitta(gel_outline, size.clearance)
    if size.m1_sagitta > most:
        raise DesignError(
            f"mirror M1 bent by {size.m1_sagitta:g} mm comes nearer than "
            f"{size.clearance:g} mm to the skin",
            where="m1_sagitta",
            hint=f"With these ends it can be {most:.2f} mm at most; lower it, move m1_ends away "
            "from the palm, or make gel_thickness smaller",
        )
    m2 = FlatMirror.facing(size.m2_bottom, size.m2_tilt, size.m2_length, inner)
    check_mirrors(m1, size.m1_sagitta, m2, gel_outline)
    widths = (size.gel_width, max(size.m1_width, size.m2_width))
    walls = housing(
        palm, size.back_outline, m1, most, m2, widths, size.led_gap, size.wall_thickness
    )
    low, high = m2.seen_between()
    if size.view == "palm":
        low = m2.angle_of(m1.curve(size.m1_sagitta)[0])
    rows = max(1, round(size.gel_width / size.tessellation))

    design = SensorDesign(
        name=NAME,
        description="GelSight Svelte: a finger seen over a flat and a curved mirror",
        coating=library.coating(size.coating),
        materials={GEL: library.material(GEL), MIRROR: library.material(MIRROR)},
        parts={
            "skin": Part(role=Role.SENSING_SURFACE, mesh="meshes/skin.obj"),
            "gel": Part(role=Role.ELASTOMER, mesh="meshes/gel.obj", material=GEL, priority=1),
            **{
                name: Part(role=role, mesh=f"meshes/{name}.obj", material=material, thickness=thick)
                for role, material, thick, names in (
                    (Role.MIRROR, MIRROR, size.mirror_thickness, ("M1", "M2")),
                    (Role.BLOCKER, None, size.wall_thickness, ("body", "side-walls", "led-covers")),
                )
                for name in names
            },
        },
        lights=_lights(palm, size, led_flux),
        camera=Camera(
            model="pi-v1",
            fov=round(math.degrees(high - low), 3) if size.fov is None else size.fov,
            resolution=size.resolution,
            position=(0.0, 0.0, 0.0),
            direction=(math.cos(0.5 * (low + high)), 0.0, math.sin(0.5 * (low + high))),
            up=(0.0, 1.0, 0.0),
        ),
    )
    design.meshes.update(
        skin=ribbon(palm.points, 0.5 * size.gel_width, rows),
        gel=strip(palm.points, inner, 0.5 * size.gel_width, rows),
        M1=ribbon(
            m1.curve(0.0, size.m1_grid[0]), 0.5 * size.m1_width, size.m1_grid[1] - 1
        ).flipped(),
        M2=ribbon(m2.ends()[::-1], 0.5 * size.m2_width, 1).flipped(),
        **walls,
        **{"led-covers": led_covers(palm, inner, widths, size.led_gap)},
    )
    design.cages = {"M1": _mirror_cage(design.meshes["M1"], m1, most, size.m1_sagitta / most)}
    design.provenance = provenance(size.tip_leds > 0)
    size.describe(design)
    return design


def _mirror_cage(mesh: TriangleMesh, mirror: CurvedMirror, most: float, blend: float) -> Cage:
    """Return a cage of 27 points over the flat mirror, with a range up to a sagitta of `most` mm.

    Three points in a row give a parabola of degree 2 along z: with its ends `s` forward and its
    middle point `s` back, the middle of the mirror stays in place.
    """
    cage = Cage.around(["M1"], mesh.bounds)
    flat = cage_points(mesh.bounds, (3, 3, 3)).reshape(3, 3, 3, 3)
    bent = flat.copy()
    forward = most * np.array([mirror.forward[0], 0.0, mirror.forward[1]])
    bent[:, :, [0, 2]] += forward
    bent[:, :, 1] -= forward
    return Cage(
        parts=cage.parts,
        resolution=cage.resolution,
        box=cage.box,
        c_min=as_points(flat.reshape(-1, 3)),
        c_max=as_points(bent.reshape(-1, 3)),
        blend=[Share(x=blend, y=blend, z=blend)] * 27,
    )


def _lights(palm: Palm, size: GelSightSvelteDimensions, flux: float) -> dict[str, LightGroup]:
    """Return rows of lights along both sides of the gel, amid its thickness, that shine across."""
    count, pitch, gap = size.leds_per_side, size.led_pitch, size.led_gap
    shares = 0.5 + (np.arange(count) - 0.5 * (count - 1)) * pitch / palm.length
    if shares[0] < 0.0:
        raise DesignError(
            f"{count} LEDs {pitch:g} mm apart are longer than the palm, {palm.length:.1f} mm",
            where="leds_per_side, led_pitch",
            hint="Take fewer LEDs or a smaller pitch",
        )
    groups = {}
    for name, side in (("red", 1.0), ("green", -1.0)):
        lights = []
        for share in shares:
            point, along = palm.at(float(share), 0.5 * size.gel_thickness)
            place = (float(point[0]), side * (0.5 * size.gel_width + gap), float(point[1]))
            up = (float(along[0]), 0.0, float(along[1]))
            lights += row_of_lights(place, up, 1, pitch, (0.0, -side, 0.0))
        colour = NAMED_COLOURS[name]
        groups[name] = LightGroup(model=LED, colour=colour, flux=flux, lights=lights)
    if size.tip_leds:
        point, along = palm.at(1.0, 0.5 * size.gel_thickness)
        point = point + gap * along
        towards = (-float(along[0]), 0.0, -float(along[1]))
        row = row_of_lights(
            (float(point[0]), 0.0, float(point[1])),
            (0.0, 1.0, 0.0),
            size.tip_leds,
            min(4.0, size.gel_width / size.tip_leds),
            towards,
        )
        blue = NAMED_COLOURS["blue"]
        groups["blue"] = LightGroup(model=LED, colour=blue, flux=flux, lights=row)
    return groups
