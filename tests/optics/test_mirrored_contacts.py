"""Light that contacts reflect to metal coatings through the interfaces."""

import pytest

import optisense as ots
from optisense.mechanics import CONFORMING
from optisense.optics.radiance_cache import mirrored_contacts

RELATIVE = 0.01
"""Relative error of the mean radiance of a contact; all the light that it reflects through the
interfaces makes a difference of 4 %."""


def test_drawing_a_part_of_the_places_changes_no_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    design = ots.set_value(ots.load("gelsight-mini-ideal-cylindrical"), "coating.specularity", 1.0)
    model = ots.OpticalModel(design)
    ball = [ots.Contact(ots.Sphere(4.0), at=(0.5, 0.3), depth=0.8)]

    def mean_in_contact(most: int) -> float:
        monkeypatch.setattr(mirrored_contacts, "MOST_LANES", most)
        image = model.render(ball, resolution=(32, 24), photons=100_000, skin=CONFORMING)
        return float(image.radiance[image.contact_mask].mean())

    everywhere = mean_in_contact(10**9)  # about 13,000 places
    assert mean_in_contact(2000) == pytest.approx(everywhere, rel=RELATIVE)
