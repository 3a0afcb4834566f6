"""Sections of a page on the light: the ledger as bars, a table and photon paths in 3-D, and the
sources of the light at places of the skin.

Each light group has a bar; at a place, it also has a drawing of the directions that its light comes
from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.percentages import bound_percent
from optisense.quality import photons_of
from optisense.report._files import as_json, page, script
from optisense.report._pictures import encoded, swatch_of
from optisense.report._scene_view import scene_data

if TYPE_CHECKING:
    from optisense.optics import OpticalModel
    from optisense.optics.ledger import LightLedger
    from optisense.optics.light_at_camera import CameraLight
    from optisense.optics.light_paths import PhotonPath
    from optisense.optics.place_light import GroupLight, Place, PlaceLight

WAY_COLOURS = ("#0f7a41", "#6fc07a", "#4b3f8f", "#bf7a4a", "#f2c27b")
"""Colours of the light's paths, in the order of `optisense.optics.place_light.WAY_WORDS`."""

LEAST_LABELLED_AT_PLACE = 0.12
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
                    "label": f"{100 * share:.0f} %" if share >= LEAST_LABELLED_AT_PLACE else "",
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


REPORT_PHOTONS = photons_of("draft")
"""Number of photons of the ledger in the report of a render: the noise of a line is then 0.3 to 0.4
% of the group's light, which no bar shows. Together with the paths they take 3 to 5 % of the time
of a render.
"""

PHOTONS_PER_LIGHT = 100
"""Smallest number of photons per light of a ledger, so that none goes unnoticed among many."""

LEAST_DRAWN = 0.005
"""Smallest share of a group's light whose place is drawn alone; smaller ones share a drawing."""

LEAST_TOLD = 0.0005
"""Smallest share that the table shows as a number: 0.1 % when rounded."""

LEAST_LABELLED = 0.09
"""Smallest share of a bar that has room for its number, also on a screen of 390 pixels."""

OTHER = "other places"
OTHER_COLOUR = "#9aa5b1"

COLOURS: Mapping[str, Sequence[str]] = {
    "coating in view": ("#0f7a41",),
    "coating out of view": ("#6fc07a",),
    "absorbed by a part": ("#4b3f8f", "#7b68c0", "#a797dc", "#cbbff0"),
    "absorbed in a medium": ("#8f4a24", "#bf7a4a", "#deb08c"),
    "escaped": ("#c96a00", "#ef9a2e", "#f6c06f", "#f3d9a4"),
    "lost": ("#66727f",),
}
"""Hues for the ways in which light ends, and their shades for the places, the largest first. No hue
is one of a usual light group.
"""


@dataclass(frozen=True)
class LightSection:
    """Data of the section.

    Attributes:
        ledger: ledger of the light of each group.
        paths: typical photons of each group.
        places: light at places of the skin.
        camera: light that reaches the camera, if known.
    """

    ledger: LightLedger
    paths: Mapping[str, Sequence[PhotonPath]]
    places: Sequence[PlaceLight] = ()
    camera: CameraLight | None = None

    @staticmethod
    def of(
        model: OpticalModel,
        photons: int | None = None,
        seed: int = 0,
        at: Sequence[Place] = (),
        camera: CameraLight | None = None,
    ) -> LightSection:
        """Follow the light of a model.

        Args:
            photons: number of photons of the ledger; as many as suit a drawing if None.
            at: places of the skin to examine, see `optisense.optics.light_at`.
            camera: light that reaches the camera, to be shown as well.

        Raises:
            ContactError: a place is off the surface.
            RenderError: there are too few photons.
        """
        from optisense.optics.ledger import cells_in_view, light_ledger
        from optisense.optics.light_paths import photon_paths
        from optisense.optics.place_light import light_at

        lights = sum(len(group.lights) for group in model.design.lights.values())
        number = max(REPORT_PHOTONS, PHOTONS_PER_LIGHT * lights) if photons is None else photons
        seen = cells_in_view(model)
        ledger = light_ledger(model, number, seed, seen)
        places = [light_at(model, place, number, seed, seen) for place in at]
        return LightSection(ledger, photon_paths(model, seed=seed, seen=seen), places, camera)

    @cached_property
    def colours(self) -> dict[str, str]:
        """Colours of the places that are drawn on their own, those that take most light first."""
        kinds, used = self.ledger.kinds(), dict.fromkeys(COLOURS, 0)
        found = {}
        for where in self.ledger.places():
            if max(self._shares(where)) >= LEAST_DRAWN:
                shades, number = COLOURS[kinds[where]], used[kinds[where]]
                found[where] = shades[min(number, len(shades) - 1)]
                used[kinds[where]] += 1
        return found

    def values(self, design: SensorDesign) -> dict[str, Any]:
        """Return the values of the template ``light``."""
        groups = list(self.ledger.emitted)
        noise = max((entry.noise for entry in self.ledger.entries), default=0.0)
        return {
            "groups": groups,
            "bars": [self._bar(group, design) for group in groups],
            "rows": self._rows(),
            "lens": {
                title: [values[group] for group in groups]
                for title, values in (self.camera.as_text() if self.camera else {}).items()
            },
            "faces": {
                face: [_percent(share) for share in shares]
                for face, shares in self.ledger.faces(LEAST_DRAWN).items()
            },
            "photons": f"{self.ledger.photons:,}",
            "noise": bound_percent(noise),
            "drawn": max(len(paths) for paths in self.paths.values()) if self.paths else 0,
        }

    def ways(self) -> list[dict[str, Any]]:
        """Return the data of the 3-D view: name and colour of each place, and by light group the
        number of photons that end there and the segments of their paths, pairs of ends in mm as
        text.
        """
        found: dict[str, dict[str, list[Any]]] = {}
        for group, paths in self.paths.items():
            for path in paths:
                where = path.where if path.where in self.colours else OTHER
                pairs = np.repeat(path.points, 2, axis=0)[1:-1]
                found.setdefault(where, {}).setdefault(group, []).append(pairs)
        order = [where for where in (*self.colours, OTHER) if where in found]
        return [
            {
                "label": where,
                "colour": self.colours.get(where, OTHER_COLOUR),
                "photons": {group: len(pieces) for group, pieces in found[where].items()},
                "groups": {
                    group: encoded(np.concatenate(pieces), np.float32)
                    for group, pieces in found[where].items()
                },
            }
            for where in order
        ]

    def _shares(self, where: str) -> list[float]:
        return [self.ledger.share(group, where) for group in self.ledger.emitted]

    def _others(self, group: str) -> float:
        """Return the share of all places that are not drawn on their own."""
        entries = [entry for entry in self.ledger.entries if entry.group == group]
        return sum(entry.share for entry in entries if entry.where not in self.colours)

    def _bar(self, group: str, design: SensorDesign) -> dict[str, Any]:
        pieces, start = [], 0.0
        for where, colour in (*self.colours.items(), (OTHER, OTHER_COLOUR)):
            others = where == OTHER
            share = self._others(group) if others else self.ledger.share(group, where)
            if share > 0.0:
                pieces.append(_piece(where, colour, start, share))
                start += share
        return {
            "name": group,
            "swatch": swatch_of(design.lights[group].colour),
            "emitted": f"{self.ledger.emitted[group]:.3g} mW",
            "pieces": pieces,
        }

    def _rows(self) -> list[tuple[str, str, list[str]]]:
        rows = [
            (where, colour, [_percent(share) for share in self._shares(where)])
            for where, colour in self.colours.items()
        ]
        others = [self._others(group) for group in self.ledger.emitted]
        if max(others, default=0.0) >= LEAST_TOLD:
            rows.append((OTHER, OTHER_COLOUR, [_percent(share) for share in others]))
        return rows


def ledger_page(design: SensorDesign, section: LightSection) -> str:
    """Return the page of ``optisense ledger`` as text."""
    return page(
        "ledger",
        title=design.name,
        description=design.description,
        light=section.values(design),
        places=places_values(section.places, design),
        scene=as_json(scene_data(design, {}, ways=section.ways())),
        viewer_script=script("viewer.js"),
    )


def _piece(where: str, colour: str, start: float, share: float) -> dict[str, str]:
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    dark = 0.299 * red + 0.587 * green + 0.114 * blue < 150  # luma of ITU-R BT.601, 0 to 255
    return {
        "where": where,
        "colour": colour,
        "ink": "#ffffff" if dark else "#1c232b",
        "x": f"{100 * start:.3f}%",
        "width": f"{100 * share:.3f}%",
        "middle": f"{100 * (start + share / 2):.3f}%",
        "label": f"{100 * share:.0f} %" if share >= LEAST_LABELLED else "",
        "title": f"{where}: {_percent(share)}",
    }


def _percent(share: float) -> str:
    if share < LEAST_TOLD:
        return "0" if share <= 0.0 else "< 0.1 %"
    return f"{100 * share:.1f} %"
