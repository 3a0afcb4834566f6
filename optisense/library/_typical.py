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


def overdriven_lights(design: SensorDesign) -> list[str]:
    """Return a sentence for each light group whose flux is above the nominal flux that the library
    names for its light and colour.
    """
    found: list[str] = []
    for name, group in design.lights.items():
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
