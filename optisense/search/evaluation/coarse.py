"""Settings of coarse scores, which a search can use to find the promising trials.

A coarse score is biased, but ranks designs nearly as the full one does (docs/search.md), so it
suffices to tell which trials are worth a full score.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from optisense.design import SensorDesign
from optisense.objectives.settings import Settings, size_for
from optisense.quality import PHOTONS, SCORE_PHOTONS, photons_of

PHOTON_SHARE = 1 / 8
"""Share of the photons of a full score. Fewer save hardly any time, because a trial also builds
its scene and smooths its light (GelBelt: 2.6 s of processor time with 250,000 and with 125,000
photons, 10 s in full)."""

LEAST_PHOTONS = PHOTONS["draft"]
"""Smallest number of photons, unless the full score has fewer: the light of a draft."""

LEAST_ACROSS = 320
"""Smallest width of the images, in pixels, unless the full score has less. At 160 the contacts of
the built-in sensors have fewer pixels than `reading` and RGB2Normal need."""


def coarse_settings(design: SensorDesign, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of coarse scores: half as many pixels across, an eighth of the photons,
    and all presses in one image, where contacts do not overlap.

    Rays of the camera are not changed: they cost little beside images, and conditions on coverage
    and distortion are then as exact as in a full score.

    Args:
        design: design that the search starts from.
        settings: settings of full scores.
    """
    names = ("resolution", "photons")
    full = Settings(**{name: settings[name] for name in names if name in settings})
    width, height = full.resolution or size_for(design.camera.resolution)
    across = max(width // 2, min(width, LEAST_ACROSS))
    photons = photons_of(SCORE_PHOTONS if full.photons is None else full.photons)
    fewer = max(round(photons * PHOTON_SHARE), min(photons, LEAST_PHOTONS))
    return {
        **settings,
        "resolution": [across, max(1, round(across * height / width))],
        "photons": fewer,
        "together": True,
    }
