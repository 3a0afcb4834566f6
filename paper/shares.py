"""Which units one process works out in a row, so that it need not make the same thing twice.

A sensor of other dimensions needs a new scene, another coating or seed needs new photons; other
contacts, pictures and scores under the same light need neither.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

from optisense.objectives.score import json_ready
from paper.unit import Unit

LEAST_UNITS = 6
"""Least units of a share, where so many have the same sensor: fewer build it anew often, more are
spread badly over processes, and progress comes in large steps."""


def shares(units: Iterable[Unit]) -> list[list[Unit]]:
    """Units in groups: those with the same light together, then those of the same sensor, in the
    order in which sensors and lights are first asked for.
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
    """The same text for units that build the same scene; searches build many."""
    design = unit.inputs.get("design")
    if design is None or "method" in unit.inputs:
        return unit.key
    return json.dumps(json_ready([design["sensor"], design["dimensions"]]), sort_keys=True)


def _light(unit: Unit) -> str:
    """The same text for units that trace the same photons."""
    asked = {**unit.inputs, **unit.inputs.get("settings", {})}
    light = [asked.get("design"), asked.get("photons"), asked.get("seed")]
    return json.dumps(json_ready(light), sort_keys=True)
