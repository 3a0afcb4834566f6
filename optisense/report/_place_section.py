"""Section of a page on the sources of the light at a place of the skin.

Each light group has a bar, and a drawing of the directions that its light comes from.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.percentages import bound_percent
from optisense.report._drawing import swatch_of

if TYPE_CHECKING:
    from optisense.optics.place_light import GroupLight, PlaceLight

WAY_COLOURS = ("#0f7a41", "#6fc07a", "#4b3f8f", "#bf7a4a", "#f2c27b")
"""Colours of the light's paths, in the order of `optisense.optics.place_light.WAY_WORDS`."""

LEAST_LABELLED = 0.12
"""Smallest share of a bar with room for its number, such as 12 %, beside the directions."""

SKY_RADIUS = 90.0
"""Radius of the drawing from the skin's normal, in the middle, to its horizon: 1 per degree."""


def places_values(places: Sequence[PlaceLight], design: SensorDesign) -> list[dict[str, Any]]:
    """Return the values of the template ``places``."""
    return [_place(place, design) for place in places]


def _place(place: PlaceLight, design: SensorDesign) -> dict[str, Any]:
    noise = max((each.noise for each in place.groups.values()), default=0.0)
    words = list(next(iter(place.groups.values())).ways) if place.groups else []
    met = [
        (word, colour)
        for word, colour in zip(words, WAY_COLOURS, strict=False)
        if any(each.ways[word] > 0.0 for each in place.groups.values())
    ]
    return {
        "at": "({})".format(", ".join(f"{part:g}" for part in place.at)),
        "groups": [_group(name, each, design) for name, each in place.groups.items()],
        "legend": met,
        "photons": f"{place.photons:,}",
        "noise": bound_percent(noise),
    }


def _group(name: str, light: GroupLight, design: SensorDesign) -> dict[str, Any]:
    pieces, start = [], 0.0
    for (word, share), colour in zip(light.ways.items(), WAY_COLOURS, strict=True):
        if share > 0.0:
            pieces.append(
                {
                    "colour": colour,
                    "x": f"{100 * start:.3f}%",
                    "width": f"{100 * share:.3f}%",
                    "middle": f"{100 * (start + share / 2):.3f}%",
                    "ink": "#1c232b" if colour in WAY_COLOURS[1::3] else "#ffffff",
                    "label": f"{100 * share:.0f} %" if share >= LEAST_LABELLED else "",
                    "title": f"{word}: {100 * share:.1f} %",
                }
            )
            start += share
    return {
        "name": name,
        "swatch": swatch_of(design.lights[name].colour),
        "irradiance": f"{light.irradiance:.3g} mW/mm²",
        "of_mean": f"{light.of_mean:.2f} of the mean in view",
        "angle": f"{light.mean_angle:.0f}°",
        "azimuth": f"{light.main_azimuth:.0f}°",
        "pieces": pieces,
        "sky": _sky(light.sky),
    }


def _sky(sky: NDArray[np.float64]) -> list[dict[str, str]]:
    """Return the sectors of the rings, more opaque for more light per solid angle."""
    tilts, turns = sky.shape
    edges = np.linspace(0.0, np.pi / 2, tilts + 1)
    solid = (np.cos(edges[:-1]) - np.cos(edges[1:])) * 2 * np.pi / turns
    density = sky / solid[:, None]
    most = density.max()
    found = []
    for tilt, turn in zip(*np.nonzero(sky > 0.0), strict=True):
        inner, outer = (SKY_RADIUS * (tilt + k) / tilts for k in (0, 1))
        first, last = (2 * np.pi * (turn + k) / turns for k in (0, 1))
        corners = [
            (radius * np.cos(angle), -radius * np.sin(angle))
            for radius, angle in ((inner, first), (outer, first), (outer, last), (inner, last))
        ]
        (ax, ay), (bx, by), (cx, cy), (dx, dy) = corners
        found.append(
            {
                "path": f"M{ax:.1f} {ay:.1f}L{bx:.1f} {by:.1f}"
                f"A{outer:.1f} {outer:.1f} 0 0 0 {cx:.1f} {cy:.1f}"
                f"L{dx:.1f} {dy:.1f}A{inner:.1f} {inner:.1f} 0 0 1 {ax:.1f} {ay:.1f}Z",
                "opacity": f"{np.sqrt(density[tilt, turn] / most):.2f}",
                "title": f"{100 * sky[tilt, turn]:.1f} % from {10 * tilt} to {10 * (tilt + 1)}° "
                f"to the normal, azimuth {30 * turn} to {30 * (turn + 1)}°",
            }
        )
    return found
