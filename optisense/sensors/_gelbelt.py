"""GelBelt: a soft belt that runs over two wheels and slides across a fixed acrylic window.

The origin is the centre of the sensing surface, +z points out of the sensor, x along the belt's
motion, y along the wheels' axes. The layers from outside in are: coating, gel, clear tape, an air
gap, acrylic, air, camera. The camera is inside the loop of the belt. The green LEDs are at -x.

The belt is not cast onto the acrylic but slides on it. The air gap between them keeps light that
enters the side of the acrylic from entering the belt, by total reflection.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense import library
from optisense.design import Absorber, Dielectric, LightGroup, Part, Role, SensorDesign
from optisense.design.colour import NAMED_COLOURS
from optisense.geometry import TriangleMesh
from optisense.sensors._belt_path import (
    BeltHalf,
    Bend,
    Straight,
    mirrored_and_joined,
    trace,
    way_back,
)
from optisense.sensors._gelbelt_checks import (
    LED_LENGTH,
    check_camera,
    check_green,
    check_leds,
    check_numbers,
    check_wheels,
)
from optisense.sensors._gelbelt_sources import gelbelt_sources
from optisense.sensors._shapes import axial_camera, ribbon, rod, row_of_lights, strip
from optisense.sensors._sources import nominal_fluxes
from optisense.sensors.dimensions import (
    Dimensions,
    Length,
    Positive,
    PositiveCount,
    WholeNumber,
    builds,
)

SENSOR = "gelbelt"
GEL, TAPE, FILM, WINDOW, BLACK = (
    "silicone-xp565",
    "clear-tape",
    "air-film",
    "acrylic",
    "black-absorber",
)
LED = "smd-3528"

ALONG_X, ALONG_Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
"""Unit vectors of the axes along which rows of lights extend."""

TAPE_INDEX = 1.49
"""Refractive index of the clear tape; its provenance is in `_gelbelt_sources`."""

ROLLER_CLEARANCE = 1.0
"""Distance between the window and the small roller, mm; `_gelbelt_sources` has its provenance."""
WHEEL_GAP = 0.02
"""Smallest air gap between belt and wheels, mm, so that they are not in optical contact."""
BESIDE_WINDOW = 0.5
"""Distance from the edge of the window to the target of green light in light design 2, mm, an
assumption: the light is aimed just past the window."""
BEHIND_ROLLER = 2.0
"""Distance from the roller to the target of green light in light design 3, mm, an assumption: the
light is aimed just past the roller."""
GREEN_LEAD = 3.0
"""Ratio of green's power to that of red and blue, as it has a longer path from one end only."""
WRAP = 90.0
"""Angle by which the belt is turned at the end of the modelled part, degrees: light that gets past
a quarter turn does not come back (`_gelbelt_sources`)."""


class GelBeltDimensions(Dimensions):
    """Dimensions of a GelBelt.

    Attributes:
        light_design: arrangement of the LEDs, as in the OptiSense paper. 1: on the sides of the
            acrylic. 2: red and blue on the sides of the belt; green next to the acrylic, at an
            angle through the inner face of the belt. 3: as 2, but on the green LEDs' side of the
            acrylic a small roller turns the belt down, and green enters behind it.
        window_size: size of the acrylic along x and y, mm; the belt is as wide as it.
        window_thickness: thickness of the acrylic, mm.
        gel_thickness: thickness of the gel, mm.
        tape_thickness: thickness of the clear tape on the inner face of the belt, mm.
        film_thickness: air gap between tape and acrylic, and between tape and wheels, mm; with 0
            the tape is in optical contact with the acrylic.
        coat_thickness: thickness of the belt's black coat as made, mm; light meets its inner face.
        wheel_radius: radius of the wheels, mm.
        wheel_distance: distance between the wheels' axes in light designs 1 and 2, mm.
        roller_radius: radius of the small roller of light design 3, mm.
        deflection: angle by which that roller turns the belt, degrees.
        incline: length of the straight run of the belt from the roller to its wheel, mm.
        pupil_distance: distance from the sensing surface to the camera's entrance pupil, mm.
        fov: field of view across the image width, degrees.
        resolution: width and height of the picture, pixels.
        leds_per_group: number of LEDs in each of the three rows.
        led_pitch: distance between LEDs of a row, mm.
        led_gap: air gap between an LED's window and the face opposite, mm; above 0.
        led_flux: radiant flux of each red, green and blue LED, mW; None takes the library's flux
            for green and a third of it for red and blue.
        green_distance: distance from the green LEDs to the belt in light designs 2 and 3, mm.
        green_angle: angle between green light and the normal of the belt where it meets it, towards
            the window, degrees.
        reflectance: reflectance of the coating's diffuse part, 0 to 1.
        specularity: specularity of the coating, 0 to 1.
        tessellation: approximate edge length of the triangles, mm.
    """

    sensor: ClassVar[str] = SENSOR

    light_design: WholeNumber = 3
    window_size: tuple[Positive, Positive] = (50.0, 36.0)
    window_thickness: Positive = 6.0
    gel_thickness: Positive = 3.0
    tape_thickness: Positive = 0.05
    film_thickness: Length = 0.02
    coat_thickness: Positive = 0.1
    wheel_radius: Positive = 25.0
    wheel_distance: Positive = 90.0
    roller_radius: Positive = 1.0
    deflection: Length = 35.0
    incline: Positive = 25.0
    pupil_distance: Positive = 42.0
    fov: Length = 62.2
    resolution: tuple[WholeNumber, WholeNumber] = (320, 240)
    leds_per_group: PositiveCount = 8
    led_pitch: Positive = 4.0
    led_gap: Positive = 0.2
    led_flux: tuple[Length, Length, Length] | None = None
    green_distance: Positive = 2.5
    green_angle: Length = 45.0
    reflectance: Length = 0.7
    specularity: Length = 0.2
    tessellation: Positive = 2.0


@builds(GelBeltDimensions)
def gelbelt(size: GelBeltDimensions) -> SensorDesign:
    """Build a GelBelt.

    Args:
        size: the dimensions.

    Raises:
        DesignError: dimensions contradict one another; the message says which.
    """
    led_flux = size.led_flux
    if led_flux is None:
        most = nominal_fluxes(LED)["green"]
        led_flux = round(most / GREEN_LEAD, 3), most, round(most / GREEN_LEAD, 3)
    check_numbers(
        size.light_design,
        size.film_thickness,
        size.fov,
        size.deflection,
        size.green_angle,
        (size.reflectance, size.specularity),
        led_flux,
    )
    layers = size.tape_thickness, size.gel_thickness
    level = -size.gel_thickness - size.tape_thickness
    window_top = level - size.film_thickness
    window_bottom = window_top - size.window_thickness
    half = 0.5 * size.window_size[0], 0.5 * size.window_size[1]
    check_camera(size.pupil_distance, -window_bottom, 2.0 * size.wheel_radius - level)
    check_leds(
        (size.leds_per_group - 1) * size.led_pitch + LED_LENGTH,
        size.window_size,
        size.window_thickness if size.light_design == 1 else size.gel_thickness,
    )
    plain = trace(
        [Straight(0.5 * size.wheel_distance), Bend(size.wheel_radius, WRAP)],
        level,
        size.tessellation,
    )
    bent = trace(
        [
            Straight(half[0] + ROLLER_CLEARANCE + size.roller_radius),
            Bend(size.roller_radius, size.deflection),
            Straight(size.incline),
            Bend(size.wheel_radius, WRAP - size.deflection),
        ],
        level,
        size.tessellation,
    )
    left = bent if size.light_design == 3 else plain
    for half_belt in (left, plain):
        check_wheels(half_belt, (half[0], window_bottom), size.pupil_distance, size.fov)

    middle = (
        0.5 * (window_top + window_bottom) if size.light_design == 1 else -0.5 * size.gel_thickness
    )
    # Like the belt's halves, the green row is computed on the right and then mirrored.
    green, shine = np.array([half[0] + size.led_gap, middle]), np.array([-1.0, 0.0])
    if size.light_design == 2:
        target = np.array([half[0] + BESIDE_WINDOW, level])
        green, shine = _aimed(target, size.green_angle, size.green_distance)
    elif size.light_design == 3:
        start, end = bent.points[bent.starts[2]], bent.points[bent.starts[3]]
        target = start + BEHIND_ROLLER / size.incline * (end - start)
        green, shine = _aimed(target, size.green_angle - size.deflection, size.green_distance)
    (x, z), (dx, dz) = green.tolist(), shine.tolist()
    check_green(left, (x, z))
    row, side = (size.leds_per_group, size.led_pitch), half[1] + size.led_gap
    rows = {
        "red": row_of_lights((0.0, side, middle), ALONG_X, *row, (0.0, -1.0, 0.0)),
        "green": row_of_lights((-x, 0.0, z), ALONG_Y, *row, (-dx, 0.0, dz)),
        "blue": row_of_lights((0.0, -side, middle), ALONG_X, *row, (0.0, 1.0, 0.0)),
    }
    coating = library.coating("semi-specular").model_copy(
        update={"reflectance": (size.reflectance,) * 3, "specularity": size.specularity}
    )
    design = SensorDesign(
        name=SENSOR,
        description=f"GelBelt, light design {size.light_design}",
        coating=coating,
        materials={
            GEL: library.material(GEL),
            TAPE: Dielectric(ior=TAPE_INDEX),
            FILM: Dielectric(ior=1.0),
            WINDOW: library.material(WINDOW),
            BLACK: Absorber(),
        },
        parts={
            "skin": Part(role=Role.SENSING_SURFACE, mesh="meshes/skin.obj"),
            "gel": Part(role=Role.ELASTOMER, mesh="meshes/gel.obj", material=GEL),
            "tape": Part(role=Role.SUPPORT, mesh="meshes/tape.obj", material=TAPE),
            "film": Part(role=Role.SUPPORT, mesh="meshes/film.obj", material=FILM),
            "window": Part(role=Role.SUPPORT, mesh="meshes/window.obj", material=WINDOW),
            "wheels": Part(role=Role.BLOCKER, mesh="meshes/wheels.obj", material=BLACK),
            "far-coat": Part(
                role=Role.BLOCKER,
                mesh="meshes/far-coat.obj",
                material=BLACK,
                thickness=size.coat_thickness,
            ),
        },
        lights={
            name: LightGroup(model=LED, colour=NAMED_COLOURS[name], flux=flux, lights=lights)
            for (name, lights), flux in zip(rows.items(), led_flux, strict=True)
        },
        camera=axial_camera("pi-v2", size.fov, size.resolution, -size.pupil_distance),
        provenance=gelbelt_sources(
            size.light_design, *way_back(left, plain), size.wheel_radius, layers, 2.0 * half[1]
        ),
    )
    design.meshes.update(
        _belt(left, plain, layers, half[1], size.tessellation),
        window=TriangleMesh.box((-half[0], -half[1], window_bottom), (*half, window_top)),
        wheels=_wheels(
            left, plain, max(size.film_thickness, WHEEL_GAP), half[1], size.tessellation
        ),
    )
    if size.film_thickness > 0.0:
        design.meshes["film"] = TriangleMesh.box((-half[0], -half[1], window_top), (*half, level))
    else:
        del design.parts["film"], design.materials[FILM]
        del design.provenance["parts.film"], design.provenance[f"materials.{FILM}.ior"]
    size.describe(design, ("light_design",))
    return design


def _aimed(
    target: NDArray[np.float64], angle: float, distance: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return position and direction, (2,) in x and z, of a light that meets `target` at `angle`
    degrees from +z, coming from +x, at a distance of `distance` mm.
    """
    shine = np.array([-math.sin(math.radians(angle)), math.cos(math.radians(angle))])
    return target - distance * shine, shine


def _belt(
    left: BeltHalf,
    right: BeltHalf,
    layers: tuple[float, float],
    half_width: float,
    tessellation: float,
) -> dict[str, TriangleMesh]:
    """Return tape, gel and coating on common points, of layers with the thickness (mm) of tape and
    gel; the skin is the part of the coat that is on no wheel.
    """
    tape, gel = layers
    inner, middle, outer = (
        mirrored_and_joined(left.raised(height), right.raised(height))
        for height in (0.0, tape, tape + gel)
    )
    rows = math.ceil(2.0 * half_width / tessellation)
    first = len(left.points) - 1 - left.starts[-2]
    last = len(left.points) - 1 + right.starts[-2]
    far = [ribbon(outer[: first + 1], half_width, rows), ribbon(outer[last:], half_width, rows)]
    return {
        "skin": ribbon(outer[first : last + 1], half_width, rows).flipped(),
        "far-coat": TriangleMesh.joined(far).flipped(),
        "gel": strip(middle, outer, half_width, rows),
        "tape": strip(inner, middle, half_width, rows),
    }


def _wheels(
    left: BeltHalf, right: BeltHalf, gap: float, half_width: float, tessellation: float
) -> TriangleMesh:
    """Return both wheels, and the small roller if there is one."""
    rods = []
    for half, side in ((left, -1.0), (right, 1.0)):
        for number in half.bends:
            wheel = rod(half.wheel(number, gap, tessellation), half_width)
            rods.append(wheel.transformed(np.diag([side, 1.0, 1.0])))
    return TriangleMesh.joined(rods)
