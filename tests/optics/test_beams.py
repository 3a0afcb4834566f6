"""Merged weak bins of the radiance cache give the same image as separate bins."""

from __future__ import annotations

import numpy as np
import pytest
from comparing import TURNED_BESIDE_CONTACT, same_light

from optisense import Contact, OpticalModel, Sphere, set_value
from optisense.optics.radiance_cache import beams
from optisense.optics.transport.photon_map import GROUP_MASK
from optisense.sensors import build

MEAN = 0.001
"""Relative error of each light group's mean over the picture."""
PER_PIXEL = 0.01
"""RMS error of pixels, relative to that mean."""


def test_merged_beams_give_the_picture_of_all_bins(monkeypatch: pytest.MonkeyPatch) -> None:
    """A coating that is part metal tells directions apart."""
    design = set_value(build("gelsight-mini-ideal"), "coating.specularity", 0.5)
    model = OpticalModel(design, "llvm")
    size = {"resolution": (80, 60), "photons": 100_000}
    merged = model.render(**size)
    count = len(field_of(model).beams.ways)
    monkeypatch.setattr(beams, "STRONG_SHARE", -1.0)
    model.forget_light()
    apart = model.render(**size)
    assert len(field_of(model).beams.ways) > 1.1 * count
    for group, layer in apart.layers.items():
        mean = layer.mean()
        assert merged.layers[group].mean() == pytest.approx(mean, rel=MEAN)
        seen = layer > 0
        off = (merged.layers[group] - layer)[seen]
        assert np.sqrt((off**2).mean()) < PER_PIXEL * layer[seen].mean()


def test_no_light_is_lost_in_merging(plain_mini: OpticalModel) -> None:
    model = plain_mini
    model.render(resolution=(16, 12), photons=100_000)
    field = field_of(model)
    # The entries of the surface come before those of the raised plane.
    size = field.binned.planes, field.binned.cells.cells, -1, field.binned.groups
    moments = np.asarray(field.binned.tables.moments).reshape(*size, 4)[0]
    starts = np.asarray(field.beams.starts)
    ways = np.asarray(field.beams.ways).reshape(-1, 4)
    fluxes = np.asarray(field.beams.fluxes).reshape(-1, 4)
    entry = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    groups = np.ascontiguousarray(fluxes[:, 3]).view(np.uint32) & GROUP_MASK
    np.testing.assert_array_equal(groups, entry % field.binned.groups)
    flux = np.bincount(entry, fluxes[:, 0], len(starts) - 1)
    np.testing.assert_allclose(flux, moments[..., 3].sum(axis=1).ravel(), rtol=1e-4)
    for k in range(3):
        vector = np.bincount(entry, fluxes[:, 0] * ways[:, k] * ways[:, 3], len(starts) - 1)
        np.testing.assert_allclose(
            vector, moments[..., k].sum(axis=1).ravel(), rtol=1e-3, atol=1e-4 * flux.max()
        )
    squares = np.asarray(field.binned.tables.heights).reshape(size)[0]
    along = np.bincount(entry, fluxes[:, 0] * np.asarray(field.beams.heights), len(starts) - 1)
    np.testing.assert_allclose(
        along, squares.sum(axis=1).ravel(), rtol=1e-3, atol=1e-4 * flux.max()
    )


def test_one_more_beam_leaves_the_shadow_rays_of_the_others_as_they_are(
    plain_mini: OpticalModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rounding decides of some beams whether they pass near an indenter."""
    beside = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
    images = []
    for reach in (beams.READ_DISTANCE, beams.READ_DISTANCE + 1e-3):
        monkeypatch.setattr(beams, "READ_DISTANCE", reach)
        images.append(plain_mini.render([beside], resolution=(80, 60), photons=200_000).layers)
    for group, layer in images[0].items():
        assert same_light(images[1][group], layer, TURNED_BESIDE_CONTACT)


def field_of(model: OpticalModel):  # type: ignore[no-untyped-def]
    """The one radiance cache that a model keeps."""
    (field,) = model._store._done.values()
    return field


@pytest.mark.parametrize(("specularity", "widened"), [(0.8, False), (1.0, True)])
def test_only_narrow_lobes_see_beams_of_single_photons_widened(
    specularity: float, widened: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = OpticalModel(
        set_value(build("gelsight-mini-ideal"), "coating.specularity", specularity)
    )
    size = {"resolution": (32, 24), "photons": 50_000}
    usual = model.render(**size).radiance
    monkeypatch.setattr(beams, "SPARSE_SHARE", 0.0)
    model.forget_light()
    measured = model.render(**size).radiance
    assert np.allclose(usual, measured, rtol=1e-4, atol=0) != widened
