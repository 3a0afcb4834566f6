"""Shares of units: those that one process computes in a row, to reuse scenes and light.

A sensor with other dimensions needs a new scene, and another coating or seed needs new photons;
other contacts, pictures and scores under the same light need neither.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from optisense.json_values import json_ready
from paper.unit import Unit

LEAST_UNITS = 6
"""Smallest number of units of a share, if so many have the same sensor.

Smaller shares build the sensor again more often. Larger ones leave processes idle at the end and
make the progress line jump.
"""


def shares(units: Iterable[Unit]) -> list[list[Unit]]:
    """Return units in groups: those with the same light together, then those of the same sensor.

    The groups are in the order in which sensors and lights first occur.
    """
    by_sensor: dict[str, dict[str, list[Unit]]] = {}
    for unit in units:
        by_sensor.setdefault(_sensor(unit), {}).setdefault(_light(unit), []).append(unit)
    found: list[list[Unit]] = []
    for lights in by_sensor.values():
        share: list[Unit] = []
        for group in lights.values():
            share += group
            if len(share) >= LEAST_UNITS:
                found.append(share)
                share = []
        if share:
            found.append(share)
    return found


def _sensor(unit: Unit) -> str:
    """Return a text that is the same for units with the same scene; a search has one of its own."""
    design = unit.inputs.get("design")
    if design is None or "method" in unit.inputs:
        return unit.key
    return json.dumps(json_ready([design["sensor"], design["dimensions"]]), sort_keys=True)


def _light(unit: Unit) -> str:
    """Return a text that is the same for units that trace the same photons."""
    asked = {**unit.inputs, **unit.inputs.get("settings", {})}
    light = [asked.get("design"), asked.get("photons"), asked.get("seed")]
    return json.dumps(json_ready(light), sort_keys=True)
