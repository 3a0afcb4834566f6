"""NormDiff of colour maps whose confusion is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pressed_balls import Presses, pressed_ball

from optisense.errors import ObjectiveError
from optisense.objectives.normdiff import azimuth_on_sphere, confusion, normal_cells, normdiff

STEEPEST = 35.0


def evenly(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Polar angles and azimuths (degrees) spread over a half of a cap, by a Halton-like rule."""
    i = np.arange(count) + 0.5
    theta = np.degrees(np.arcsin(np.sin(np.radians(STEEPEST)) * np.sqrt(i / count)))
    phi = 170.0 * ((i * 0.6180339887498949) % 1.0)
    return theta, phi


def widths(noise: float, rate: float) -> tuple[float, float]:
    """How far an angle may fall and rise until exp(rate * angle) leaves the noise."""
    return -np.log(1 - noise) / rate, np.log(1 + noise) / rate


@pytest.mark.parametrize("noise", [0.3, 0.1, 0.03])
def test_an_invertible_colour_map_is_confused_by_the_noise_width(noise: float) -> None:
    theta, phi = evenly(12_000)
    # Red tells the polar angle and green the azimuth; both grow exponentially, so that relative
    # noise is the same angle everywhere.
    rate_theta, rate_phi = 0.05, 0.02
    colours = np.stack(
        [0.2 * np.exp(rate_theta * theta), 0.2 * np.exp(rate_phi * phi), 0 * theta + 0.5], axis=1
    )
    found = confusion(colours, theta, phi, noise)
    fall, rise = widths(noise, rate_theta)
    inner = (found.theta > fall + 6) & (found.theta < STEEPEST - rise - 2)
    back, on = widths(noise, rate_phi)
    inner &= (found.phi > back + 6) & (found.phi < 164 - on)
    assert inner.any()
    # The largest and smallest of some points fall short of the box's ends.
    short = 2.0
    assert found.theta_range[inner] == pytest.approx(fall + rise, abs=short)
    on_sphere = azimuth_on_sphere(back + on, found.theta[inner])
    assert found.phi_range[inner] == pytest.approx(on_sphere, abs=short)
    assert found.confusion == pytest.approx(found.theta_range + found.phi_range)


def test_at_the_end_of_the_range_the_confusion_is_cut_off() -> None:
    theta, phi = evenly(12_000)
    colours = np.stack([0.15 * np.exp(0.05 * theta), 0 * theta + 0.5, 0 * theta + 0.5], axis=1)
    found = confusion(colours, theta, phi, 0.1)
    fall, rise = widths(0.1, 0.05)
    expected = np.minimum(found.theta + rise, STEEPEST) - np.maximum(found.theta - fall, 0)
    # A grid normal stands for pixels up to half a cell (1.5 degrees) away from it.
    assert np.abs(found.theta_range - expected).max() < 1.5


def test_one_pixel_for_each_normal_says_the_same_of_a_smooth_map() -> None:
    theta, phi = evenly(12_000)
    colours = np.stack([0.15 * np.exp(0.05 * theta), 0.03 * np.exp(0.02 * phi), 0 * phi], axis=1)
    mean, one = (confusion(colours, theta, phi, nearest_only=only) for only in (False, True))
    assert (one.cells == mean.cells).all()
    assert one.confusion.mean() == pytest.approx(mean.confusion.mean(), rel=0.02)


def test_less_noise_confuses_less_and_no_noise_not_at_all() -> None:
    theta, phi = evenly(4000)
    colours = np.stack([0.15 * np.exp(0.05 * theta), 0.03 * np.exp(0.02 * phi), 0 * phi], axis=1)
    means = [confusion(colours, theta, phi, noise).confusion.mean() for noise in (0.3, 0.1, 0.02)]
    assert means[0] > means[1] > means[2]
    # What is left is the grey level that every pixel may be off, and the grid.
    assert means[2] < 8.0


def test_weights_are_those_of_the_two_ranges() -> None:
    theta, phi = evenly(2000)
    colours = np.stack([0.2 + theta / 100, 0.2 + phi / 400, 0 * phi], axis=1)
    found = confusion(colours, theta, phi, theta_weight=0.25, phi_weight=2.0)
    assert found.confusion == pytest.approx(0.25 * found.theta_range + 2 * found.phi_range)


def test_azimuth_on_the_sphere_is_the_angle_between_normals() -> None:
    rng = np.random.default_rng(0)
    theta, arc = 80 * rng.random(100), 180 * rng.random(100)
    t, p = np.radians(theta), np.radians(arc)
    a = np.stack([np.sin(t), 0 * t, np.cos(t)], axis=1)
    b = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=1)
    between = np.degrees(np.arccos(np.clip((a * b).sum(axis=1), -1, 1)))
    assert azimuth_on_sphere(arc, theta) == pytest.approx(between, abs=1e-5)
    assert azimuth_on_sphere(360, 20) == pytest.approx(40.0)


def test_each_normal_takes_a_near_grid_normal_and_the_grid_is_even() -> None:
    rng = np.random.default_rng(0)
    z = 1 - rng.random(200_000) * (1 - np.cos(np.radians(60)))
    theta, phi = np.degrees(np.arccos(z)), 360 * rng.random(200_000) - 180
    cells, cell_theta, cell_phi = normal_cells(theta, phi, 3.0)
    t, p, ct, cp = (np.radians(x) for x in (theta, phi, cell_theta, cell_phi))
    cosine = np.cos(t) * np.cos(ct) + np.sin(t) * np.sin(ct) * np.cos(p - cp)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 3.0 / np.sqrt(2) * 1.2
    whole = cells[(cell_theta > 4) & (cell_theta < 57)]
    _, counts = np.unique(whole, return_counts=True)
    # A chance count of its mean scatters by its root; the cells differ by some per cent.
    assert counts.std() < 2.0 * np.sqrt(counts.mean())


def test_a_ball_lit_in_three_colours_is_less_confusing_than_in_one() -> None:
    a = np.radians([0.0, 120.0, 240.0])
    ways = np.stack([0.6 * np.cos(a), 0.6 * np.sin(a), np.full(3, 0.4)], axis=1)
    three = pressed_ball(lambda n: n @ ways.T, pixels=61)
    one = pressed_ball(lambda n: n @ ways[[0, 0, 0]].T, pixels=61)
    best, parts, _ = normdiff(Presses(three), noise=0.05)
    worst, _, _ = normdiff(Presses(one), noise=0.05)
    assert worst < 2 * best < 0
    assert -best == pytest.approx(parts["theta_range"] + parts["phi_range"])
    assert len(parts["confusion_map"]["theta"]) == parts["places"][0]["normals"]


def test_the_flat_part_of_a_press_is_not_indented() -> None:
    press = pressed_ball(lambda n: n, pixels=101)
    _, parts, _ = normdiff(Presses(press))
    tilt = np.degrees(np.arccos(np.clip(press.normals[press.mask][:, 2], -1, 1)))
    assert parts["places"][0]["pixels"] == (tilt > 1.0).sum() < press.mask.sum()


@pytest.mark.parametrize(("edge", "whole"), [(0.7, True), (0.3, False), (-0.5, False)])
def test_a_press_that_the_view_cuts_has_no_score(edge: float, whole: bool) -> None:
    """The edge is that of the view, in contact radii to the right of the middle."""
    press = pressed_ball(lambda n: n, pixels=101)
    reach = 1.5 * np.sin(np.arccos(0.8))
    cut = replace(press, mask=press.mask & (press.points[..., 0] < edge * reach))
    if whole:
        assert normdiff(Presses(cut))[0] < 0.0
        return
    with pytest.raises(ObjectiveError, match=r"sees only a part of place 1 .* towards 0 degrees"):
        normdiff(Presses(cut))


def test_a_whole_press_on_a_skin_that_lowers_its_tilts_has_a_score() -> None:
    press = pressed_ball(lambda n: n, pixels=101)
    lowered = press.normals * np.float32([0.4, 0.4, 1.0])
    lowered /= np.linalg.norm(lowered, axis=2, keepdims=True)
    assert normdiff(Presses(replace(press, normals=lowered)))[0] < 0.0


def test_too_few_pixels_say_where() -> None:
    with pytest.raises(ObjectiveError, match=r"place 2 .* has \d+ of the \d+ indented pixels"):
        normdiff(Presses(pressed_ball(lambda n: n, pixels=7, number=2)))
