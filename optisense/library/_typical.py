"""Typical outputs of the library's lights, and light groups that are driven above them."""

from __future__ import annotations

import numpy as np

from optisense.design.fields import Colour
from optisense.design.sensor_design import SensorDesign
from optisense.errors import LibraryError
from optisense.library._entries import LightEntry, TypicalLight
from optisense.library.loader import entry

OVERDRIVEN = 1.05
"""Ratio of a light's flux to its nominal flux from which on it is remarked."""

FAINT = 0.01
"""Ratio of a group's flux to the median of the groups that are on below which it is remarked: watts
in place of milliwatts are a thousandth, and the groups of the built-in sensors have 0.46 and more.
"""


def typical_colour(model: str, colour: Colour) -> tuple[str, TypicalLight] | None:
    """Return name and numbers of the colour of a library's light that has these shares of R, G and
    B, or None if the library has none, or can't read its entry.
    """
    try:
        found = entry("light", model)
    except LibraryError:
        return None
    assert isinstance(found, LightEntry)
    wanted = np.array(colour) / sum(colour)
    for name, typical in found.typical.items():
        if np.allclose(np.array(typical.colour) / sum(typical.colour), wanted, atol=1e-3):
            return name, typical
    return None


def unusual_fluxes(design: SensorDesign) -> list[str]:
    """Return a sentence for each light group whose flux is above the nominal flux that the library
    names for its light and colour, or far below that of the other groups that are on.
    """
    found: list[str] = []
    usual = float(np.median([group.flux for group in design.lights.values() if group.flux] or [0]))
    for name, group in design.lights.items():
        if 0.0 < group.flux < FAINT * usual:
            found.append(
                f"lights {name}: {group.flux:g} mW each is {group.flux / usual:.2g} times the "
                f"median of the groups, {usual:g} mW: fluxes are in mW; 0 switches a group off"
            )
            continue
        colour = typical_colour(group.model, group.colour)
        if colour is None or colour[1].flux is None:
            continue
        times = group.flux / colour[1].flux
        if times > OVERDRIVEN:
            at = f" at {colour[1].current:g} mA" if colour[1].current else ""
            found.append(
                f"lights {name}: {group.flux:g} mW each is {times:.2g} times the nominal flux of "
                f"a {colour[0]} {group.model}, which is {colour[1].flux:g} mW{at}: "
                "lower it, or use a brighter light"
            )
    return found
