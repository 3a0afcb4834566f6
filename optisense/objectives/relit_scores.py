"""RGB2Normal and NormDiff of the same presses under thousands of lights.

Which pixels lie on a line, their normals, and which normals are neighbours do not depend on the
light. Here they are worked out once; what is left for each colouring is a little linear algebra.
The values are those of the objectives themselves, but for rounding.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.objectives.normdiff import (
    LEAST_NOISE,
    POLE,
    azimuth_on_sphere,
    indented_pixels,
    normal_cells,
)
from optisense.objectives.press import Press, azimuths
from optisense.objectives.registry import Objective
from optisense.objectives.rgb2normal import lines_of, signed_angles

FloatArray = NDArray[np.float64]
Found = tuple[float, dict[str, Any]]
"""A value and its single numbers."""

PAIRS = 250_000
"""Pairs of pixels that are compared at once: as many as stay in a processor's cache."""

KEPT_PAIRS = 1_500_000
"""Presses with fewer pairs keep their table of angles between azimuths."""


class RelitScore(ABC):
    """One objective, made ready for presses whose light alone will change."""

    @abstractmethod
    def __call__(self, presses: Sequence[Press]) -> Found:
        """The score of the same presses under other lights.

        Raises:
            ObjectiveError: a press can't be judged.
        """


class Rgb2NormalRelit(RelitScore):
    """RGB2Normal (see `optisense.objectives.rgb2normal.rgb2normal`)."""

    def __init__(self, presses: Sequence[Press], settings: Mapping[str, Any]) -> None:
        """Find the pixels of all lines and their angles.

        Raises:
            ObjectiveError: a line has too few pixels.
        """
        self._colours: str = settings["colours"]
        self._pixels, angles, owner = [], [], []
        for number, press in enumerate(presses):
            for angle, chosen in lines_of(press, **_some(settings, LINE_SETTINGS)).items():
                self._pixels.append((number, chosen))
                angles.append(signed_angles(press, angle, press.normals[chosen]))
                owner.append(number)
        longest = max(len(each) for each in angles)
        self._inside = np.array([np.arange(longest) < len(each) for each in angles])
        self._angles = np.zeros((len(angles), longest))
        for row, each in enumerate(angles):
            self._angles[row, : len(each)] = each - each.mean()
        self._spread = (self._angles**2).sum(axis=1)
        self._count = self._inside.sum(axis=1)
        self._owner = np.array(owner)
        self._places = np.bincount(self._owner)

    def __call__(self, presses: Sequence[Press]) -> Found:
        """See `RelitScore`."""
        colours = np.zeros((*self._inside.shape, 3))
        for row, (number, chosen) in enumerate(self._pixels):
            found = presses[number].colours(chosen, self._colours)
            colours[row, : len(found)] = found
        mean = colours.sum(axis=1) / self._count[:, None]
        centred = np.where(self._inside[..., None], colours - mean[:, None], 0.0)
        # The first principal component is that of the 3x3 covariance, and R² the square of the
        # correlation between the angles and the colours along it.
        length, axes = np.linalg.eigh(np.einsum("lpa,lpb->lab", centred, centred))
        shared = np.einsum("lp,lpa,la->l", self._angles, centred, axes[:, :, 2])
        known = np.where(self._inside[..., None], colours, colours[:, :1])
        flat = (self._spread == 0.0) | (np.ptp(known, axis=1).max(axis=1) == 0.0)
        linearity = np.where(
            flat, 0.0, shared**2 / np.where(flat, 1.0, self._spread * length[:, 2])
        )
        by_place = np.bincount(self._owner, linearity) / self._places
        return float(by_place.mean()), {
            "worst_line": float(linearity.min()),
            "places": by_place.tolist(),
        }


class NormDiffRelit(RelitScore):
    """NormDiff (see `optisense.objectives.normdiff.normdiff`)."""

    def __init__(self, presses: Sequence[Press], settings: Mapping[str, Any]) -> None:
        """Find indented pixels, their normals and the cells of the sphere.

        Raises:
            ObjectiveError: a press has too few indented pixels.
        """
        self._settings = settings
        self._pixels = [indented_pixels(press, settings["least_pixels"]) for press in presses]
        self._tables = [
            _Confusion(*azimuths(press, press.normals[chosen]))
            for press, chosen in zip(presses, self._pixels, strict=True)
        ]

    def __call__(self, presses: Sequence[Press]) -> Found:
        """See `RelitScore`."""
        given = self._settings
        means = []
        for press, chosen, table in zip(presses, self._pixels, self._tables, strict=True):
            means.append(table.ranges(press.colours(chosen, given["colours"]), given["noise"]))
        theta, phi = np.array(means).T
        places = -(given["theta_weight"] * theta + given["phi_weight"] * phi)
        return float(places.mean()), {
            "theta_range": float(theta.mean()),
            "phi_range": float(phi.mean()),
            "places": places.tolist(),
        }


class _Confusion:
    """The indented pixels of one press, whose colours are still to come."""

    def __init__(self, theta: FloatArray, phi: FloatArray) -> None:
        cells, _, _ = normal_cells(theta, phi)
        # In the order of their polar angles the first pixel in a box has the smallest one.
        self._order = np.argsort(theta, kind="stable")
        self._theta = theta[self._order]
        self._phi = phi[self._order] % 360.0
        self._counts = self._theta >= POLE
        _, member = np.unique(cells[self._order], return_inverse=True)
        self._weights = 1.0 / np.bincount(member)[member]
        self._weights /= self._weights.sum()
        rows = max(1, PAIRS // len(theta))
        self._blocks = [slice(k, k + rows) for k in range(0, len(theta), rows)]
        small = len(theta) ** 2 <= KEPT_PAIRS
        self._away = [self._from(block) for block in self._blocks] if small else None

    def ranges(self, colours: FloatArray, noise: float) -> tuple[float, float]:
        """Means over the sphere of the ranges of both angles, degrees, for colours (n, 3)."""
        c = colours[self._order]
        width = np.maximum(noise * c, LEAST_NOISE)
        low, high = c - width, c + width
        theta_range, arc = np.empty(len(c)), np.empty(len(c))
        for number, block in enumerate(self._blocks):
            within = np.ones((len(c[block]), len(c)), dtype=bool)
            for channel in range(3):
                values = c[:, channel]
                within &= values >= low[block, channel, None]
                within &= values <= high[block, channel, None]
            first = within.argmax(axis=1)
            last = len(c) - 1 - within[:, ::-1].argmax(axis=1)
            theta_range[block] = self._theta[last] - self._theta[first]
            away = self._away[number] if self._away is not None else self._from(block)
            away = away * within  # 0 is the point itself
            arc[block] = away.max(axis=1) - away.min(axis=1)
        arc = np.where(self._counts, np.minimum(arc, 180.0), 0.0)
        phi_range = azimuth_on_sphere(arc, self._theta)
        return float(self._weights @ theta_range), float(self._weights @ phi_range)

    def _from(self, block: slice) -> FloatArray:
        """(k, n) degrees, -180 to 180, from the azimuths of a block to all that have one."""
        away = (self._phi - self._phi[block, None] + 180.0) % 360.0 - 180.0
        return np.where(self._counts, away, 0.0)


LINE_SETTINGS = ("directions", "half_lines", "least_pixels")

_KINDS: dict[str, Callable[[Sequence[Press], Mapping[str, Any]], RelitScore]] = {
    "rgb2normal": Rgb2NormalRelit,
    "normdiff": NormDiffRelit,
}


def has_quick_form(objective: Objective) -> bool:
    """Whether an objective can be made ready for presses whose light alone changes."""
    own = objective.function.__module__.startswith("optisense.objectives.")
    return own and objective.name in _KINDS


def quick_form(
    objective: Objective, settings: Mapping[str, Any], presses: Sequence[Press]
) -> RelitScore:
    """An objective made ready.

    Args:
        objective: one that has a quick form.
        settings: of its own, as far as they are not the usual ones.
        presses: whose light will change; cut or whole, as those that will be scored.

    Raises:
        ObjectiveError: a press can't be judged under any light.
    """
    return _KINDS[objective.name](presses, {**objective.settings, **settings})


def _some(settings: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    return {name: settings[name] for name in names}
