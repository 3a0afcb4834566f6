"""Metal coatings in a contact, patch by patch, against Mitsuba's path tracer."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.patches import RESOLUTION, PatchCase, Patches, means
from optisense import OpticalModel

PATH = json.loads((Path(__file__).parents[1] / "assets" / "metal-patches.json").read_text())
PHOTONS = 1_000_000
CONTACT = {0.6: 0.03, 1.0: 0.12}
"""RMS error over patches and channels, relative to each channel's mean; it is 1.1 and 1.5 % with
many photons. It is 5 and 40 % if metal reflects metal like paint."""
RIM = {0.6: 0.03, 1.0: 0.2}
"""The same for the row of pixels around the contact, where skin and flank mirror each other: 0.6
and 6 % with many photons. Without the lobes of the secondary hits, half of the light is missing at
a specularity of 1."""

RING = 0.04
"""Relative error of the green light of the skin around the contact; a twentieth of it comes from
the contact by reflection at the glass."""


@pytest.mark.parametrize("specularity", CONTACT)
def test_metal_in_a_contact_is_as_bright_as_path_traced(specularity: float) -> None:
    case = PatchCase("gelsight-mini-ideal", specularity)
    model = OpticalModel(case.design(), "llvm")
    image = model.render([case.contact(model)], RESOLUTION, PHOTONS, seed=1, skin="conforming")
    patches = Patches.of(image)
    for where, limits in (("contact", CONTACT), ("rim", RIM)):
        truth = np.array(PATH[where][f"{specularity:g}"])
        off = (means(image.radiance, getattr(patches, where)) - truth) / truth.mean(axis=0)
        assert np.sqrt((off**2).mean()) < limits[specularity]
    if specularity == 1.0:
        green = image.radiance[patches.skin >= 0].mean(axis=0)[1]
        assert green == pytest.approx(PATH["ring"]["1"][1], rel=RING)
