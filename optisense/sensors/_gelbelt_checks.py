"""Checks of GelBelts: parts must not overlap one another, nor the camera's view."""

from __future__ import annotations

import math

import numpy as np

from optisense.sensors._belt_path import BeltHalf
from optisense.sensors.dimensions import require

LED_WINDOW = 2.4
"""Diameter of the emitting window of an SMD 3528 LED, as in the library, mm."""
LED_LENGTH = 3.5
"""Length of the body of an SMD 3528 LED along its row, as in the library, mm."""
CAMERA_DEPTH = 9.0
"""Length of the camera module behind its pupil, which must not reach into a part, mm."""
LEAST_FILM = 0.005
"""Smallest thickness of an air gap, mm; thinner ones are contacts to a simulation of rays."""


def check_numbers(
    light_design: int,
    film_thickness: float,
    fov: float,
    deflection: float,
    green_angle: float,
    coat: tuple[float, float],
    led_flux: tuple[float, float, float],
) -> None:
    """Check numbers that have a range of their own; `coat` is reflectance and specularity."""
    for flux in led_flux:
        require(
            0.0 <= flux < math.inf, f"led_flux has {flux:g}", "Give three powers in mW, 0 or more"
        )
    for name, value in zip(("reflectance", "specularity"), coat, strict=True):
        require(0.0 <= value <= 1.0, f"{name} is {value:g}", f"Give a {name} from 0 to 1")
    require(
        light_design in (1, 2, 3),
        f"there is no light_design {light_design}",
        "Give 1 (sides of the acrylic), 2 (sides of the belt) or 3 (belt bent over a roller)",
    )
    require(
        film_thickness == 0.0 or film_thickness >= LEAST_FILM,
        f"film_thickness is {film_thickness:g} mm",
        f"Give 0 for optical contact or at least {LEAST_FILM:g} mm",
    )
    require(
        0.0 < fov < 180.0, f"fov is {fov:g} degrees", "Give more than 0 and less than 180 degrees"
    )
    require(
        0.0 < deflection <= 60.0,
        f"deflection is {deflection:g} degrees",
        "Give more than 0 and at most 60 degrees",
    )
    require(
        0.0 <= green_angle < 80.0,
        f"green_angle is {green_angle:g} degrees",
        "Give 0 to 80 degrees from the normal of the belt",
    )


def check_camera(pupil_distance: float, window_bottom: float, loop: float) -> None:
    """Check the camera; lengths are depths of the window and of the returning belt, mm."""
    require(
        pupil_distance > window_bottom,
        f"the camera is inside the belt or the window, which reach {window_bottom:g} mm deep",
        "Make pupil_distance larger",
    )
    require(
        pupil_distance + CAMERA_DEPTH <= loop,
        f"a camera {pupil_distance:g} mm from the sensing surface and {CAMERA_DEPTH:g} mm deep "
        f"meets the returning belt at {loop:g} mm",
        "Make wheel_radius larger or pupil_distance smaller",
    )


def check_wheels(
    half: BeltHalf, corner: tuple[float, float], pupil_distance: float, fov: float
) -> None:
    """Check that wheels are clear of the window, whose corner (x, z) is given, and of its view."""
    flat = float(half.points[half.starts[1]][0])
    require(
        flat > corner[0],
        f"the flat run of the belt ends {flat:g} mm from the middle, the window only at "
        f"{corner[0]:g} mm",
        "Make wheel_distance larger or the window shorter",
    )
    depth = pupil_distance + corner[1]
    view = np.array([depth * math.tan(math.radians(0.5 * fov)), depth])
    for number, (x, z) in half.bends.items():
        radius = float(np.linalg.norm(half.points[half.starts[number]] - (x, z)))
        away = math.hypot(max(x - corner[0], 0.0), max(corner[1] - z, 0.0))
        from_pupil = np.array([x, z + pupil_distance])
        share = np.clip(from_pupil @ view / (view @ view), 0.0, 1.0)
        require(
            away > radius and float(np.linalg.norm(from_pupil - share * view)) > radius,
            f"a wheel of radius {radius:g} mm cuts into the window or the camera's view of it",
            "Make wheel_distance (in light design 3: incline) larger, or wheel_radius smaller",
        )


def check_green(half: BeltHalf, place: tuple[float, float]) -> None:
    """Check that the green LEDs, at (x, z) mm beside a half of the belt, are not inside a wheel."""
    for number, (x, z) in half.bends.items():
        radius = float(np.linalg.norm(half.points[half.starts[number]] - (x, z)))
        require(
            math.hypot(place[0] - x, place[1] - z) > radius,
            f"the green LEDs would be inside a wheel of radius {radius:g} mm",
            "Make roller_radius, wheel_radius or green_distance smaller, or incline larger",
        )


def check_leds(length: float, window_size: tuple[float, float], thickness: float) -> None:
    """Check that the rows (`length` mm) fit beside the opposite faces, `thickness` mm thick."""
    require(
        length <= min(window_size),
        f"a row of LEDs {length:g} mm long is longer than a side of the window "
        f"({window_size[0]:g} x {window_size[1]:g} mm)",
        "Use fewer leds_per_group or a smaller led_pitch",
    )
    require(
        thickness >= LED_WINDOW,
        f"LEDs with windows of {LED_WINDOW:g} mm don't fit beside a layer of {thickness:g} mm",
        "Make the gel (or in light design 1 the window) thicker",
    )
