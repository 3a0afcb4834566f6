"""Sources of numbers that several built-in sensors share, and sizes and fluxes of their LEDs, which
are those of the library.
"""

from __future__ import annotations

from collections.abc import Mapping

from optisense import library
from optisense.design import Provenance, Status
from optisense.errors import DesignError
from optisense.library import LightEntry

Sources = Mapping[str, tuple[Status, str]]
"""Status and text of the source by dotted path."""

XP565: Sources = {
    "materials.silicone-xp565.ior": (Status.ASSUMED, "the gel's silicone is not published"),
    "materials.silicone-xp565.elasticity": (
        Status.ASSUMED,
        "Poisson ratio usual for silicones; friction as the FEATS project takes it",
    ),
    "materials.silicone-xp565.elasticity.youngs_modulus": (
        Status.ASSUMED,
        "as the gel of a GelSight Mini, fitted to measured forces (FEATS project)",
    ),
}
"""Silicone of the gels whose own silicone is not known."""

BALANCED = (
    "what the LED's weakest colour gives at its nominal current (library); the brighter colours "
    "are taken to be dimmed to it with resistors, as on boards of sister sensors"
)
"""Source text of a flux from `balanced_flux`."""

FLUXES: Sources = {
    "lights.red.flux": (Status.DERIVED, BALANCED),
    "lights.green.flux": (Status.ASSUMED, "as red"),
    "lights.blue.flux": (Status.ASSUMED, "as red"),
}
"""Fluxes of red, green and blue lights from `balanced_flux`."""


def provenance_of(sources: Sources) -> dict[str, Provenance]:
    """Return the provenance of a design by dotted path."""
    return {path: Provenance(status=s, source=text) for path, (s, text) in sources.items()}


def balanced_flux(model: str) -> float:
    """Return the radiant flux that an LED of the library has in each of its colours, mW.

    Boards of GelSight sensors bring their colours to one brightness with resistors (the published
    board of GraspEveryThing has 45, 400 and 600 ohm for red, green and blue): the weakest colour
    runs at its nominal current.
    """
    return min(nominal_fluxes(model).values())


def nominal_fluxes(model: str) -> dict[str, float]:
    """Return the radiant flux of each colour ("red", ...) of an LED of the library at its nominal
    current, mW.

    Raises:
        DesignError: the library states none.
    """
    entry = library.entry("light", model)
    assert isinstance(entry, LightEntry)
    known = {name: light.flux for name, light in entry.typical.items() if light.flux is not None}
    if not known:
        raise DesignError(
            f"the library knows no flux of the light '{model}'", hint="Give led_flux in mW"
        )
    return known


def package(model: str) -> tuple[float, float, float]:
    """Return width, length and height of an LED's body, as in the library, mm."""
    entry = library.entry("light", model)
    assert isinstance(entry, LightEntry) and entry.package is not None
    return entry.package
