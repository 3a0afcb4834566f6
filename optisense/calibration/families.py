"""Families of numbers that a calibration may fit, each with its plausible ranges."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from optisense.calibration import _body_changes, _camera_families
from optisense.calibration.quantity import FitQuantity
from optisense.design import SensorDesign
from optisense.design.materials import Coating, Dielectric
from optisense.design.materials.coating import SMALLEST_ROUGHNESS
from optisense.design.materials.dielectric import MAX_POISSON_RATIO
from optisense.design.parts import Role

POWER_RANGE = 0.7
"""Plausible range of the logarithm of a light group's power: LEDs of one type differ by a factor of
two, and their drive currents are not published.
"""

LED_RANGE = 0.3
"""Plausible range of the logarithm of a single light's power: LEDs of one reel differ by 1/3."""

LIGHT_PLACE_RANGE = 0.7
"""Plausible range of a light group's place along the camera's axis, mm: half an LED's package."""

LIGHT_TILT_RANGE = 8.0
"""Plausible range of the tilt of a light group, degrees; it may not be soldered flat."""

ROW_RANGE = 0.5
"""Plausible range of the logarithm of the length of a row of lights: makers rarely publish how many
lights there are, and three in place of five make a row half as long.
"""

ROW_LIMITS = 0.2, 1.6
"""Smallest and largest length of a row of lights, relative to its start: longer ones would reach
past the parts that they shine into.
"""

WIDTH_RANGE = 0.3
"""Plausible range of the logarithm of the emission's width: windows of a package differ by 1/3."""

THICKNESS_RANGE = 0.05
"""Plausible range of the logarithm of a gel's thickness; GelSight states 5 % for its Mini."""

POISSON_RANGE = 0.01
"""Plausible range of a gel's Poisson ratio; silicones lie between 0.48 and 0.4999."""

SPECULAR_RANGE = 0.1
"""Plausible range of a coating's specularity, which makers describe only in words."""

ALPHA_RANGE = 0.2
"""Plausible range of the roughness (GGX alpha) of a coating's metal flake; flakes of sprayed paints
lie between 0.1 and 0.6.
"""

REFLECTANCE_RANGE = 0.3
"""Plausible range of the logarithm of a coating's reflectance: paints of a grey differ by 1/3."""

ROUGH_START, ROUGH_RANGE = 0.1, 0.2
"""GGX alpha of edges that are polished by flame or cut by laser, initial value and plausible range;
ground edges have about 0.4.
"""

INDEX_RANGE = 0.015
"""Plausible range of a refractive index; literature on one silicone differs by up to 0.04."""

EXPOSURE = FitQuantity(
    "exposure", "exposure of the photographs", "", 1.0, 1e-3, 1e3, POWER_RANGE, True,
    change=lambda design, value: design,
)  # fmt: skip
"""Factor on the first guess of the exposure, which is fitted if powers are kept: the guess is that
of the design before the fit, and other numbers would make up for its error. Its range is that of a
power, whose effect is the same."""


@dataclass(frozen=True)
class Family:
    """Numbers that are fitted together or not at all.

    Attributes:
        words: description of the numbers.
        of: function that returns the numbers of a design.
        usual: whether they are fitted by default; others only on request.
    """

    words: str
    of: Callable[[SensorDesign], Iterable[FitQuantity]]
    usual: bool = True


def _powers(design: SensorDesign, plausible_range: float = POWER_RANGE) -> list[FitQuantity]:
    return [
        FitQuantity(
            f"lights.{name}.flux", f"power of the {name} lights", "mW", group.flux,
            1e-3 * group.flux, min(1e6, 1e3 * group.flux), plausible_range, True,
        )
        for name, group in design.lights.items()
        if group.flux > 0.0
    ]  # fmt: skip


def _leds(design: SensorDesign) -> list[FitQuantity]:
    return _powers(_body_changes.with_single_lights(design), LED_RANGE)


def _lights(design: SensorDesign) -> Iterator[FitQuantity]:
    for name in design.lights:
        yield FitQuantity(
            f"lights.{name}.along", f"place of the {name} lights towards the skin", "mm",
            0.0, -2.0, 2.0, LIGHT_PLACE_RANGE, renders=True,
            change=partial(_body_changes.with_lights_moved, name), home=f"lights.{name}",
        )  # fmt: skip
        yield FitQuantity(
            f"lights.{name}.tilt", f"tilt of the {name} lights towards the skin", "degrees",
            0.0, -40.0, 40.0, LIGHT_TILT_RANGE, renders=True,
            change=partial(_body_changes.with_lights_tilted, name), home=f"lights.{name}",
        )  # fmt: skip


def _rows(design: SensorDesign) -> Iterator[FitQuantity]:
    for name in design.lights:
        length = _body_changes.row_length(design, name)
        if length is not None:
            yield FitQuantity(
                f"lights.{name}.row", f"length of the row of {name} lights", "mm", length,
                ROW_LIMITS[0] * length, ROW_LIMITS[1] * length, ROW_RANGE, True, renders=True,
                change=partial(_body_changes.with_row_length, name), home=f"lights.{name}.lights",
            )  # fmt: skip


def _emission(design: SensorDesign) -> Iterator[FitQuantity]:
    if _body_changes.widens(design):
        yield FitQuantity(
            "lights.emission", "width of the emission of all lights, times", "", 1.0, 0.3, 1.5,
            WIDTH_RANGE, True, renders=True, change=_body_changes.with_emission_width,
            home="lights",
        )  # fmt: skip


def _gel(design: SensorDesign) -> Iterator[FitQuantity]:
    gels = design.parts_of(Role.ELASTOMER)
    thickness = _body_changes.flat_gel_thickness(design)
    if thickness is not None:
        yield FitQuantity(
            f"parts.{gels[0]}.thickness", "thickness of the gel", "mm", thickness,
            0.7 * thickness, 1.4 * thickness, THICKNESS_RANGE, True, True, True,
            _body_changes.with_gel_thickness, f"parts.{gels[0]}",
        )  # fmt: skip
    for name in sorted({design.parts[part].material or "" for part in gels}):
        material = design.materials.get(name)
        if isinstance(material, Dielectric) and material.elasticity is not None:
            yield FitQuantity(
                f"materials.{name}.elasticity.poisson_ratio", "Poisson ratio of the gel", "",
                material.elasticity.poisson_ratio, 0.4, MAX_POISSON_RATIO, POISSON_RANGE,
                renders=True, moves_contacts=True,
            )  # fmt: skip


def _coating(design: SensorDesign) -> Iterator[FitQuantity]:
    coating = design.coating
    if not isinstance(coating, Coating):
        return
    yield FitQuantity(
        "coating.specularity", "specularity of the coating", "", coating.specularity, 0.0, 1.0,
        SPECULAR_RANGE, renders=True,
    )  # fmt: skip
    if coating.specularity > 0.0:  # without flake, pictures do not show its roughness
        yield FitQuantity(
            "coating.roughness", "roughness (GGX alpha) of the coating's flake", "",
            coating.reflection().roughness, SMALLEST_ROUGHNESS, 1.0, ALPHA_RANGE, renders=True,
        )  # fmt: skip
    brightest = max(coating.reflectance)
    if brightest > 0.0:
        yield FitQuantity(
            "coating.brightness", "reflectance of the coating, times", "", 1.0, 0.2,
            1.0 / brightest, REFLECTANCE_RANGE, True, renders=True,
            change=_body_changes.with_reflectance, home="coating.reflectance",
        )  # fmt: skip


def _edges(design: SensorDesign) -> Iterator[FitQuantity]:
    parts = _body_changes.edge_parts(design)
    if parts:
        known = _body_changes.edge_roughness(design, parts)
        yield FitQuantity(
            f"parts.{parts[0]}.edges", "roughness (GGX alpha) of the edges of rigid parts", "",
            ROUGH_START if known is None else known, 0.0, 1.0, ROUGH_RANGE, renders=True,
            change=partial(_body_changes.with_edge_roughness, parts),
            home=f"parts.{parts[0]}.faces", guessed=known is None,
        )  # fmt: skip


def _indices(design: SensorDesign) -> list[FitQuantity]:
    return [
        FitQuantity(
            f"materials.{name}.ior", f"refractive index of {name}", "", material.ior, 1.3, 1.7,
            INDEX_RANGE, False, True, True,
        )
        for name, material in design.materials.items()
        if isinstance(material, Dielectric) and 1.3 < material.ior < 1.7  # not air
    ]  # fmt: skip


LEDS = "leds"
"""Family with which each light gets a group of its own before the fit."""

FAMILIES = {
    "powers": Family("power of each light group", _powers),
    "colours": Family("colour matrix of the camera", _camera_families.colours),
    "tone": Family("exponent of the tone curve", _camera_families.tone),
    "black": Family(
        "level of each channel in the dark: black level and stray light", _camera_families.black
    ),
    "shading": Family("strength and exponent of the lens shading", _camera_families.shading),
    "view": Family("field of view", _camera_families.view),
    "place": Family("place of the camera across its axis", _camera_families.place),
    "pose": Family(
        "turn of the camera, and its place along its axis", _camera_families.pose, False
    ),
    "distortion": Family("radial distortion of the lens", _camera_families.distortion, False),
    LEDS: Family("power of each single light, which replaces that of the groups", _leds, False),
    "lights": Family("place and tilt of each light group, along the camera's axis", _lights, False),
    "rows": Family("length of each straight row of lights", _rows, False),
    "emission": Family("width of the emission of lights", _emission, False),
    "edges": Family("roughness of the edges of rigid transparent parts", _edges, False),
    "coating": Family("specularity, roughness and reflectance of the coating", _coating, False),
    "gel": Family("thickness of a flat gel, and Poisson ratio", _gel, False),
    "indices": Family("refractive indices", _indices, False),
}
"""Families of quantities that a calibration can fit, by name."""

USUAL = tuple(name for name, family in FAMILIES.items() if family.usual)
"""Names of the families that a calibration fits by default."""


def chosen_families(keep: Sequence[str], also: Sequence[str]) -> tuple[str, ...]:
    """Return the default families without those in `keep`, and with those in `also`; powers of
    single lights replace those of the groups.
    """
    wanted = {*USUAL, *also} - {*keep}
    if LEDS in wanted:
        wanted.discard("powers")
    return tuple(name for name in FAMILIES if name in wanted)
