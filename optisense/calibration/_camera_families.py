"""Families of numbers of the camera that a calibration may fit, with their plausible ranges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from optisense.calibration.quantity import FitQuantity
from optisense.design import SensorDesign, set_value
from optisense.design.kinds import KindModel
from optisense.design.lenses.shading import RadialShading
from optisense.design.posing import with_camera_turned
from optisense.design.responses.tone_curve import GammaCurve

MIX_RANGE = 0.5
"""Plausible range of an entry of the colour matrix off its diagonal; those of published camera
tunings reach 1.
"""

GAMMA_START, GAMMA_RANGE = 1.8, 0.4
"""Initial exponent of the tone curve, and the plausible range of its logarithm: cameras of sensors
lie between linear (1) and sRGB (about 2.2).
"""

DARK_RANGE = 0.05
"""Plausible range of the level of a channel in the dark, as a share of full: black levels of
published camera tunings are 0.06 and less.
"""

FALLOFF_START, FALLOFF_RANGE = 0.2, 0.3
"""Share of the light that the lens loses in the corners: initial value and plausible range."""

SHADING_POWER, SHADING_RANGE = 2.0, 0.4
"""Power of the distance with which the loss grows, initial value, and the plausible range of its
logarithm: lenses alone lose with the square or faster, and light guides add to it.
"""

FIELD_RANGE = 0.08
"""Plausible range of the logarithm of the field of view: those of one type differ by 1/10."""

PLACE_RANGE = 0.8
"""Plausible range of the camera's position across its axis, mm; it is glued in by hand."""

TURN_RANGE = 1.5
"""Plausible range of a turn of the camera about each axis, degrees; it is glued in by hand."""

AHEAD_RANGE = 0.5
"""Plausible range of the camera's position along its axis, mm: lenses are moved to be focused."""

DISTORTION_RANGE = 0.1
"""Plausible range of the coefficient of radial distortion; that of wide lenses is -0.3 to 0.1."""

_LETTERS = "RGB"


def notes_on_kinds(design: SensorDesign, families: Sequence[str]) -> list[str]:
    """Return a note on each component of the camera that is not fitted because it is of another
    kind than its family, one of those named, fits.
    """
    fitted: dict[str, tuple[str, type[KindModel], str]] = {
        "tone": ("tone_curve", GammaCurve, "gamma"),
        "shading": ("shading", RadialShading, "radial"),
    }
    notes = []
    for family, (name, kind, word) in fitted.items():
        own = getattr(design.camera, name)
        if family in families and own is not None and not isinstance(own, kind):
            notes.append(
                f"'{family}' is not fitted, as the camera's {name} is of kind '{own.kind}'; "
                f"a fit changes kind '{word}' only, so set that in the design to fit it"
            )
    return notes


def lit_channels(design: SensorDesign) -> list[int]:
    """Return the channels 0 to 2 (R, G, B) in which a light of the design emits."""
    return [
        channel
        for channel in range(3)
        if any(group.channel_flux()[channel] > 0.0 for group in design.lights.values())
    ]


def colours(design: SensorDesign) -> list[FitQuantity]:
    """Return the entries of the colour matrix off its diagonal, without the shares of channels in
    which no light emits: pictures do not show them.
    """
    lit = lit_channels(design)
    matrix = np.eye(3) if design.camera.colour_matrix is None else design.camera.colour_matrix
    return [
        FitQuantity(
            f"camera.colour_matrix[{row}][{column}]",
            f"share of {_LETTERS[column]} in the picture's {_LETTERS[row]}",
            "", float(matrix[row][column]), -4.0, 4.0, MIX_RANGE, home="camera.colour_matrix",
        )
        for row in range(3)
        for column in lit
        if row != column
    ]  # fmt: skip


def tone(design: SensorDesign) -> Iterator[FitQuantity]:
    """Return the exponent of the tone curve; a curve of another kind has none."""
    curve = design.camera.tone_curve
    if curve is None or isinstance(curve, GammaCurve):
        yield FitQuantity(
            "camera.tone_curve.gamma", "exponent of the tone curve", "",
            GAMMA_START if curve is None else curve.gamma, 0.5, 5.0, GAMMA_RANGE, True,
            home="camera.tone_curve", guessed=curve is None,
        )  # fmt: skip


def black(design: SensorDesign) -> list[FitQuantity]:
    """Return the level of each channel in the dark."""
    start = design.camera.stray_light or (0.0, 0.0, 0.0)
    return [
        FitQuantity(
            f"camera.stray_light[{channel}]", f"level of {letter} in the dark", "",
            start[channel], 0.0, 0.5, DARK_RANGE, home="camera.stray_light",
        )
        for channel, letter in enumerate(_LETTERS)
    ]  # fmt: skip


def shading(design: SensorDesign) -> Iterator[FitQuantity]:
    """Return strength of the lens shading in each channel in which a light emits, and its power; a
    shading of another kind has neither.
    """
    own, lit = design.camera.shading, lit_channels(design)
    green, red, blue, power = FALLOFF_START, FALLOFF_START, FALLOFF_START, SHADING_POWER
    if own is not None:
        if not isinstance(own, RadialShading):
            return
        green, power = own.falloff, own.power
        red = green if own.red_falloff is None else own.red_falloff
        blue = green if own.blue_falloff is None else own.blue_falloff
    for channel, name, letter, start in (
        (1, "falloff", "G", green),
        (0, "red_falloff", "R", red),
        (2, "blue_falloff", "B", blue),
    ):
        if channel in lit:
            yield FitQuantity(
                f"camera.shading.{name}", f"lens shading of {letter} in the image corners", "",
                start, 0.0, 0.95, FALLOFF_RANGE, home="camera.shading", guessed=own is None,
            )  # fmt: skip
    yield FitQuantity(
        "camera.shading.power", "exponent of the lens shading by the distance from the middle", "",
        power, 1.0, 8.0, SHADING_RANGE, True, home="camera.shading", guessed=own is None,
    )  # fmt: skip


def view(design: SensorDesign) -> Iterator[FitQuantity]:
    """Return the field of view."""
    fov = design.camera.fov
    most = 175.0 if design.camera.projection == "perspective" else 360.0
    yield FitQuantity(
        "camera.fov", "field of view", "degrees", fov, 0.3 * fov, min(most, 3.0 * fov),
        FIELD_RANGE, True, True, views=True,
    )  # fmt: skip


def place(design: SensorDesign) -> Iterator[FitQuantity]:
    """Return the camera's place across its axis."""
    for number, (axis, words) in enumerate(
        (("right", "to the picture's right"), ("up", "to its top"))
    ):
        yield FitQuantity(
            f"camera.across.{axis}", f"place of the camera {words}", "mm", 0.0, -10.0, 10.0,
            PLACE_RANGE, renders=True, views=True,
            change=partial(with_camera_moved, number), home="camera.position",
        )  # fmt: skip


def pose(design: SensorDesign) -> Iterator[FitQuantity]:
    """Return the turns of the camera about its axes, and its place along its axis."""
    for number, (name, words) in enumerate(
        (("pitch", "up"), ("yaw", "to the left"), ("roll", "clockwise"))
    ):
        yield FitQuantity(
            f"camera.turn.{name}", f"turn of the camera {words}", "degrees", 0.0, -20.0, 20.0,
            TURN_RANGE, renders=True, views=True,
            change=partial(with_camera_turned, number), home="camera.direction",
        )  # fmt: skip
    yield FitQuantity(
        "camera.along", "place of the camera towards the skin", "mm", 0.0, -5.0, 5.0, AHEAD_RANGE,
        renders=True, views=True, change=partial(with_camera_moved, 2),
        home="camera.position",
    )  # fmt: skip


def distortion(design: SensorDesign) -> Iterator[FitQuantity]:
    """Return the first coefficient of the lens's radial distortion."""
    own = design.camera.distortion
    start = 0.0 if own is None else getattr(own, "k1", None)
    if start is not None:
        yield FitQuantity(
            "camera.distortion.k1", "radial distortion of the lens (k1)", "", start,
            min(start, -0.5), max(start, 0.5), DISTORTION_RANGE, renders=True, views=True,
            change=with_distortion, home="camera.distortion",
        )  # fmt: skip


def with_camera_moved(axis: int, design: SensorDesign, amount: float) -> SensorDesign:
    """Return a design whose camera is moved by `amount` mm along one of its axes: to the picture's
    right (0), to its top (1) or ahead (2).
    """
    moved = np.array(design.camera.position) + amount * design.camera.axes()[axis]
    return set_value(design, "camera.position", tuple(moved.tolist()))


def with_distortion(design: SensorDesign, k1: float) -> SensorDesign:
    """Return a design with another first coefficient of its lens's radial distortion."""
    own = design.camera.distortion
    if own is not None:
        return set_value(design, "camera.distortion.k1", k1)
    fisheye = design.camera.projection == "equidistant"
    kind = "kannala-brandt" if fisheye else "brown-conrady"
    return set_value(design, "camera.distortion", {"kind": kind, "k1": k1})
