"""GelSight Mini: a flat gel on a tray, a side-lit light guide below, a camera behind it.

Frame: origin at the centre of the sensing surface, +z out of the sensor, x along the long side.
Dimensions come from the maker's published CAD and FAQ where there are any. The maker publishes
neither the light guide, the LEDs nor the camera's place: these are marked as assumed.
"""

from __future__ import annotations

import math

import numpy as np

from optisense import library
from optisense.design import (
    Cage,
    Camera,
    Dielectric,
    Light,
    LightGroup,
    Material,
    Part,
    Point,
    Provenance,
    Role,
    SensorDesign,
    Status,
)
from optisense.geometry import TriangleMesh

GEL, GUIDE = "silicone-xp565", "acrylic"


def gelsight_mini(
    *,
    gel_size: tuple[float, float] = (25.25, 20.75),
    gel_thickness: float = 4.25,
    tray_size: tuple[float, float] = (28.23, 23.73),
    tray_thickness: float = 1.0,
    guide_thickness: float = 4.0,
    pupil_distance: float = 17.0,
    view_width: float = 18.6,
    fov: float | None = None,
    resolution: tuple[int, int] = (320, 240),
    leds_per_group: int = 5,
    led_pitch: float = 4.0,
    led_gap: float = 0.2,
    led_flux: float = 10.0,
    coating: str = "diffuse-grey",
    tessellation: float = 0.5,
) -> SensorDesign:
    """A GelSight Mini with a flat gel.

    Args:
        gel_size: mm, along x and y.
        gel_thickness: mm.
        tray_size: mm, along x and y, of the rigid plate the gel is cast on.
        tray_thickness: mm.
        guide_thickness: mm, of the side-lit acrylic block under the tray (as large as the gel).
        pupil_distance: mm, from the back of the tray to the camera's entrance pupil.
        view_width: mm, what the image width shows of the flat gel.
        fov: degrees, across the image width; None derives it from view_width.
        resolution: pixels, width and height.
        leds_per_group: LEDs in each of the three rows.
        led_pitch: mm, between LEDs of a row.
        led_gap: mm of air between an LED's window and the guide's edge; must be above 0.
        led_flux: mW, radiant, of each LED.
        coating: a coating of the library.
        tessellation: mm, edge length of the triangles on top of the gel.

    Raises:
        ValueError: a size, led_gap or tessellation is not above 0, or the pupil is in the guide.
        LibraryError: there is no such coating.
    """
    lengths = (*gel_size, gel_thickness, *tray_size, tray_thickness, guide_thickness)
    if min(*lengths, pupil_distance, led_gap, tessellation, view_width) <= 0.0:
        raise ValueError("all sizes, led_gap and tessellation must be above 0")
    tray_top = -gel_thickness
    guide_top = tray_top - tray_thickness
    guide_bottom = guide_top - guide_thickness
    if pupil_distance <= guide_thickness:
        raise ValueError("pupil_distance must be larger than guide_thickness")
    lamp_z = 0.5 * (guide_top + guide_bottom)
    half_x, half_y = 0.5 * gel_size[0], 0.5 * gel_size[1]

    support, gel_index = library.material(GUIDE), library.material(GEL)
    layers = [
        (pupil_distance - guide_thickness, 1.0),
        (guide_thickness + tray_thickness, _index(support)),
        (gel_thickness, _index(gel_index)),
    ]
    leds = (leds_per_group, led_pitch, led_flux)

    gel = _gel(gel_size, gel_thickness, tessellation)
    design = SensorDesign(
        name="gelsight-mini",
        description="GelSight Mini, flat gel",
        coating=library.coating(coating),
        materials={GEL: library.material(GEL), GUIDE: library.material(GUIDE)},
        parts={
            "skin": Part(role=Role.SENSING_SURFACE, mesh="meshes/skin.obj"),
            "gel": Part(role=Role.ELASTOMER, mesh="meshes/gel.obj", material=GEL, priority=1),
            "tray": Part(role=Role.SUPPORT, mesh="meshes/tray.obj", material=GUIDE),
            "guide": Part(role=Role.SUPPORT, mesh="meshes/guide.obj", material=GUIDE),
        },
        lights={
            # The camera looks along +z with +y up, so the picture's right is -x.
            "red": _row((1, 0, 0), (0, 1), half_y + led_gap, lamp_z, *leds),
            "green": _row((0, 1, 0), (-1, 0), half_x + led_gap, lamp_z, *leds),
            "blue": _row((0, 0, 1), (0, -1), half_y + led_gap, lamp_z, *leds),
        },
        camera=Camera(
            model="gelsight-mini",
            fov=_field_of_view(view_width, layers) if fov is None else fov,
            resolution=resolution,
            position=(0.0, 0.0, guide_top - pupil_distance),
            direction=(0.0, 0.0, 1.0),
            up=(0.0, 1.0, 0.0),
        ),
        provenance=_provenance(),
    )
    design.meshes.update(
        skin=_top(gel),
        gel=gel,
        tray=_plate(tray_size, guide_top, tray_top),
        guide=_plate(gel_size, guide_bottom, guide_top),
    )
    design.cages = {"skin": Cage.around(["skin", "gel"], gel.bounds)}
    return design


def gelsight_mini_cylindrical(rise: float = 6.0) -> SensorDesign:
    """A GelSight Mini whose gel is bent to a cylinder along the short side (y).

    Args:
        rise: mm, how far the three top control points at middle x are moved along +z (the
            OptiSense paper moves the middle row by 6 mm). The gel rises by half of it.
    """
    design = gelsight_mini()
    cage = design.cages["skin"]
    for j in range(3):
        _raise(cage, cage.index(1, j, 2), rise)
    design.name = "gelsight-mini-cylindrical"
    design.description = "GelSight Mini, gel bent to a cylinder"
    design.provenance["cages.skin.points"] = Provenance(
        status=Status.SOURCED, source="OptiSense paper: middle row of the cage +6 mm along z"
    )
    return design


def gelsight_mini_spherical(rise: float = 9.0) -> SensorDesign:
    """A GelSight Mini whose gel is bent to a dome.

    Args:
        rise: mm, how far the top centre control point is moved along +z (the OptiSense paper
            moves it by 9 mm). The gel rises by a quarter of it.
    """
    design = gelsight_mini()
    cage = design.cages["skin"]
    _raise(cage, cage.index(1, 1, 2), rise)
    design.name = "gelsight-mini-spherical"
    design.description = "GelSight Mini, gel bent to a dome"
    design.provenance["cages.skin.points"] = Provenance(
        status=Status.SOURCED, source="OptiSense paper: centre point of the cage +9 mm along z"
    )
    return design


def _index(material: Material) -> float:
    assert isinstance(material, Dielectric)  # of the two named above
    return material.ior


def _field_of_view(view_width: float, layers: list[tuple[float, float]]) -> float:
    """Degrees a pinhole needs to see `view_width` (mm) behind flat layers.

    Args:
        layers: thickness (mm) and refractive index of each, from the pinhole on.
    """

    def too_wide(sine: float) -> bool:  # Snell: the index times the sine is the same throughout
        offsets = (t * sine / math.sqrt(n * n - sine * sine) for t, n in layers)
        return 2.0 * sum(offsets) > view_width

    low, high = 0.0, 1.0 - 1e-12
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if too_wide(middle) else (middle, high)
    return round(2.0 * math.degrees(math.asin(low)), 3)


def _gel(size: tuple[float, float], thickness: float, tessellation: float) -> TriangleMesh:
    """A closed box with its top at z = 0, cut finely so that the cage bends it smoothly."""
    divisions = (
        max(1, round(size[0] / tessellation)),
        max(1, round(size[1] / tessellation)),
        max(1, round(thickness / (2.0 * tessellation))),
    )
    upper = (0.5 * size[0], 0.5 * size[1], 0.0)
    return TriangleMesh.box((-upper[0], -upper[1], -thickness), upper, divisions)


def _top(gel: TriangleMesh) -> TriangleMesh:
    """The top faces of the gel, on the very same vertices, looking into the gel."""
    on_top = (gel.triangles[:, :, 2] == 0.0).all(axis=1)
    used, faces = np.unique(gel.faces[on_top], return_inverse=True)
    inward = faces.astype(np.int32).reshape(-1, 3)[:, ::-1]
    return TriangleMesh(gel.vertices[used], inward)


def _plate(size: tuple[float, float], bottom: float, top: float) -> TriangleMesh:
    half_x, half_y = 0.5 * size[0], 0.5 * size[1]
    return TriangleMesh.box((-half_x, -half_y, bottom), (half_x, half_y, top))


def _row(
    colour: tuple[float, float, float],
    side: tuple[int, int],
    distance: float,
    z: float,
    count: int,
    pitch: float,
    flux: float,
) -> LightGroup:
    """LEDs in a row on one side of the guide, facing it."""
    x, y = side
    offsets = [(index - 0.5 * (count - 1)) * pitch for index in range(count)]
    lights = [
        Light(
            position=(x * distance + abs(y) * offset, y * distance + abs(x) * offset, z),
            direction=(float(-x), float(-y), 0.0),
        )
        for offset in offsets
    ]
    return LightGroup(model="smd-3528", colour=colour, flux=flux, lights=lights)


def _raise(cage: Cage, index: int, rise: float) -> None:
    point = cage.points[index]
    cage.points[index] = Point(x=point.x, y=point.y, z=point.z + rise)


def _provenance() -> dict[str, Provenance]:
    cad = "published CAD (gsmini_shell, 2022-10-24)"
    order = (
        "rows of 5 at 4 mm pitch on the guide's edges: count, pitch and place are not published; "
        "which side has which colour agrees with the shading of published ball presses"
    )
    assumed, sourced = Status.ASSUMED, Status.SOURCED
    table: dict[str, tuple[Status, str]] = {
        "coating": (sourced, "opaque grey without metal flakes, Lambertian (gsrobotics FAQ)"),
        "coating.reflectance": (assumed, "near the calibrated albedo of a flat gel, about 0.45"),
        "materials.silicone-xp565.ior": (assumed, "the gel's silicone is not published"),
        "materials.acrylic.ior": (sourced, "PMMA, Sultanova 2009 at 589 nm"),
        "parts.gel": (
            sourced,
            f"footprint 25.25 x 20.75 mm from the {cad}, thickness 4.25 mm from the datasheet "
            "(second hand); drawn flat and without its 1.5 mm corner radius: its sag is 0.23 mm "
            "over the field of view",
        ),
        "parts.skin": (sourced, "top face of the gel"),
        "parts.tray": (sourced, f"28.23 x 23.73 x 1 mm from the {cad}; its material is assumed"),
        "parts.guide": (assumed, "25.25 x 20.75 x 4 mm acrylic, in optical contact with the tray"),
        "lights.red": (assumed, order),
        "lights.green": (assumed, order),
        "lights.blue": (assumed, order),
        "lights.red.flux": (assumed, "10 mW each; only ratios matter to an auto-exposed picture"),
        "lights.green.flux": (assumed, "as red"),
        "lights.blue.flux": (assumed, "as red"),
        "camera.position": (assumed, "pupil 17 mm behind the back of the tray"),
        "camera.fov": (
            Status.DERIVED,
            "the width that shows 18.6 mm of the flat gel (datasheet, second hand), refracted "
            "through 13 mm air, 5 mm acrylic and 4.25 mm gel; from the assumed pupil",
        ),
        "camera.resolution": (sourced, "320 x 240 is the default of gsrobotics"),
    }
    return {path: Provenance(status=s, source=text) for path, (s, text) in table.items()}
