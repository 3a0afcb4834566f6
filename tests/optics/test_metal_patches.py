"""Metal coatings in a contact, patch by patch, against Mitsuba's path tracer."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.light_tracing import light_traced
from benchmarks.patches import RESOLUTION, PatchCase, Patches, means
from benchmarks.reference import window_camera
from optisense import Contact, OpticalModel
from optisense.optics import TactileImage
from optisense.optics.imaging import _traced_light
from optisense.optics.imaging._film import box_around

PATH = json.loads((Path(__file__).parents[1] / "assets" / "metal-patches.json").read_text())
PHOTONS = 1_000_000
"""Number of photons of an image."""
RAYS = {
    "CONTACT_RAYS": 1.0, "NEAR_RAYS": 0.3, "BESIDE_RAYS": 0.4, "SKIN_RAYS": 0.02,
    "MOST_RAYS": 250_000,
}  # fmt: skip
"""Rays of narrow lobes for each photon: many from the skin around the contact, whose light is then
known to 1 %, and few from elsewhere. Those of the contact are traced in four passes."""
CONTACT = {0.6: 0.03, 1.0: 0.12}
"""RMS error over patches and channels, relative to each channel's mean; it is 1.1 and at most 1 %
with many photons. It is 5 and 40 % if metal reflects metal like paint."""
RIM = {0.6: 0.03, 1.0: 0.2}
"""The same for the row of pixels around the contact, where skin and flank mirror each other: below
1 % with many photons. Without the lobes of the secondary hits, half of the light is missing at
a specularity of 1."""

RING = 0.04
"""Relative error of the green light of the skin around the contact; a twentieth of it comes from
the contact by reflection at the glass."""

FEW_PHOTONS = 300_000
"""Photons of an image of GelBelt, whose skin beside a contact is then known to 7 %."""
BELT_RAYS = {"CONTACT_RAYS": 0.05, "SKIN_RAYS": 0.02}
"""Rays of narrow lobes for each photon where this image needs fewer than usual."""
BESIDE = 0.2
"""Relative error of the light of this skin in front of the flanks that face the lamps. Two fifths
of it are missing if the flanks that the skin mirrors get no light from the skin below them.
"""

TRACED = {"contact": 0.03, "rim": 0.12}
"""Relative error of the mean of each channel by light tracing with two million photons, three times
the noise. With 32 million photons it is given in benchmarks/patches.md."""


@cache
def pressed_mini(specularity: float) -> tuple[OpticalModel, Contact, TactileImage]:
    """The model of a GelSight Mini, what is pressed into it, and its image."""
    case = PatchCase("gelsight-mini-ideal", specularity)
    model = OpticalModel(case.design(), "llvm")
    contact = case.contact(model)
    with pytest.MonkeyPatch.context() as patch:
        for name, number in RAYS.items():
            patch.setattr(_traced_light, name, number)
        image = model.render([contact], RESOLUTION, PHOTONS, seed=1, skin="conforming")
    return model, contact, image


@pytest.mark.parametrize("specularity", CONTACT)
def test_metal_in_a_contact_is_as_bright_as_path_traced(specularity: float) -> None:
    image = pressed_mini(specularity)[2]
    patches = Patches.of(image)
    for where, limits in (("contact", CONTACT), ("rim", RIM)):
        truth = np.array(PATH[where][f"{specularity:g}"])
        off = (means(image.radiance, getattr(patches, where)) - truth) / truth.mean(axis=0)
        assert np.sqrt((off**2).mean()) < limits[specularity]
    if specularity == 1.0:
        green = image.radiance[patches.skin >= 0].mean(axis=0)[1]
        assert green == pytest.approx(PATH["ring"]["1"][1], rel=RING)


def test_pixels_of_a_metal_contact_are_hardly_noisier_than_its_photons() -> None:
    """At a specularity of 0.6: 1.2 % are of camera samples and their rays, 2.3 % of photons."""
    model, contact, one = pressed_mini(0.6)
    other = model.render(
        [contact], RESOLUTION, PHOTONS, seed=2, skin="conforming", only_contacts=True
    )
    mask = one.contact_mask
    off = (one.radiance - other.radiance)[mask] / np.sqrt(2)
    assert np.sqrt((off**2).mean()) < 0.04 * one.radiance[mask].mean()


def test_skin_mirrors_the_flanks_that_face_low_lamps(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, number in BELT_RAYS.items():
        monkeypatch.setattr(_traced_light, name, number)
    case = PatchCase("gelbelt", 1.0)
    model = OpticalModel(case.design(), "llvm")
    image = model.render(
        [case.contact(model)], case.resolution, FEW_PHOTONS, seed=1, skin="conforming"
    )
    skin = Patches.of(image).skin
    beside = ndimage.distance_transform_edt(~image.contact_mask) <= 4
    upper, lower = (image.radiance[beside & (skin == quarter)].mean(axis=0) for quarter in (2, 0))
    ratios = [upper[0] / PATH["beside"][0], lower[2] / PATH["beside"][1]]
    assert np.mean(ratios) == pytest.approx(1.0, abs=BESIDE)


def test_light_tracing_finds_the_light_of_the_path_tracer() -> None:
    model, contact, image = pressed_mini(0.6)
    patches = Patches.of(image)
    window = box_around(image.contact_mask, margin=2)
    camera = window_camera(model.camera(RESOLUTION), window)
    scene = model.scenes.touched([contact], [model.place(contact)]).full
    traced = np.zeros(image.radiance.shape)
    traced[window] = light_traced(model, scene, camera, PHOTONS, passes=2)(seed=1)
    for where, limit in TRACED.items():
        truth = np.array(PATH[where]["0.6"]).mean(axis=0)
        found = means(traced, getattr(patches, where)).mean(axis=0)
        assert found == pytest.approx(truth, rel=limit)
