"""RGB2Normal of ideal balls against algebra."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pressed_balls import Presses, pressed_ball

from optisense.design.lenses.film import PictureWindow
from optisense.errors import ObjectiveError
from optisense.objectives import Press
from optisense.objectives.rgb2normal import dominant_colour, fit, line, rgb2normal, signed_angles

DEPTH, RADIUS = 0.3, 1.5
STEEPEST = np.sqrt(DEPTH * (2 * RADIUS - DEPTH)) / RADIUS
"""Sine of the largest angle on the ball."""

SAMPLED = 2e-3
"""R² of some 180 pixels on a line against the integral over it."""


def moments(reach: float) -> tuple[float, float, float, float]:
    """Of s and c = sqrt(1 - s²) with s even in -reach..reach: variance of s, of c, covariance of
    s and asin s, variance of asin s, by integrals in closed form.
    """
    angle, cosine = np.arcsin(reach), np.sqrt(1 - reach**2)
    mean_c = (reach * cosine + angle) / (2 * reach)
    return (
        reach**2 / 3,
        1 - reach**2 / 3 - mean_c**2,
        ((2 * reach**2 - 1) * angle + reach * cosine) / (4 * reach),
        angle**2 + 2 * cosine * angle / reach - 2,
    )


def linearity(sine: np.ndarray, cosine: np.ndarray) -> float:
    """R² of the dominant colour of sine * sin(angle) + cosine * cos(angle), both (3,)."""
    var_s, var_c, cov, var_angle = moments(STEEPEST)
    _, axes = np.linalg.eigh(np.outer(sine, sine) * var_s + np.outer(cosine, cosine) * var_c)
    a, b = axes[:, -1] @ sine, axes[:, -1] @ cosine
    return float((a * cov) ** 2 / ((a**2 * var_s + b**2 * var_c) * var_angle))


def lights(*azimuths: float, elevation: float = 45.0) -> np.ndarray:
    """(k, 3) unit directions to lights."""
    a, e = np.radians(azimuths), np.radians(elevation)
    return np.stack(
        [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.full_like(a, np.sin(e))], axis=1
    )


def expected(to_lights: np.ndarray, directions: int = 8) -> float:
    """The score that algebra gives for one Lambertian light a channel."""
    scores = []
    for angle in np.arange(directions) * 2 * np.pi / directions:
        along = to_lights[:, :2] @ [np.cos(angle), np.sin(angle)]
        scores.append(linearity(0.5 * along, 0.5 * to_lights[:, 2]))
    return float(np.mean(scores))


@pytest.mark.parametrize("azimuths", [(20.0, 20.0, 20.0), (0.0, 120.0, 240.0), (90.0, 0.0, 270.0)])
def test_a_lambertian_ball_scores_what_algebra_gives(azimuths: tuple[float, ...]) -> None:
    to_lights = lights(*azimuths)
    press = pressed_ball(lambda normals: 0.5 * normals @ to_lights.T, DEPTH)
    value, parts, _ = rgb2normal(Presses(press), colours="response")
    assert value == pytest.approx(expected(to_lights), abs=SAMPLED)
    assert parts["places"][0]["score"] == value


def test_a_colour_that_follows_the_angle_scores_one() -> None:
    def colour(normals: np.ndarray) -> np.ndarray:
        tilt = np.arctan2(np.hypot(normals[:, 0], normals[:, 1]), normals[:, 2])
        azimuth = np.arctan2(normals[:, 1], normals[:, 0])
        return 0.5 + 0.2 * np.stack(
            [tilt * np.cos(azimuth), tilt * np.sin(azimuth), 0 * tilt], axis=1
        )

    press = pressed_ball(colour, DEPTH)
    value, _, _ = rgb2normal(Presses(press), colours="response")
    assert value == pytest.approx(1.0, abs=1e-4)
    halves, _, _ = rgb2normal(Presses(press), colours="response", half_lines=True)
    assert halves == pytest.approx(1.0, abs=1e-3)


def test_a_colour_of_the_unsigned_angle_scores_one_without_signs() -> None:
    def colour(normals: np.ndarray) -> np.ndarray:
        tilt = np.arctan2(np.hypot(normals[:, 0], normals[:, 1]), normals[:, 2])
        return np.stack([0.2 + 0.2 * tilt, 0 * tilt, 0 * tilt], axis=1)

    evaluation = Presses(pressed_ball(colour, DEPTH))
    unsigned, _, _ = rgb2normal(evaluation, colours="response", signed=False)
    assert unsigned == pytest.approx(1.0, abs=1e-3)
    assert rgb2normal(evaluation, colours="response")[0] < 0.01


def test_one_dominant_colour_for_all_lines_is_blind_across_it() -> None:
    """Red tells the tilt to the east, and green, less strongly, the tilt to the north: the common
    dominant colour is red, which is alike on both flanks along the line from south to north."""

    def colour(normals: np.ndarray) -> np.ndarray:
        east, north = normals[:, 0], normals[:, 1]
        slope = east**2 + north**2
        return 0.4 + np.stack([0.5 * east + 0.2 * slope, 0.25 * north, 0 * east], axis=1)

    evaluation = Presses(pressed_ball(colour, DEPTH))
    _, alone, _ = rgb2normal(evaluation, colours="response")
    _, shared, _ = rgb2normal(evaluation, colours="response", dominant="press")
    assert alone["directions"]["90"] > 0.9
    assert shared["directions"]["0"] > 0.9
    assert shared["directions"]["90"] < 0.1
    with pytest.raises(ObjectiveError, match="dominant"):
        rgb2normal(evaluation, dominant="picture")


def test_the_unsigned_angle_would_score_nothing() -> None:
    to_lights = lights(0.0, 0.0, 0.0)
    press = pressed_ball(lambda normals: 0.5 * normals @ to_lights.T, DEPTH)
    chosen = line(press, 0.0)
    angles = signed_angles(press, 0.0, press.normals[chosen])
    colours = press.colours(chosen, "response")
    assert fit(angles, colours).linearity > 0.9
    assert fit(np.abs(angles), colours).linearity < 0.1


def test_a_colour_that_stays_the_same_scores_nothing() -> None:
    press = pressed_ball(lambda normals: np.full((len(normals), 3), 0.5), DEPTH)
    assert rgb2normal(Presses(press))[0] == 0.0


def test_places_are_averaged() -> None:
    def score(*presses: Press) -> float:
        return rgb2normal(Presses(*presses), colours="response")[0]

    one = pressed_ball(lambda n: 0.5 * n @ lights(0, 120, 240).T, DEPTH)
    other = pressed_ball(lambda n: 0.5 * n @ lights(30, 30, 30).T, DEPTH, number=2)
    assert score(one, other) == pytest.approx((score(one) + score(other)) / 2)


def test_opposite_directions_share_a_diameter() -> None:
    press = pressed_ball(lambda n: 0.5 * n @ lights(10, 100, 230).T, DEPTH)
    _, parts, arrays = rgb2normal(Presses(press))
    directions = parts["places"][0]["directions"]
    assert len(directions) == 8
    assert directions["45"] == directions["225"]
    assert len(arrays["lines"][0]) == 4
    _, parts, arrays = rgb2normal(Presses(press), half_lines=True)
    assert len(arrays["lines"][0]) == 8


@pytest.mark.parametrize(
    "view",
    [
        {},
        {"stretch": 0.25},
        {"shear": (0.6, 0.0)},
        {"shear": (0.3, 0.4), "stretch": 3.0},
        {"turned": 70.0},
    ],
    ids=str,
)
def test_the_score_does_not_depend_on_where_the_camera_stands(view: dict[str, Any]) -> None:
    to_lights = lights(0, 120, 240)
    press = pressed_ball(lambda n: 0.5 * n @ to_lights.T, DEPTH, **view)
    value, _, _ = rgb2normal(Presses(press), colours="response")
    # Fewer pixels on a line where the view is askance.
    assert value == pytest.approx(expected(to_lights), abs=4 * SAMPLED)


@pytest.mark.parametrize("angle", [0.0, 45.0, 90.0, 110.0])
@pytest.mark.parametrize("view", [{}, {"shear": (0.4, 0.2), "stretch": 0.5}], ids=str)
def test_a_line_is_one_pixel_wide_and_straight_on_the_surface(
    angle: float, view: dict[str, Any]
) -> None:
    press = pressed_ball(lambda n: n, DEPTH, pixels=151, **view)
    chosen = line(press, angle)
    per_row, per_column = chosen.sum(axis=1), chosen.sum(axis=0)
    # Along its steeper image axis the line has one pixel a step (two where it passes a corner).
    thin = per_row if (per_row > 0).sum() >= (per_column > 0).sum() else per_column
    assert set(thin[thin > 0]) <= {1, 2}
    assert (thin == 2).sum() <= 2
    across = np.cross(press.inward, press.direction(angle))
    off = press.points[chosen] @ across
    assert np.abs(off).max() < 0.03 * RADIUS
    # It goes through the ball from side to side.
    tilt = signed_angles(press, angle, press.normals[chosen])
    steepest = np.degrees(np.arcsin(STEEPEST))
    assert tilt.min() == pytest.approx(-steepest, abs=4.0)
    assert tilt.max() == pytest.approx(steepest, abs=4.0)


def test_half_a_line_starts_in_the_middle() -> None:
    press = pressed_ball(lambda n: n, DEPTH)
    whole, one, other = line(press, 30.0), line(press, 30.0, True), line(press, 210.0, True)
    assert np.array_equal(whole, one | other)
    assert (one & other).sum() <= 1
    assert signed_angles(press, 30.0, press.normals[one]).min() > -1.0


def test_the_dominant_colour_is_that_of_largest_variance() -> None:
    rng = np.random.default_rng(1)
    colours = rng.normal(size=(500, 3)) * [0.1, 1.0, 0.2] + 5
    along = dominant_colour(colours)
    assert abs(np.corrcoef(along, colours[:, 1])[0, 1]) > 0.999
    assert along.mean() == pytest.approx(0, abs=1e-12)


def test_too_few_pixels_say_where() -> None:
    press = pressed_ball(lambda n: n, DEPTH, pixels=9, number=3)
    coarser = pressed_ball(lambda n: n, DEPTH, pixels=5, number=4)
    with pytest.raises(ObjectiveError, match=r"place 4 .* higher resolution") as told:
        rgb2normal(Presses(press, coarser))
    # With that many pixels (and a middle one), the press with the shortest line is scored.
    width, height = (int(each) for each in str(told.value.hint).split()[-1].split("x"))
    assert width == height == 40 * (width // 40)
    assert rgb2normal(Presses(pressed_ball(lambda n: n, DEPTH, pixels=width + 1)))[0] > 0.8


def test_the_resolution_for_a_part_of_a_picture_is_that_of_the_whole() -> None:
    cut = pressed_ball(lambda n: n, DEPTH, pixels=9)
    window = PictureWindow.part((60, 80), (slice(20, 29), slice(30, 39)))
    with pytest.raises(ObjectiveError) as told:
        rgb2normal(Presses(replace(cut, window=window)))
    width, height = (int(each) for each in str(told.value.hint).split()[-1].split("x"))
    assert width > 80
    assert 4 * height == 3 * width


def test_a_press_whose_middle_is_not_seen_needs_another_place() -> None:
    press = pressed_ball(lambda n: n, DEPTH, pixels=101)
    cut = replace(press, mask=press.mask & (press.points[..., 0] < -0.3))
    with pytest.raises(ObjectiveError, match=r"middle of place 1 .* Move the place"):
        rgb2normal(Presses(cut))


def test_an_odd_number_of_directions_needs_half_lines() -> None:
    press = pressed_ball(lambda n: 0.5 * n @ lights(0, 120, 240).T, DEPTH)
    with pytest.raises(ObjectiveError, match="even"):
        rgb2normal(Presses(press), directions=5)
    assert rgb2normal(Presses(press), directions=5, half_lines=True)[0] > 0
