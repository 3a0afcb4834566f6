"""The paths of typical photons of each light group, and where each ends, for drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.optics.ledger import GIVEN_UP, cells_in_view, places_of
from optisense.optics.transport.photon_paths import TracedPhotons, trace_photon_paths

if TYPE_CHECKING:
    from optisense.optics.model import OpticalModel
    from optisense.optics.transport.photons import TargetCells

TYPICAL = 100
"""Photons of a group that are drawn: the eye still tells them apart, and a place that takes a
hundredth of the light is likely to get one."""

CANDIDATES = 4
"""Photons traced for each one that is drawn. Where indices differ between channels a photon is
light of one channel, and those of the channels that a group emits are drawn."""


@dataclass(frozen=True)
class PhotonPath:
    """The path of one photon.

    Attributes:
        group: the light group.
        where: where it ends, in the words of the light ledger.
        points: (n, 3) float32, mm: the light, the surfaces that the photon meets, and its end. That
            of a photon that escapes is a little outside the sensor.
    """

    group: str
    where: str
    points: NDArray[np.float32]


def photon_paths(
    model: OpticalModel,
    per_group: int = TYPICAL,
    seed: int = 0,
    seen: TargetCells | None = None,
) -> dict[str, list[PhotonPath]]:
    """Paths of photons, drawn in proportion to power; each stands for an equal share of it.

    No contact presses. The number of a group's photons that end at a place is, up to the noise of
    so few, the share that the light ledger has there.

    Args:
        model: the sensor.
        per_group: photons of each light group.
        seed: another one gives other photons.
        seen: `cells_in_view` of the model, if they are known.

    Returns:
        For each light group its photons; none where it is dark.
    """
    lights = model.design.lights
    fewest = min((len(group.lights) for group in lights.values() if group.lights), default=1)
    traced = trace_photon_paths(
        model.scene,
        model.scenes.emitter_table,
        np.array([group.channel_flux() for group in lights.values()]),
        cells_in_view(model) if seen is None else seen,
        CANDIDATES * math.ceil(per_group / fewest),
        seed,
    )
    words = {(p.surface, int(p.fate)): p.where for p in places_of(model.scenes.pieces)}
    rng = np.random.default_rng(seed)
    found = {}
    for number, name in enumerate(lights):
        # In no order: every fourth photon of a low-discrepancy sequence leaves in a part only of
        # all directions.
        own = rng.permutation(np.flatnonzero(traced.group == number))
        chosen = own[_in_proportion(traced.power[own], per_group, rng)]
        found[name] = [_path(traced, index, name, words) for index in chosen]
    return found


def _path(
    traced: TracedPhotons, index: int, group: str, words: dict[tuple[int, int], str]
) -> PhotonPath:
    where = words.get((int(traced.surface[index]), int(traced.fate[index])), GIVEN_UP)
    return PhotonPath(group, where, traced.points[index, : traced.counts[index]])


def _in_proportion(
    power: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Indices drawn with a probability in proportion to power, by systematic sampling."""
    total = power.sum()
    if total <= 0.0:
        return np.empty(0, dtype=np.int64)
    steps = (np.arange(count) + rng.random()) / count * total
    return np.minimum(np.searchsorted(np.cumsum(power), steps), len(power) - 1)
