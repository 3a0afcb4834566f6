"""Detection of noisy pixels, and their noise after more samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from optisense import Contact, OpticalModel, Plane, Sphere
from optisense.optics.imaging import cached
from optisense.optics.imaging.sampling import grainy
from optisense.sensors import build

FINE = 8
"""Number of rays across a pixel by which shares of pixels are known."""


def test_noise_is_grainy_and_slopes_edges_of_the_mask_and_darkness_are_not() -> None:
    random = np.random.default_rng(0)
    y, x = np.mgrid[:60, :80]
    image = 1.0 + 0.01 * x + 0.02 * y
    image[10:30, 10:30] *= 1 + 0.05 * random.normal(size=(20, 20))
    image[:, 60:] = 0.005 * random.random((60, 20))
    where = (x < 75) & (y > 2)
    found = grainy(image.astype(np.float32), where)
    assert found[14:26, 14:26].all()
    assert not found[36:, :50].any()
    assert not found[:, 66:].any()
    assert not grainy(image.astype(np.float32), np.zeros_like(where)).any()


def test_a_contact_may_fill_the_picture(plain_mini: OpticalModel) -> None:
    plate = Contact(Plane(size=60.0), at=(0.0, 0.0), depth=0.5)
    image = plain_mini.render([plate], (32, 24), photons=100_000, skin="conforming")
    assert image.contact_mask.all()
    assert (image.radiance.sum(axis=2) > 0).all()


def test_a_contact_out_of_view_bends_the_skin_in_view() -> None:
    """Its skin is sampled thoroughly, the rest of the image as usual, and no pixel sees it."""
    design = build("gelsight-mini")
    design.camera.fov = 25.0
    model = OpticalModel(design, "llvm")
    ball = Contact(Sphere(radius=1.5), at=(5.5, 0.0), depth=0.5)
    size = {"resolution": (80, 60), "photons": 100_000}
    image, untouched = model.render([ball], **size), model.render([], **size)
    assert not image.contact_mask.any()
    change = np.abs(image.radiance - untouched.radiance).sum(axis=(0, 2))
    right = change[60:].sum()
    assert right > 5 * change[:20].sum()
    assert not model.render([ball], **size, only_contacts=True).radiance.any()


def test_an_untouched_gel_has_less_grain_than_one_camera_sample_a_pixel_would_show(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With metal in the coating: diffuse light has no grain (see test_beam_sums.py)."""
    design = build("gelsight-mini-ideal")
    design.coating.specularity = 0.5
    model = OpticalModel(design, "llvm")

    def grain() -> float:
        image = model.render(resolution=(160, 120), photons=100_000).radiance.sum(axis=2)
        return float(np.abs(np.diff(image, n=2, axis=1)).mean() / image.mean())

    often = grain()
    monkeypatch.setattr(cached, "grainy", lambda image, where: np.zeros_like(where))
    once = grain()
    assert often < 0.9 * once  # the rest is noise of photons


def test_the_skin_beside_a_contact_has_the_light_that_the_contact_reflects_to_it(
    plain_mini: OpticalModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    ball = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
    ring = np.zeros((120, 160), dtype=bool)

    def light() -> float:
        image = plain_mini.render([ball], (160, 120), 100_000, skin="conforming")
        if not ring.any():
            away = ndimage.distance_transform_edt(~image.contact_mask)
            ring[(away > 4.5) & (away <= 12)] = True
        return float(image.radiance[ring].mean())

    usual = light()
    monkeypatch.setattr(cached, "BESIDE_RANGE", 0.0)
    # A ball that rises 0.8 mm over skin 1 mm away fills about 1 % of its cosine-weighted view.
    assert 1.002 < usual / light() < 1.01


def outline_error(light: np.ndarray, seen: np.ndarray) -> float:
    """Return the RMS deviation of the light (h, w) of the pixels at the outline of an area,
    relative to that of the nearest pixel inside, from the share of the area in them; ``seen`` is
    the mask (FINE h, FINE w) of the area.
    """
    height, width = light.shape
    share = seen.reshape(height, FINE, width, FINE).mean(axis=(1, 3))
    inside = share == 1.0
    edge = ~inside & (share > 0.0)
    assert edge.sum() > 100
    nearest = ndimage.distance_transform_edt(~inside, return_distances=False, return_indices=True)
    shown = light[edge] / light[*nearest[:, edge]]
    return float(np.sqrt(np.mean((shown - share[edge]) ** 2)))


@pytest.fixture(scope="module")
def svelte() -> OpticalModel:
    return OpticalModel(build("gelsight-svelte"))


def test_the_outline_of_the_skin_is_smooth(svelte: OpticalModel) -> None:
    """Pixels at the edge of GelSight Svelte's mirror are as bright as the share of skin in them."""
    light = svelte.render([], (80, 60), 60_000).radiance.sum(axis=-1)
    # If each pixel showed what its middle sees, the error would be 0.3.
    assert outline_error(light, svelte.chief_rays((80 * FINE, 60 * FINE)).hit) < 0.2


def test_the_outlines_of_lamps_in_view_are_smooth() -> None:
    """A camera beside the glass of GelSight Mini sees LEDs through it."""
    design = build("gelsight-mini-ideal")
    design.camera.position, design.camera.direction = (0.0, -6.0, -9.0), (0.0, 1.0, 0.35)
    design.camera.up = (0.0, 0.0, 1.0)
    model = OpticalModel(design)
    light = model.render([], (80, 60), 60_000).radiance.sum(axis=-1)
    # If each pixel showed what its middle sees, the error would be 0.26.
    assert outline_error(light, model.chief_rays((80 * FINE, 60 * FINE)).lamp > 0) < 0.15


def test_a_picture_may_consist_of_outlines(svelte: OpticalModel) -> None:
    light = svelte.render([], (3, 2), 60_000).radiance.sum(axis=-1)
    assert (light[svelte.chief_rays((3, 2)).hit] > 0).all()
