"""Paths of typical photons end as in the light ledger and follow the light."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import optisense as ots
from optisense.design.materials import Dielectric
from optisense.optics import OpticalModel, light_ledger
from optisense.optics.ledger import SEEN
from optisense.optics.light_paths import PhotonPath, photon_paths

PHOTONS = 3000

DEVIATIONS = 4.5
"""Standard deviations of a count by which it may be off: among 100 counts one in a thousand runs
would exceed this."""


def absorbing() -> ots.SensorDesign:
    design = ots.load("gelsight-mini-ideal")
    design.materials["acrylic"] = Dielectric(ior=1.491, absorption=(0.02, 0.02, 0.02))
    design.materials["silicone-xp565"] = Dielectric(ior=1.41, absorption=(0.05, 0.02, 0.05))
    return design


def dispersive() -> ots.SensorDesign:
    design = ots.load("gelsight-mini-ideal")
    design.dispersion = True
    design.materials["acrylic"] = Dielectric(ior=1.49, dispersion=(1.48, 1.49, 1.50))
    return design


def design_of(name: str) -> ots.SensorDesign:
    made = {"absorbing": absorbing, "dispersive": dispersive}
    return made[name]() if name in made else ots.load(name)


@pytest.mark.parametrize(
    "name",
    ["gelsight-svelte", "absorbing", "dispersive"],
)
def test_photons_end_as_the_ledger_says(name: str) -> None:
    model = OpticalModel(design_of(name))
    ledger = light_ledger(model, 60_000)
    found = photon_paths(model, PHOTONS)
    noise = {(entry.group, entry.where): entry.noise for entry in ledger.entries}
    assert list(found) == list(ledger.emitted)
    for group, paths in found.items():
        counts = Counter(path.where for path in paths)
        assert sum(counts.values()) == PHOTONS
        assert set(counts) <= set(ledger.places())
        for where in ledger.places():
            share = ledger.share(group, where)
            spread = np.sqrt(share * (1 - share) / PHOTONS + noise.get((group, where), 0.0) ** 2)
            allowed = DEVIATIONS * spread + 1.5 / PHOTONS  # and what counts of a few scatter
            assert counts[where] / PHOTONS == pytest.approx(share, abs=allowed), (group, where)


@pytest.fixture(scope="module")
def mini(plain_mini: OpticalModel) -> dict[str, list[PhotonPath]]:
    return photon_paths(plain_mini)


def test_a_way_leads_from_a_light_to_where_it_ends(mini: dict[str, list[PhotonPath]]) -> None:
    design = ots.load("gelsight-mini-ideal")
    for group, paths in mini.items():
        lights = np.array([light.position for light in design.lights[group].lights])
        starts = np.array([path.points[0] for path in paths])
        distances = np.linalg.norm(starts[:, None] - lights, axis=2)
        assert distances.min(axis=1).max() < 2.0  # on an emitting window of 2.4 mm
        assert len(set(distances.argmin(axis=1))) == len(lights)
        for path in paths:
            assert len(path.points) >= 2
            if path.where == SEEN:
                assert path.points[-1][2] == pytest.approx(0.0, abs=1e-3)  # a flat Mini's skin


def test_other_seeds_give_other_photons(mini: dict[str, list[PhotonPath]]) -> None:
    model = OpticalModel(ots.load("gelsight-mini-ideal"))
    again, other = photon_paths(model), photon_paths(model, seed=1)
    for one, two, three in zip(mini["red"], again["red"], other["red"], strict=True):
        assert np.array_equal(one.points, two.points)
        assert not np.array_equal(one.points[:2], three.points[:2])


def test_a_dark_group_has_no_photons() -> None:
    model = OpticalModel(ots.set_value(ots.load("gelsight-mini-ideal"), "lights.red.flux", 0.0))
    found = photon_paths(model)
    assert found["red"] == [] and len(found["green"]) == 100
