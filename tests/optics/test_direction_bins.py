"""Which direction bins a sensor gets."""

from __future__ import annotations

import pytest

import optisense as ots
from optisense.optics import OpticalModel
from optisense.optics.drafts import DraftModel
from optisense.optics.radiance_cache._direction_bins import (
    COARSE_BINS,
    CURVED_BINS,
    FINE_BINS,
    FINEST_BINS,
    DirectionBins,
)


def test_narrower_lobes_get_finer_bins_and_curved_skins_corrected_ones() -> None:
    assert DirectionBins.for_coating(None) is COARSE_BINS
    assert DirectionBins.for_coating(0.7) is COARSE_BINS
    assert DirectionBins.for_coating(None, curved=True) is CURVED_BINS
    assert DirectionBins.for_coating(0.7, curved=True) is CURVED_BINS
    for curved in (False, True):
        assert DirectionBins.for_coating(0.4, curved) is FINE_BINS
        assert DirectionBins.for_coating(0.05, curved) is FINEST_BINS
    assert DirectionBins.for_coating(0.4, raised_plane=True) is COARSE_BINS
    assert DirectionBins.for_coating(0.3, raised_plane=True) is FINE_BINS
    assert CURVED_BINS.corrected and not CURVED_BINS.fine and FINE_BINS.fine


@pytest.mark.parametrize(
    ("sensor", "bins"),
    [
        ("gelsight-mini-ideal", COARSE_BINS),
        ("gelsight-mini-ideal-spherical", CURVED_BINS),
        ("gelbelt", COARSE_BINS),  # curved, but its light grazes
    ],
)
def test_sensors_get_the_bins_of_their_shape(sensor: str, bins: DirectionBins) -> None:
    assert OpticalModel(ots.load(sensor))._store._directions == bins


def test_drafts_of_curved_skins_keep_the_coarse_bins() -> None:
    assert DraftModel(ots.load("gelsight-mini-ideal-spherical"))._store._directions == COARSE_BINS
