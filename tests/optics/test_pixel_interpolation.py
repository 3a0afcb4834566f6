"""Every second pixel shaded gives the picture of all of them."""

from __future__ import annotations

import numpy as np
import pytest
from comparing import same_light
from reference_scenes import rays_that_hit

from optisense import Contact, OpticalModel, Sphere, set_value
from optisense.optics.imaging import cached
from optisense.optics.imaging._pixel_interpolation import agreed, between_rays, fill
from optisense.sensors import build


@pytest.mark.parametrize("shape", [(8, 10), (9, 11), (7, 6)])
def test_a_linear_picture_is_filled_exactly(shape: tuple[int, int]) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    rays = rays_that_hit(np.stack([x, y, 0 * x], axis=-1))
    picture = np.stack([10 + 0.1 * x + 0.2 * y, 5 - 0.1 * x])[..., None].repeat(3, axis=-1)
    where = between_rays(rays, np.ones(shape, bool))
    # All but the even pixels, and those at the far borders that have none beyond them.
    inside = (y < 2 * ((shape[0] + 1) // 2) - 1) & (x < 2 * ((shape[1] + 1) // 2) - 1)
    np.testing.assert_array_equal(where, inside & ((x % 2 == 1) | (y % 2 == 1)))
    kept = np.where(where[..., None], np.float32(0), picture)
    np.testing.assert_array_equal(agreed(kept, where), where)
    fill(kept, where)
    np.testing.assert_allclose(kept, picture, rtol=1e-6)


def test_edges_of_what_is_seen_and_of_shadows_are_not_filled() -> None:
    y, x = np.mgrid[:20, :30].astype(np.float32)
    step = np.where(x > 12, 8.0, 0.0).astype(np.float32)
    rays = rays_that_hit(np.stack([x + step, y, step], axis=-1))
    rays.outcome[5:9] = 1
    where = between_rays(rays, np.ones(x.shape, bool))
    assert not where[:, 13].any()
    assert where[13, [11, 15]].all()
    assert not where[5:10].any()
    groups = np.ones((2, 20, 30, 3), np.float32)
    groups[1, :, 22:] = 0.4
    alike = agreed(groups, where)
    assert not alike[:, 21].any()
    assert alike[:, [11, 15, 19, 23]].any(axis=0).all()


def test_a_metal_coating_looks_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    design = set_value(build("gelsight-mini-ideal"), "coating.specularity", 0.5)
    model = OpticalModel(design, "llvm")
    ball = [Contact(Sphere(radius=2.0), at=(0.0, 0.0), depth=1.0)]
    size = {"resolution": (160, 120), "photons": 100_000, "skin": "conforming"}

    def skip_pixels_above(beams: float) -> None:
        for name in ("SPARSE_SHADING_BEAMS", "SPARSE_METALLIC_BEAMS"):
            monkeypatch.setattr(cached, name, beams)

    skip_pixels_above(np.inf)
    every = model.render(ball, **size)
    skip_pixels_above(0)
    second = model.render(ball, **size)
    skip_pixels_above(np.inf)
    noise = model.render(ball, seed=1, **size)
    mask = every.contact_mask
    assert same_light(second.radiance[mask], every.radiance[mask])
    light = [image.radiance.sum(axis=2) for image in (every, second, noise)]
    seen = ~mask & (light[0] > 0.2 * light[0].mean())
    off, by_photons = (np.abs(other[seen] / light[0][seen] - 1) for other in light[1:])
    assert (off > 0).mean() > 0.2  # many were filled
    assert light[1].mean() == pytest.approx(light[0].mean(), rel=2e-3)
    assert np.median(off) < 0.5 * np.median(by_photons)
    assert np.percentile(off, 99) < np.percentile(by_photons, 99)
