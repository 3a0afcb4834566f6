"""GelSight360: a round fingertip that senses on all sides, lit from inside its own wall.

Frame: the camera's pupil is the origin, +z points along the axis to the tip, +x through the first
LED board. The layers from the camera out are: air, a rigid shell of clear epoxy, a soft gel, the
coating. Four LED boards stand upright in the wall of the shell; each has LEDs on both faces, which
makes eight light groups. A ring of LEDs lights the wall from below.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from optisense import library
from optisense.design import Absorber, Dielectric, Part, Provenance, Role, SensorDesign, Status
from optisense.geometry import TriangleMesh
from optisense.sensors._led_boards import (
    BOARDS,
    COLOURS,
    LED,
    LED_MODEL,
    WALL_MARGIN,
    LedBoards,
    ring,
)
from optisense.sensors._shapes import axial_camera, revolve
from optisense.sensors._sources import BALANCED, XP565, balanced_flux, provenance_of
from optisense.sensors._tip_shape import TipShape
from optisense.sensors.dimensions import (
    Dimensions,
    Length,
    Positive,
    PositiveCount,
    WholeNumber,
    builds,
    require,
)

SENSOR = "gelsight360"
GEL, EPOXY, BLACK = "silicone-xp565", "epoxy", "black-absorber"
GROUPS = 2 * BOARDS
"""Number of light groups: one on each of the two faces of every board."""
DESIGNS = 10.0
"""Last number of both shape families; the first is 0."""

BOARD_CLEARANCE = 0.05
"""Distance between boards and the gel, and between the ring's LEDs and the boards, mm."""


class GelSight360Dimensions(Dimensions):
    """Dimensions of a GelSight360.

    Attributes:
        light_colours: colours (R, G, B) of the eight light groups, anticlockwise as seen when
            looking at the tip. Group 1 is on the first board (on +x) and shines anticlockwise,
            group 2 faces it from the second board (on +y), group 3 is on that board's other face,
            and so on; group 8 is on the first board again.
        base_ring: colour of the ring of LEDs at the foot of the shell; "" for no ring.
        tip_design: shape of the tip: 0 (flat with a rounded edge) over 5 (hemisphere) to 10 (cone
            with a rounded nose).
        resin_design: shape of the shell: 0 (uniform thickness) to 10 (innermost surface almost
            flat): the innermost dome gets lower, from its full height to `flattest` of it.
        radius: radius of the coated outside, mm.
        height: height of the coated outside from the camera's pupil to the tip, mm; the straight
            wall takes what the tip leaves of it.
        gel_thickness: thickness of the gel, mm.
        shell_thickness: thickness of the shell's wall (and of the tip, in resin design 0), mm.
        edge_radius: outer radius of the rounded edge in tip designs 0 and 10 and of the nose in 10,
            mm; in between the radius is larger, up to `radius`.
        cone_height: height of the cone of tip design 10 between its rounded edge and its nose, mm.
        flattest: share of the height of the innermost dome that is left in resin design 10.
        board_bottom: z of the boards' lower edge, mm.
        board_height: height of the boards, mm.
        board_thickness: thickness of a board without LEDs, mm.
        base_thickness: thickness of the black bottom for manufacturing, below its face, mm; light
            meets the face.
        leds_per_group: number of LEDs on each face of a board.
        base_leds: number of LEDs of the ring; a multiple of 4.
        led_flux: radiant flux of each LED, mW; None takes that of its weakest colour (library).
        fov: field of view across the image width, degrees (equidistant fisheye).
        resolution: width and height of the picture, pixels.
        coating: name of a coating of the library.
        tessellation: approximate edge length of the largest triangles, mm.
    """

    sensor: ClassVar[str] = SENSOR

    light_colours: str = "GRRGGRRG"
    base_ring: str = "B"
    tip_design: Length = 5.0
    resin_design: Length = 0.0
    radius: Positive = 14.0
    height: Positive = 34.0
    gel_thickness: Positive = 3.0
    shell_thickness: Positive = 2.5
    edge_radius: Positive = 7.0
    cone_height: Positive = 12.0
    flattest: Positive = 0.1
    board_bottom: Length = 2.0
    board_height: Positive = 12.0
    board_thickness: Positive = 1.0
    base_thickness: Positive = 2.0
    leds_per_group: PositiveCount = 4
    base_leds: PositiveCount = 12
    led_flux: Length | None = None
    fov: Length = 128.0
    resolution: tuple[WholeNumber, WholeNumber] = (320, 240)
    coating: str = "semi-specular"
    tessellation: Positive = 1.0


@builds(GelSight360Dimensions)
def gelsight360(size: GelSight360Dimensions) -> SensorDesign:
    """Build a GelSight360.

    Args:
        size: the dimensions.

    Raises:
        DesignError: dimensions contradict one another, or the colours are not eight letters R, G,
            B; the message says which.
        LibraryError: there is no such coating.
    """
    _check_colours(size.light_colours, size.base_ring)
    for name, number in (("tip_design", size.tip_design), ("resin_design", size.resin_design)):
        require(0.0 <= number <= DESIGNS, f"{name} is {number:g}", "Give a number from 0 to 10")
    _check_layers(size.radius, size.edge_radius, size.gel_thickness, size.shell_thickness)
    shape = TipShape.of_family(
        size.tip_design / DESIGNS, size.radius, size.height, size.edge_radius, size.cone_height
    )
    require(
        shape.shoulder > 0.0,
        f"the tip is {size.height - shape.shoulder:g} mm high, the whole sensor only "
        f"{size.height:g} mm",
        "Make height larger, or cone_height or tip_design smaller",
    )
    boards = LedBoards(
        radius=size.radius - size.gel_thickness - 0.5 * size.shell_thickness,
        depth=size.shell_thickness,
        bottom=size.board_bottom,
        height=size.board_height,
        thickness=size.board_thickness,
        leds=size.leds_per_group,
    )
    _check_boards(boards, shape, size.radius - size.gel_thickness, size.base_leds)

    flux = balanced_flux(LED_MODEL) if size.led_flux is None else size.led_flux
    lights = boards.light_groups(size.light_colours, flux)
    if size.base_ring:
        lights["base"] = ring(size.base_ring, boards.radius, size.base_leds, flux)
    epoxy = library.material("epoxy-rough")
    assert isinstance(epoxy, Dielectric)
    design = SensorDesign(
        name=SENSOR,
        description=f"GelSight360, lights {size.light_colours}, tip design {size.tip_design:g}, "
        f"resin design {size.resin_design:g}",
        coating=library.coating(size.coating),
        materials={
            GEL: library.material(GEL),
            EPOXY: epoxy.model_copy(update={"roughness": 0.0}),
            BLACK: Absorber(),
        },
        parts={
            "skin": Part(role=Role.SENSING_SURFACE, mesh="meshes/skin.obj"),
            "gel": Part(role=Role.ELASTOMER, mesh="meshes/gel.obj", material=GEL),
            "shell": Part(role=Role.SUPPORT, mesh="meshes/shell.obj", material=EPOXY),
            "boards": Part(role=Role.BLOCKER, mesh="meshes/boards.obj", material=BLACK),
            "base": Part(
                role=Role.BLOCKER,
                mesh="meshes/base.obj",
                material=BLACK,
                thickness=size.base_thickness,
            ),
        },
        lights=lights,
        camera=axial_camera("ov5647-fisheye-160", size.fov, size.resolution, 0.0, "equidistant"),
        provenance=_provenance(size.base_ring),
    )
    dome = 1.0 - (1.0 - size.flattest) * size.resin_design / DESIGNS
    design.meshes.update(
        _solids(shape, (size.gel_thickness, size.shell_thickness), dome, size.tessellation),
        boards=boards.mesh(),
    )
    mentioned = ("light_colours", "tip_design", "resin_design")
    size.describe(design, mentioned)
    return design


def _solids(
    shape: TipShape, layers: tuple[float, float], dome: float, tessellation: float
) -> dict[str, TriangleMesh]:
    """Return coating, gel, shell and the black bottom, on common points, with the thickness (mm) of
    gel and shell, and the share of the innermost dome's height that is left.
    """
    gel, shell = layers
    outer = shape.profile(shape.edge, tessellation)
    middle = shape.profile(shape.edge - gel, tessellation)
    inner = shape.profile(shape.edge - gel - shell, tessellation)
    raised = np.maximum(inner[:, 1] - shape.shoulder, 0.0)
    inner[:, 1] -= (1.0 - dome) * raised
    quarter = max(8, math.ceil(0.5 * math.pi * outer[0, 0] / tessellation))
    return {
        "skin": revolve(outer[::-1], 4 * quarter),
        "gel": revolve(np.concatenate([outer, middle[::-1], outer[:1]]), 4 * quarter),
        "shell": revolve(np.concatenate([middle, inner[::-1], middle[:1]]), 4 * quarter),
        "base": revolve([outer[0], middle[0], inner[0]], 4 * quarter),
    }


def _check_colours(light_colours: str, base_ring: str) -> None:
    hint = f"Give {GROUPS} letters out of R, G and B, such as GRRGGRRG"
    require(
        len(light_colours) == GROUPS,
        f"light_colours '{light_colours}' has {len(light_colours)} letters, {GROUPS} are needed",
        hint,
    )
    for place, letter in enumerate(light_colours, start=1):
        require(
            letter in COLOURS,
            f"light_colours '{light_colours}' has an unknown colour '{letter}' at place {place}",
            hint,
        )
    require(
        base_ring in ("", *COLOURS),
        f"base_ring '{base_ring}' is no colour",
        "Give R, G or B, or an empty text for no ring",
    )


def _check_layers(radius: float, edge_radius: float, gel: float, shell: float) -> None:
    """Check that gel and shell are thinner than the rounded edge, or its inner side folds."""
    layers = f"gel_thickness {gel:g} mm and shell_thickness {shell:g} mm"
    require(
        gel + shell < radius,
        f"{layers} are together not thinner than the body, whose radius is {radius:g} mm",
        "Make the shell or the gel thinner, or the radius larger",
    )
    require(
        edge_radius < radius,
        f"edge_radius {edge_radius:g} mm is not smaller than the radius {radius:g} mm",
        "Make edge_radius smaller or the radius larger",
    )
    require(
        gel + shell < edge_radius,
        f"{layers} are together not thinner than edge_radius {edge_radius:g} mm, so that the "
        "innermost surface can't follow the rounded edge",
        "Make the shell or the gel thinner, or edge_radius larger",
    )


def _check_boards(boards: LedBoards, shape: TipShape, wall: float, base_leds: int) -> None:
    """Check that the boards fit into the straight wall, whose outer radius is `wall` mm."""
    narrowest = LED[0] + 2.0 * WALL_MARGIN
    require(
        boards.depth >= narrowest,
        f"the LED boards don't fit into a shell of {boards.depth:g} mm",
        f"Make shell_thickness at least {narrowest:g} mm",
    )
    require(
        boards.outermost <= wall - BOARD_CLEARANCE,
        f"the corners of the LED boards are {boards.outermost:.3g} mm off the axis, the shell "
        f"ends at {wall:.3g} mm",
        "Make board_thickness smaller or the radius larger",
    )
    top = boards.bottom + boards.height
    require(
        boards.bottom >= 0.5 and top <= shape.shoulder,
        f"the LED boards reach from z = {boards.bottom:g} to {top:g} mm, the straight wall from "
        f"0 to {shape.shoulder:g} mm",
        "Keep them 0.5 mm above its foot and below its end with board_bottom and board_height",
    )
    require(
        boards.leds * LED[1] <= boards.height,
        f"{boards.leds} LEDs of {LED[1]:g} mm don't fit on a board of {boards.height:g} mm",
        "Use fewer leds_per_group or a larger board_height",
    )
    pitch = 2.0 * math.pi * boards.radius / base_leds
    require(
        base_leds % BOARDS == 0 and pitch >= LED[1] + BOARD_CLEARANCE,
        f"a ring of {base_leds} LEDs is not possible",
        "Give a multiple of 4 (so that none is below a board) and at most "
        f"{int(2.0 * math.pi * boards.radius / (LED[1] + BOARD_CLEARANCE)) // 4 * 4}",
    )


def _provenance(base_ring: str) -> dict[str, Provenance]:
    assumed, sourced, derived = Status.ASSUMED, Status.SOURCED, Status.DERIVED
    size = (
        "28 mm wide and 34 mm high; its own size is not published, sister sensors are 20 to 28 mm"
    )
    table: dict[str, tuple[Status, str]] = {
        "coating": (
            assumed,
            "semi-specular with aluminium flake, as on the sister sensor RainbowSight (Tippur and "
            "Adelson 2024); not stated for GelSight360",
        ),
        **XP565,
        "materials.epoxy.ior": (
            sourced,
            "calibrated epoxy core of a round sensor (published code of arXiv 2012.13184)",
        ),
        "materials.epoxy.roughness": (assumed, "polished or clear-coated: smooth"),
        "parts.skin": (assumed, size),
        "parts.gel": (assumed, "3 mm; round sister sensors have 1 to 3 mm"),
        "parts.shell": (
            assumed,
            "2.5 mm, room for LED boards; round sister sensors have 1 to 3 mm",
        ),
        "parts.boards": (
            derived,
            "four boards with LEDs on both faces, from eight groups whose original colours come in "
            "equal pairs (GRRGGRRG); 12 x 1 mm and their place in the wall are assumed",
        ),
        "parts.base": (assumed, "black where shell and gel end"),
        "parts.base.thickness": (assumed, "2 mm, usual for printed rings of this size"),
        "camera.position": (assumed, "pupil in the plane where shell and gel end"),
        "camera.projection": (assumed, "equidistant, usual for fisheye lenses"),
        "camera.fov": (
            derived,
            "4/5 of the 160 degree diagonal of the camera of a sister sensor (RainbowSight)",
        ),
        "camera.resolution": (assumed, "half of 640 x 480, as sister sensors use"),
    }
    for number in range(1, GROUPS + 1):
        table[f"lights.lg{number}"] = (
            assumed,
            "4 LEDs of 2 x 1.25 mm; number and order of the groups are from the OptiSense paper",
        )
        table[f"lights.lg{number}.flux"] = derived, BALANCED
    if base_ring:
        table["lights.base.flux"] = derived, BALANCED
        table["lights.base"] = (
            assumed,
            "12 LEDs that shine into the shell; that there is such a ring, coupled to the shell, "
            "is from the RainbowSight paper. Blue, because the eight groups hold red and green",
        )
    return provenance_of(table)
