"""Light that indenters occlude, and beams that are culled because nothing occludes them."""

from __future__ import annotations

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest
from scipy import ndimage

from optisense import OpticalModel
from optisense.geometry import Contact, Sphere
from optisense.optics.imaging import cached, sampling
from optisense.optics.radiance_cache import beams
from optisense.optics.radiance_cache.angular_variance import occluder_horizon
from optisense.optics.radiance_cache.shading import FULL_EFFORT
from optisense.sensors import build

BALL = Contact(Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
SIZE = {"resolution": (160, 120), "photons": 200_000}


@pytest.fixture(scope="module")
def mini() -> OpticalModel:
    return OpticalModel(build("gelsight-mini-ideal"), "llvm")


def horizon(balls: list[tuple[float, ...]], own: bool = False) -> float:
    """The occluder_horizon seen from the origin, z being up."""
    rows = mi.Float([value for ball in balls for value in ball])
    sine = occluder_horizon(
        rows, mi.UInt32(len(balls)), mi.Point3f(0), mi.Vector3f(0, 0, 1), mi.Bool(own)
    )  # fmt: skip
    return float(sine[0])


@pytest.mark.parametrize("elevation", [-40.0, -10.0, 0.0, 25.0, 50.0])
def test_a_ball_hides_what_is_below_its_top(elevation: float) -> None:
    """The angle of its middle and, beside it, the one whose sine is radius over distance."""
    way = np.array([0.6 * np.cos(np.radians(elevation)), 0.8 * np.cos(np.radians(elevation)), 0])
    way[2] = np.sin(np.radians(elevation))
    top = np.sin(np.radians(elevation) + np.arcsin(1.5 / 4))
    assert horizon([(*(4 * way), 1.5)]) == pytest.approx(top, abs=1e-5)
    assert horizon([(0, 0, -9, 1), (*(4 * way), 1.5)]) == pytest.approx(top, abs=1e-5)


def test_a_ball_overhead_or_around_hides_all() -> None:
    assert horizon([(0.5, 0, 3, 1.5)]) == 1
    assert horizon([(0.5, 0, 0, 1.5)]) == 1


def test_a_convex_shape_hides_nothing_of_its_own() -> None:
    around, beside = (0.5, 0.0, -1.0, 1.5), (4.0, 0.0, 0.0, 1.5)
    assert horizon([around], own=True) == -1
    assert horizon([around, beside], own=True) == pytest.approx(1.5 / 4, abs=1e-5)
    # Which of two the point stands on can't be told from their balls.
    assert horizon([around, around], own=True) == 1


def test_diffuse_light_is_the_sum_of_its_beams(
    mini: OpticalModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    one_cell = replace(FULL_EFFORT, cells=1)  # the one that beams are read from
    monkeypatch.setattr(cached, "FULL_EFFORT", one_cell)
    by_vector = mini.render(**SIZE)
    (field,) = mini._store._done.values()
    field.roughness = 1.0  # without metal in the coating: every beam is gone through all the same
    try:
        one_by_one = mini.render(**SIZE)
    finally:
        field.roughness = None
    assert by_vector.radiance.max() > 0
    np.testing.assert_allclose(
        by_vector.radiance, one_by_one.radiance, atol=1e-3 * one_by_one.radiance.max()
    )


def test_an_untouched_picture_has_no_grain(mini: OpticalModel) -> None:
    """What the cells of the radiance cache differ by does not show from pixel to pixel."""
    picture = mini.render(**SIZE).radiance.sum(axis=2)
    around = ndimage.uniform_filter(picture, 3)
    off = (picture / around - 1)[2:-2, 2:-2]
    assert np.sqrt((off**2).mean()) < 0.01


@pytest.mark.parametrize("fov", [50.0, 61.3])
def test_no_camera_ray_slips_through_between_triangles(fov: float) -> None:
    """At these angles rays through the middle of a pixel meet the edges of triangles."""
    design = build("gelsight-mini-ideal")
    design.camera.fov = fov
    model = OpticalModel(design, "llvm")
    for contacts in ([], [BALL]):
        image = model.render(contacts, resolution=(320, 240), photons=20_000)
        assert image.radiance.sum(axis=2).min() > 0
        assert np.isfinite(image.points).all()


def test_beams_that_pass_no_indenter_hide_nothing(
    mini: OpticalModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shadow rays of all beams, and many more of them, show the same shadows."""
    near = mini.render([BALL], **SIZE, skin="conforming")
    monkeypatch.setattr(beams, "READ_DISTANCE", 1000.0)
    monkeypatch.setattr(cached, "FULL_EFFORT", replace(FULL_EFFORT, shadow_rays=500.0))
    every = mini.render([BALL], **SIZE, skin="conforming")
    untouched = mini.render(**SIZE).radiance
    shadowed = ~near.contact_mask & (every.radiance < 0.97 * untouched).any(axis=2)
    assert shadowed.sum() > 200
    assert near.radiance[shadowed].mean(axis=0) == pytest.approx(
        every.radiance[shadowed].mean(axis=0), rel=0.005
    )
    far = ~near.contact_mask & ~shadowed
    assert near.radiance[far].mean(axis=0) == pytest.approx(
        every.radiance[far].mean(axis=0), rel=0.001
    )


def test_shadows_on_the_skin_are_those_of_the_pixels_next_to_contacts(
    mini: OpticalModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beams hide what the direction bins hide that they were merged from; 4 to 5 % more if they
    were taken to be round.
    """
    size = {"resolution": (160, 120), "photons": 2_000_000, "skin": "conforming"}
    merged = mini.render([BALL], **size)
    monkeypatch.setattr(sampling, "RIM_WIDTH", 12.5 / 160)
    apart = mini.render([BALL], **size)
    away = ndimage.distance_transform_edt(~merged.contact_mask)
    rows, columns = np.indices(away.shape)
    rows, columns = (k - k[merged.contact_mask].mean() for k in (rows, columns))
    for beside in (rows > abs(columns), rows < -abs(columns), columns > abs(rows)):
        ring = (away > 4) & (away <= 12) & beside
        one, other = (image.radiance[ring].mean(axis=0) for image in (merged, apart))
        assert one == pytest.approx(other, rel=0.02)


def test_a_ball_does_not_shade_itself(mini: OpticalModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays that look whether it does find that it does not."""
    taken_for_granted = mini.render([BALL], **SIZE, skin="conforming")
    monkeypatch.setattr(Sphere, "convex", False)
    tested = mini.render([BALL], **SIZE, skin="conforming")
    mask = tested.contact_mask
    one, other = taken_for_granted.radiance[mask], tested.radiance[mask]
    assert one.mean(axis=0) == pytest.approx(other.mean(axis=0), rel=0.002)
    assert np.sqrt(((one - other) ** 2).mean()) < 0.02 * other.mean()
