"""GelSight Mini with an ideal camera: a flat gel on a tray, with a side-lit light guide below and a
camera behind it.

Frame: the origin is the centre of the sensing surface, +z points out of the sensor, x along the
long side. Dimensions come from the maker's published CAD and FAQ where there are any. The maker
publishes neither the light guide, the LEDs nor the camera's position: these are marked as assumed.
"""

from __future__ import annotations

import math
from typing import ClassVar

from optisense import library
from optisense.design import (
    Cage,
    Dielectric,
    LightGroup,
    Material,
    Part,
    Point,
    Provenance,
    Role,
    SensorDesign,
    Status,
)
from optisense.design.colour import NAMED_COLOURS
from optisense.geometry import TriangleMesh
from optisense.sensors._gelsight_mini_sources import provenance
from optisense.sensors._shapes import axial_camera, row_of_lights
from optisense.sensors._sources import balanced_flux
from optisense.sensors.dimensions import (
    Dimensions,
    Length,
    Positive,
    PositiveCount,
    WholeNumber,
    builds,
    require,
)

NAME = "gelsight-mini-ideal"
GEL, GUIDE = "silicone-xp565", "acrylic"
LED = "smd-3528"

PAPERS_RISE = {"cylindrical": 6.0, "spherical": 9.0}
"""Distance by which the OptiSense paper moves the control points of each variant along z, mm."""

WIDEST_FIELD = 150.0
"""Largest field of view that may follow from `view_width`, degrees; a larger one is an error."""


class GelSightMiniDimensions(Dimensions):
    """Dimensions of a GelSight Mini with a flat gel, an ideal camera and lights of equal power.

    Attributes:
        gel_size: size of the gel along x and y, mm.
        gel_thickness: thickness of the gel, mm.
        tray_size: size of the rigid plate on which the gel is cast, along x and y, mm.
        tray_thickness: thickness of this plate, mm.
        guide_thickness: thickness of the side-lit acrylic block under the tray, mm.
        guide_size: size of this block along x and y, mm; as large as the gel if None.
        pupil_distance: distance from the back of the tray to the camera's entrance pupil, mm.
        view_width: width of the flat gel that the image width shows, mm.
        fov: field of view across the image width, degrees; None derives it from view_width.
        resolution: width and height of the picture, pixels.
        leds_per_group: number of LEDs in each of the three rows.
        led_pitch: distance between LEDs of a row, mm.
        led_gap: air gap between an LED's window and the guide's edge, mm; above 0.
        led_flux: radiant flux of each LED, mW; None takes that of its weakest colour (library).
        coating: name of a coating of the library.
        tessellation: edge length of the triangles on top of the gel, mm.
    """

    sensor: ClassVar[str] = NAME

    gel_size: tuple[Positive, Positive] = (25.25, 20.75)
    gel_thickness: Positive = 4.25
    tray_size: tuple[Positive, Positive] = (28.23, 23.73)
    tray_thickness: Positive = 1.0
    guide_thickness: Positive = 4.0
    guide_size: tuple[Positive, Positive] | None = None
    pupil_distance: Positive = 17.0
    view_width: Length = 18.6
    fov: Length | None = None
    resolution: tuple[WholeNumber, WholeNumber] = (320, 240)
    leds_per_group: PositiveCount = 5
    led_pitch: Positive = 4.0
    led_gap: Positive = 0.2
    led_flux: Length | None = None
    coating: str = "diffuse-grey"
    tessellation: Positive = 0.5


@builds(GelSightMiniDimensions)
def gelsight_mini_ideal(size: GelSightMiniDimensions) -> SensorDesign:
    """Build a GelSight Mini with a flat gel, an ideal camera and lights of equal power.

    Args:
        size: the dimensions.

    Raises:
        DesignError: dimensions contradict one another; the message says which.
        LibraryError: there is no such coating.
    """
    return _flat(size)


def _flat(size: GelSightMiniDimensions) -> SensorDesign:
    """Return the sensor with a flat gel."""
    _check(size)
    tray_top = -size.gel_thickness
    guide_top = tray_top - size.tray_thickness
    guide_bottom = guide_top - size.guide_thickness
    lamp_z = 0.5 * (guide_top + guide_bottom)
    guide = size.gel_size if size.guide_size is None else size.guide_size
    half_x, half_y = 0.5 * guide[0], 0.5 * guide[1]

    support, gel_index = library.material(GUIDE), library.material(GEL)
    layers = [
        (size.pupil_distance - size.guide_thickness, 1.0),
        (size.guide_thickness + size.tray_thickness, _index(support)),
        (size.gel_thickness, _index(gel_index)),
    ]
    flux = balanced_flux(LED) if size.led_flux is None else size.led_flux
    leds = (size.leds_per_group, size.led_pitch, flux)

    gel = _gel(size.gel_size, size.gel_thickness, size.tessellation)
    design = SensorDesign(
        name=NAME,
        description="GelSight Mini, flat gel, ideal camera",
        coating=library.coating(size.coating),
        materials={GEL: library.material(GEL), GUIDE: library.material(GUIDE)},
        parts={
            "skin": Part(role=Role.SENSING_SURFACE, mesh="meshes/skin.obj"),
            "gel": Part(role=Role.ELASTOMER, mesh="meshes/gel.obj", material=GEL, priority=1),
            "tray": Part(role=Role.SUPPORT, mesh="meshes/tray.obj", material=GUIDE),
            "guide": Part(role=Role.SUPPORT, mesh="meshes/guide.obj", material=GUIDE),
        },
        lights={
            "red": _row("red", (0, 1), half_y + size.led_gap, lamp_z, *leds),
            "green": _row("green", (-1, 0), half_x + size.led_gap, lamp_z, *leds),
            "blue": _row("blue", (0, -1), half_y + size.led_gap, lamp_z, *leds),
        },
        camera=axial_camera(
            "gelsight-mini",
            _field_of_view(size.view_width, layers) if size.fov is None else size.fov,
            size.resolution,
            guide_top - size.pupil_distance,
        ),
        provenance=provenance(),
    )
    design.meshes.update(
        skin=_top(gel),
        gel=gel,
        tray=_plate(size.tray_size, guide_top, tray_top),
        guide=_plate(guide, guide_bottom, guide_top),
    )
    design.cages = {"skin": Cage.around(["skin", "gel"], gel.bounds)}
    size.describe(design, ("rise",))
    return design


class CylindricalDimensions(GelSightMiniDimensions):
    """Dimensions of a GelSight Mini with a cylindrical gel.

    Attributes:
        rise: distance by which the three top control points at middle x are moved along +z, mm (the
            OptiSense paper moves the middle row by 6 mm). The gel rises by half of it.
    """

    rise: Length = 6.0


class SphericalDimensions(GelSightMiniDimensions):
    """Dimensions of a GelSight Mini with a domed gel.

    Attributes:
        rise: distance by which the top centre control point is moved along +z, mm (the OptiSense
            paper moves it by 9 mm). The gel rises by a quarter of it.
    """

    rise: Length = 9.0


@builds(CylindricalDimensions)
def gelsight_mini_ideal_cylindrical(size: CylindricalDimensions) -> SensorDesign:
    """Build an ideal GelSight Mini whose gel is bent to a cylinder along the short side (y).

    Args:
        size: the dimensions.

    Raises:
        DesignError: see `gelsight_mini_ideal`; or the rise presses the gel through its tray.
    """
    return _bent(size, "cylindrical", "cylinder", [(1, j, 2) for j in range(3)], (size.rise, 0.5))


@builds(SphericalDimensions)
def gelsight_mini_ideal_spherical(size: SphericalDimensions) -> SensorDesign:
    """Build an ideal GelSight Mini whose gel is bent to a dome.

    Args:
        size: the dimensions.

    Raises:
        DesignError: see `gelsight_mini_ideal`; or the rise presses the gel through its tray.
    """
    return _bent(size, "spherical", "dome", [(1, 1, 2)], (size.rise, 0.25))


def _bent(
    size: GelSightMiniDimensions,
    variant: str,
    shape: str,
    moved: list[tuple[int, int, int]],
    rise: tuple[float, float],
) -> SensorDesign:
    """Return a flat sensor with some control points raised, by a height (mm) of which the gel rises
    by a share in the middle.
    """
    design = _flat(size)
    height, share = rise
    cage = design.cages["skin"]
    thickness = float(-design.meshes["gel"].bounds[0, 2])
    require(
        math.isfinite(height) and share * height > -thickness,
        f"a rise of {height:g} mm presses the gel, {thickness:g} mm thick, through its tray",
        f"Give more than {-thickness / share:g} mm",
    )
    for place in moved:
        index = cage.index(*place)
        point = cage.points[index]
        cage.points[index] = Point(x=point.x, y=point.y, z=point.z + height)
    design.name = f"{NAME}-{variant}"
    design.description = design.description.replace("flat gel", f"gel bent to a {shape}")
    status, source = Status.ASSUMED, f"{height:g} mm along z"
    if height == PAPERS_RISE[variant]:
        status, source = Status.SOURCED, f"OptiSense paper: {height:+g} mm along z"
    design.provenance["cages.skin.points"] = Provenance(status=status, source=source)
    return design


def _check(size: GelSightMiniDimensions) -> None:
    """Refuse dimensions that contradict one another."""
    require(
        size.gel_size[0] <= size.tray_size[0] and size.gel_size[1] <= size.tray_size[1],
        f"the gel, {size.gel_size[0]:g} x {size.gel_size[1]:g} mm, is larger than its tray, "
        f"{size.tray_size[0]:g} x {size.tray_size[1]:g} mm",
        "Make gel_size smaller or tray_size larger",
    )
    require(
        size.pupil_distance > size.guide_thickness,
        f"the camera's pupil, {size.pupil_distance:g} mm behind the tray, is inside the light "
        f"guide, {size.guide_thickness:g} mm thick",
        "Make pupil_distance larger than guide_thickness",
    )
    count, pitch = size.leds_per_group, size.led_pitch
    require(
        (count - 1) * pitch <= min(size.gel_size),
        f"a row of {count} LEDs {pitch:g} mm apart is longer than the guide's shorter side, "
        f"{min(size.gel_size):g} mm",
        "Use fewer leds_per_group or a smaller led_pitch",
    )


def _index(material: Material) -> float:
    assert isinstance(material, Dielectric)  # of the two named above
    return material.ior


def _field_of_view(view_width: float, layers: list[tuple[float, float]]) -> float:
    """Return the field of view, degrees, with which a pinhole sees `view_width` (mm) behind flat
    layers, each with its thickness (mm) and refractive index.
    """

    def too_wide(sine: float) -> bool:  # Snell: the index times the sine is the same throughout
        offsets = (t * sine / math.sqrt(n * n - sine * sine) for t, n in layers)
        return 2.0 * sum(offsets) > view_width

    require(
        math.isfinite(view_width)
        and view_width > 0.0
        and too_wide(math.sin(math.radians(0.5 * WIDEST_FIELD))),
        f"no camera at this pupil_distance shows view_width {view_width:g} mm",
        "Give a view_width above 0, smaller, or a larger pupil_distance",
    )
    low, high = 0.0, 1.0 - 1e-12
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if too_wide(middle) else (middle, high)
    return round(2.0 * math.degrees(math.asin(low)), 3)


def _gel(size: tuple[float, float], thickness: float, tessellation: float) -> TriangleMesh:
    """Return a closed box with top at z = 0, divided finely so that the cage bends it smoothly."""
    divisions = (
        max(1, round(size[0] / tessellation)),
        max(1, round(size[1] / tessellation)),
        max(1, round(thickness / (2.0 * tessellation))),
    )
    upper = (0.5 * size[0], 0.5 * size[1], 0.0)
    return TriangleMesh.box((-upper[0], -upper[1], -thickness), upper, divisions)


def _top(gel: TriangleMesh) -> TriangleMesh:
    """Return the top faces of the gel, on the same vertices, turned into the gel."""
    on_top = (gel.triangles[:, :, 2] == 0.0).all(axis=1)
    return gel.with_faces(gel.faces[on_top]).compacted().flipped()


def _plate(size: tuple[float, float], bottom: float, top: float) -> TriangleMesh:
    half_x, half_y = 0.5 * size[0], 0.5 * size[1]
    return TriangleMesh.box((-half_x, -half_y, bottom), (half_x, half_y, top))


def _row(
    name: str,
    side: tuple[int, int],
    distance: float,
    z: float,
    count: int,
    pitch: float,
    flux: float,
) -> LightGroup:
    """Return LEDs in a row on one side of the guide, facing it."""
    x, y = side
    centre, along = (x * distance, y * distance, z), (abs(y), abs(x), 0.0)
    lights = row_of_lights(centre, along, count, pitch, (float(-x), float(-y), 0.0), upright=False)
    return LightGroup(model=LED, colour=NAMED_COLOURS[name], flux=flux, lights=lights)
