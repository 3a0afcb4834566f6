"""The paths of typical photons of each light group and their ends, for drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.optics.ledger import cells_in_view, places_of
from optisense.optics.transport.interact import MAX_DEPTH
from optisense.optics.transport.photon_paths import TracedPhotons, trace_photon_paths

if TYPE_CHECKING:
    from optisense.optics._model import OpticalModel
    from optisense.optics.transport.photons import TargetCells

TYPICAL = 100
"""Number of photons of a group that are drawn: few enough to be distinguished by eye, and enough
that a place that takes a hundredth of the light is likely to get one."""

CANDIDATES = 4
"""Number of photons traced for each one that is drawn. If refractive indices differ between
channels, a photon carries light of one channel, and only photons of the channels that a group emits
are drawn."""

CUT_OFF = f"not followed beyond {MAX_DEPTH} surfaces"


@dataclass(frozen=True)
class PhotonPath:
    """The path of one photon.

    Attributes:
        group: the light group.
        where: the place where it ends, named as in the light ledger, or `CUT_OFF`.
        points: (n, 3) float32, points (mm) on the light and on the surfaces that the photon meets,
            and its end. The end of a photon that escapes lies a little outside the sensor.
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
    """Return paths of photons in the untouched sensor, each of which stands for an equal share of
    its group's power.

    The number of a group's photons that end at a place is proportional to the share in the light
    ledger, up to the noise of so few photons.

    Args:
        per_group: number of photons of each light group.
        seen: result of `cells_in_view` for the model, if it is known.

    Returns:
        The photons of each light group; an empty list for a group that is off.
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
    words = {(p.surface, int(p.fate)): p.where for p in places_of(model.scenes.assembly)}
    rng = np.random.default_rng(seed)
    found = {}
    for number, name in enumerate(lights):
        # The order is random, as every fourth photon of a low-discrepancy sequence covers only a
        # part of all directions.
        own = rng.permutation(np.flatnonzero(traced.group == number))
        chosen = own[_in_proportion(traced.power[own], per_group, rng)]
        found[name] = [_path(traced, index, name, words) for index in chosen]
    return found


def _path(
    traced: TracedPhotons, index: int, group: str, words: dict[tuple[int, int], str]
) -> PhotonPath:
    where = words.get((int(traced.surface[index]), int(traced.fate[index])), CUT_OFF)
    return PhotonPath(group, where, traced.points[index, : traced.counts[index]])


def _in_proportion(
    power: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Draw indices with probabilities in proportion to power, by systematic sampling."""
    total = power.sum()
    if total <= 0.0:
        return np.empty(0, dtype=np.int64)
    steps = (np.arange(count) + rng.random()) / count * total
    return np.minimum(np.searchsorted(np.cumsum(power), steps), len(power) - 1)
