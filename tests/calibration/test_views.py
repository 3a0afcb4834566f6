"""Derivatives by the camera's view follow from chief rays, and a fit finds a hidden view."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

import optisense as ots
from optisense.calibration import photograph_model
from optisense.calibration._covered_view import CoveredView, with_smooth_outline
from optisense.calibration._fit_rounds import FitRounds
from optisense.calibration._view_slopes import displacements, view_changes
from optisense.calibration.model_pictures import LayeredPictures
from optisense.calibration.quantities import designed, quantities_of
from optisense.calibration.seen_contacts import SeenContact
from optisense.calibration.settings import CalibrationSettings
from optisense.design.posing import with_camera_turned
from optisense.kept_arrays import NOTHING_KEPT

from .conftest import BALLS, PHOTONS, SIZE, SMALL, numbers_of_fit

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

HIDDEN = (0.06, 0.3, -0.2)
"""Logarithm of the factor on the field of view of the photographed sensor, and place of its camera
to the picture's right and top, mm."""


def seen_from(change: tuple[float, float, float]) -> ots.OpticalModel:
    """A model of GelSight Mini with another view."""
    design = ots.load("gelsight-mini-ideal")
    chosen = quantities_of(design, ["view", "place"])
    steps = np.array([off / each.plausible_range for off, each in zip(change, chosen, strict=True)])
    return ots.OpticalModel(designed(design, chosen, steps))


def test_a_camera_that_moves_sees_a_flat_skin_displaced_everywhere_alike(
    mini: OpticalModel,
) -> None:
    before = mini.chief_rays(SIZE)
    pixel = float(np.linalg.norm(before.points[60, 81] - before.points[60, 80]))
    columns, rows = displacements(before, seen_from((0.0, 0.3, 0.0)).chief_rays(SIZE))
    assert columns == pytest.approx(np.full(SIZE[::-1], 0.3 / pixel), rel=0.08)
    assert np.abs(rows).max() < 0.1
    columns, rows = displacements(before, seen_from((0.0, 0.0, 0.3)).chief_rays(SIZE))
    assert np.abs(columns).max() < 0.1
    assert rows == pytest.approx(np.full(SIZE[::-1], -0.3 / pixel), rel=0.08)


def test_turns_of_the_camera_turn_its_picture(mini: OpticalModel) -> None:
    """A roll displaces points at right angles to their distance from the middle."""
    before = mini.chief_rays(SIZE)
    design = mini.design
    rolled = ots.OpticalModel(with_camera_turned(2, design, 1.0)).chief_rays(SIZE)
    columns, rows = displacements(before, rolled)
    down, across = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    angle = np.radians(1.0)
    assert columns == pytest.approx(-angle * (down - 60.0), abs=0.1)
    assert rows == pytest.approx(angle * (across - 80.0), abs=0.1)
    pitched = with_camera_turned(0, design, 1.0)
    assert pitched.camera.axes()[2] @ design.camera.axes()[1] == pytest.approx(np.sin(angle))
    _, rows = displacements(before, ots.OpticalModel(pitched).chief_rays(SIZE))
    assert rows.max() < -1.0  # what is seen now was nearer to the top


def test_distortion_moves_the_corners_of_a_picture_and_not_its_middle(mini: OpticalModel) -> None:
    (k1,) = quantities_of(mini.design, ["distortion"])
    made = designed(mini.design, [k1], np.array([1.0]))
    assert made.camera.distortion is not None
    columns, rows = displacements(mini.chief_rays(SIZE), ots.OpticalModel(made).chief_rays(SIZE))
    away = np.hypot(columns, rows)
    assert away[60, 80] < 0.05
    # x (1 + 0.1 r^2) = x' has x' - x = 0.1 r^2 x to first order, r = tan of the corner's angle
    reach = np.tan(np.radians(0.5 * mini.design.camera.fov)) * np.hypot(80.0, 60.0) / 80.0
    assert away[0, 0] == pytest.approx(0.1 * reach**2 * 100.0, rel=0.35)


def test_responses_grow_with_the_skin_that_a_pixel_sees(mini: OpticalModel) -> None:
    before, after = (CoveredView.of(each, SIZE) for each in (mini, seen_from((0.06, 0.0, 0.0))))
    ground = np.ones((1, SIZE[1], SIZE[0], 3), np.float32)
    layers = LayeredPictures(("white",), (ground, ground + 0.5), mini.picture_chain, ())
    found = view_changes(layers, [SeenContact((80.0, 60.0), 10.0)], before, after)
    assert np.abs(found[0]).max() < 1e-6  # an even background looks the same from anywhere
    wider = np.ptp(after.rays.points[60, :, 0]) / np.ptp(before.rays.points[60, :, 0])
    assert found[1] == pytest.approx(np.full_like(ground, 0.5 * (wider - 1.0)), rel=0.1)


def test_a_displacement_does_not_average_the_noise_of_layers(mini: OpticalModel) -> None:
    """Otherwise a fit prefers a view that is off by half a pixel, because its noise is smaller."""
    pixel = np.ptp(mini.chief_rays(SIZE).points[60, :, 0]) / (SIZE[0] - 1)
    before, after = (
        CoveredView.of(each, SIZE) for each in (mini, seen_from((0.0, 0.5 * pixel, 0.0)))
    )
    slope = 3.0 * np.tile(np.arange(SIZE[0], dtype=np.float32), (SIZE[1], 1))
    noise = np.random.default_rng(5).standard_normal(slope.shape).astype(np.float32)
    chain = mini.picture_chain
    changes = []
    for picture in (slope, slope + noise):
        ground = np.repeat(picture[None, ..., None], 3, axis=-1)
        changes += view_changes(
            LayeredPictures(("white",), (ground,), chain, ()), [], before, after
        )
    clean, noisy = (change[0, ..., 0] for change in changes)
    assert clean[:, 20:-20].mean() == pytest.approx(1.5, rel=0.1)
    # A displacement by half a pixel would halve the variance.
    assert np.var(noise + noisy - clean) == pytest.approx(np.var(noise), rel=0.02)


def test_a_hidden_view_is_found() -> None:
    real = seen_from(HIDDEN)
    photographs = photograph_model(
        real, BALLS, resolution=SMALL, photons=PHOTONS, seed=7, noise=1.0
    )
    settings = CalibrationSettings(families=("powers", "view", "place"), rounds=1, photons=PHOTONS)
    design = ots.load("gelsight-mini-ideal")
    found = numbers_of_fit(design, photographs, quantities_of(design, settings.families), settings)
    field, right, up = found[-3:]
    # One round stops short of it, by 0.004 to 0.03 with other photographs and photons.
    assert np.log(field.after / field.before) == pytest.approx(HIDDEN[0], abs=0.02)
    assert right.after == pytest.approx(HIDDEN[1], abs=0.12)
    assert up.after == pytest.approx(HIDDEN[2], abs=0.12)
    assert all(each.determined for each in found)


def test_the_outline_of_the_skin_moves_by_fractions_of_a_pixel() -> None:
    """Rendered pixels are skin or not; averages of finer ones change with any displacement."""
    design = ots.load("gelsight-svelte")
    x, y, z = design.camera.position
    moved = ots.set_value(design, "camera.position", [x, y + 0.1, z])
    before, after = (CoveredView.of(ots.OpticalModel(each), SIZE) for each in (design, moved))
    white, seen = (view.rays.hit[None, ..., None].astype(np.float32) for view in (before, after))
    assert set(np.unique(white)) == {0.0, 1.0}
    smooth = with_smooth_outline(np.repeat(white, 3, axis=-1), before.coverage)
    assert smooth[0, ..., 0] == pytest.approx(before.coverage, abs=1e-6)
    layers = LayeredPictures(("white",), (smooth,), ots.OpticalModel(design).picture_chain, ())
    (change,) = view_changes(layers, [], before, after)
    outline = (before.coverage > 0.0) & (before.coverage < 1.0)
    shown = np.abs(change[0, ..., 0][outline]) > 0.01
    flipped = (white != seen)[0, ..., 0][outline]
    assert shown.mean() > 2.0 * flipped.mean() > 0.0
    assert change[0, ..., 0] == pytest.approx(after.coverage - before.coverage, abs=1e-6)


def test_a_fisheye_whose_view_is_far_from_the_start_is_found() -> None:
    """Details of the round sensor's picture are smaller than the displacement at its edge, so that
    only blurred pictures lead to the view.
    """
    design, hidden, size = ots.load("gelsight360"), 118.0, (120, 90)
    # Three of its nine light groups, as many as most sensors have, light all sides.
    design.lights = {name: design.lights[name] for name in ("lg1", "lg4", "lg7")}
    model = ots.OpticalModel(ots.set_value(design, "camera.fov", hidden))
    points = model.chief_rays(size).points
    row, column = 45, 45
    point = tuple(points[row, column].astype(float).tolist())
    ball = ots.Contact(ots.Sphere(3.0), point=point, depth=0.6)
    taken = photograph_model(model, [ball], resolution=size, photons=PHOTONS, seed=7, noise=1.0)
    place = SeenContact((column + 0.5, row + 0.5), 2.3)
    labelled = [replace(taken.presses[0], centre=place.centre, radius=place.radius)]
    chosen = quantities_of(design, ["view"])
    settings = CalibrationSettings(families=("view",), rounds=1, refine=False, photons=PHOTONS)
    rounds = FitRounds(
        design, model, replace(taken, presses=tuple(labelled)), [place], chosen, settings,
        NOTHING_KEPT, lambda what, done, count: None,
    )  # fmt: skip
    solution = rounds.run()
    (field,) = chosen
    assert abs(field.value(0.0) - hidden) == pytest.approx(10.0)
    assert abs(field.value(float(solution.steps[0])) - hidden) < 6.0
