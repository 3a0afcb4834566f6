"""Errors of a calibrated reader on new presses, whose colours follow from closed forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pressed_balls import pressed_ball

import optisense as ots
from optisense.design import set_value
from optisense.design.lenses.film import PictureWindow
from optisense.errors import ObjectiveError
from optisense.objectives import Evaluation, Press, Settings, evaluate
from optisense.objectives._figures import draw_depth, draw_reading
from optisense.objectives._reader import LEAST_PIXELS, grid_of, pixels_to_read
from optisense.objectives._reading import depth, reading
from optisense.objectives.relighting import Relighting
from optisense.optics import OpticalModel

PIXELS = 61
RADIUS, DEPTH = 1.5, 0.3  # mm, of the fixture's balls
LIGHTS = np.array([[0.5, 0.0, 0.866], [-0.25, 0.433, 0.866], [-0.25, -0.433, 0.866]])
PLACES = ((0.0, 0.0), (4.0, 3.0), (-4.0, 3.0), (4.0, -3.0), (-4.0, -3.0))

Colour = Callable[[np.ndarray], np.ndarray]


def lambertian(normals: np.ndarray) -> np.ndarray:
    """A diffuse coating under three lights from three sides, one of each colour."""
    return 0.5 * np.maximum(normals @ LIGHTS.T, 0.0)


class Presses:
    """Stands for an evaluation whose presses are given."""

    def __init__(self, presses: list[Press]) -> None:
        self.calibration_presses, self.settings = presses, Settings()

    def shared(self, name: str, make: Callable[[], Any]) -> Any:
        if name == "rays of the images":  # of a plane that is seen from above, in parallel
            return self.rays
        return make()

    @property
    def rays(self) -> Any:
        """The plane that the presses are pressed into, below all nine of them."""
        reach = 1.1 * np.sqrt(DEPTH * (2 * RADIUS - DEPTH))
        steps = np.arange(3 * PIXELS) * 2 * reach / (PIXELS - 1)
        column, row = np.meshgrid(steps, -steps)
        level = np.full_like(column, RADIUS - DEPTH)
        up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (*level.shape, 3))
        return SimpleNamespace(
            points=np.stack([column, row, level], -1), normals=up, directions=-up
        )


@pytest.fixture
def nine() -> Callable[..., Presses]:
    """Nine presses in rows of three, each with the colours of a function of the normals."""

    def made(*colours: Colour, turned: float = 0.0) -> Presses:
        presses = []
        for number in range(9):
            colour = colours[number % len(colours)]
            press = pressed_ball(colour, pixels=PIXELS, number=number + 1, turned=turned)
            flat = np.broadcast_to(
                colour(np.array([[0.0, 0.0, 1.0]])).astype(np.float32), press.response.shape
            )
            row, column = divmod(number, 3)
            box = tuple(slice(at * PIXELS, (at + 1) * PIXELS) for at in (row, column))
            presses.append(
                replace(
                    press,
                    response=np.where(press.mask[..., None], press.response, flat),
                    respond_untouched=lambda flat=flat: flat,
                    window=PictureWindow.part((3 * PIXELS, 3 * PIXELS), box),
                )
            )
        return Presses(presses)

    return made


@pytest.mark.parametrize("turned", [0.0, 50.0])
def test_three_lights_and_no_noise_are_read_nearly_without_error(
    nine: Callable[..., Presses], turned: float
) -> None:
    """The colours do not depend on the direction of the skin."""
    value, parts, _ = reading(nine(lambertian, turned=turned), camera_noise=0.0)
    assert 0.0 < value < 1.0
    assert parts["level_skin"] < 0.5
    assert 20.0 < parts["reading_nothing"] < 30.0


def test_one_colour_for_all_tells_no_tilt(nine: Callable[..., Presses]) -> None:
    """What is read is then the mean of all tilts, which is level: as if nothing were read."""
    value, parts, _ = reading(nine(lambda n: np.full((len(n), 3), 0.3)))
    assert value == pytest.approx(parts["reading_nothing"], rel=0.02)


def test_noise_of_the_camera_makes_it_worse(nine: Callable[..., Presses]) -> None:
    presses = nine(lambertian)
    values = [reading(presses, camera_noise=noise)[0] for noise in (0.0, 3.0, 12.0)]
    assert values[0] < values[1] - 0.2
    assert values[1] < values[2] - 1.0


def test_two_lights_of_one_colour_leave_a_side_unknown(nine: Callable[..., Presses]) -> None:
    """A colour that is the same on both flanks of the ball tells how steep, and not where to."""

    def mirrored(normals: np.ndarray) -> np.ndarray:
        both = lambertian(normals) + lambertian(normals * [-1.0, -1.0, 1.0])
        return 0.5 * both

    value, parts, _ = reading(nine(mirrored), camera_noise=0.0)
    assert value > 0.8 * parts["reading_nothing"]


def test_a_press_is_read_by_what_the_others_tell(nine: Callable[..., Presses]) -> None:
    """One place of which the channels are swapped is misread, and the others are not much worse."""
    usual = [lambertian] * 8
    odd = nine(*usual, lambda n: lambertian(n)[:, ::-1])
    value, parts, _ = reading(odd, camera_noise=0.0)
    errors = [place["error"] for place in parts["places"]]
    assert errors[8] > 15.0
    assert parts["worst_place"] == errors[8]
    assert value == sorted(errors)[4] < 5.0
    assert parts["mean_of_places"] == pytest.approx(np.mean(errors))


def test_colours_that_change_steadily_over_the_picture_are_followed(
    nine: Callable[..., Presses],
) -> None:
    """Each press is brighter than the one before, by a factor that the untouched skin shows."""
    fading = [lambda n, k=k: lambertian(n) * (0.5 + 0.06 * k) for k in range(9)]
    value, parts, _ = reading(nine(*fading), camera_noise=0.0)
    assert value < 2.0
    assert parts["worst_place"] < 4.0


def test_four_presses_are_needed(nine: Callable[..., Presses]) -> None:
    few = nine(lambertian)
    few.calibration_presses = few.calibration_presses[:3]
    with pytest.raises(ObjectiveError, match="3 presses are too few"):
        reading(few)


def test_small_contacts_are_refused() -> None:
    press = pressed_ball(lambertian, pixels=7, number=2)
    assert press.mask.sum() < LEAST_PIXELS
    with pytest.raises(ObjectiveError, match=f"of the {LEAST_PIXELS} pixels that it needs"):
        grid_of(press)


def test_what_is_read_is_rendered() -> None:
    """About so many pixels of a large contact, all of a small one, none beside it."""
    small, large = (pressed_ball(lambertian, pixels=size) for size in (25, 201))
    assert (pixels_to_read(small) == small.mask).all()
    chosen = pixels_to_read(large)
    assert not (chosen & ~large.mask).any()
    assert 400 < chosen.sum() < 1000 < large.mask.sum()


@pytest.mark.parametrize("noise", [-1.0, 200.0])
def test_noise_has_bounds(nine: Callable[..., Presses], noise: float) -> None:
    with pytest.raises(ObjectiveError, match="'camera_noise' is"):
        reading(nine(lambertian), camera_noise=noise)


def on_the_plane(presses: Presses) -> Presses:
    """The same presses where they lie in the picture of the plane; they are made in its corner."""
    moved = []
    for press in presses.calibration_presses:
        assert press.window is not None
        rows, columns = press.window.box
        corner = presses.rays.points[rows, columns][PIXELS // 2, PIXELS // 2]
        moved.append(replace(press, points=press.points + corner * [1.0, 1.0, 0.0]))
    presses.calibration_presses = moved
    return presses


def test_the_depth_of_balls_comes_back(nine: Callable[..., Presses]) -> None:
    value, parts, _ = depth(on_the_plane(nine(lambertian)), camera_noise=0.0)
    assert value < 0.01
    # The mean depth of a cap is about half of it.
    assert parts["reading_nothing"] == pytest.approx(DEPTH / 2, rel=0.05)
    for place in parts["places"]:
        assert place["deepest"] == pytest.approx(DEPTH, abs=1e-3)
        assert place["deepest_read"] == pytest.approx(DEPTH, abs=0.02)


def test_where_no_tilt_is_read_there_is_no_depth(nine: Callable[..., Presses]) -> None:
    grey = on_the_plane(nine(lambda n: np.full((len(n), 3), 0.3)))
    value, parts, _ = depth(grey)
    assert value == pytest.approx(parts["reading_nothing"], rel=0.05)


@pytest.mark.parametrize(("score", "draw"), [(reading, draw_reading), (depth, draw_depth)])
def test_drawings_lie_as_the_contacts_do_in_the_picture(
    nine: Callable[..., Presses], score: Any, draw: Any
) -> None:
    """Also if places are counted along columns, from the right one on."""
    presses = nine(lambertian)
    in_rows = presses.calibration_presses
    presses.calibration_presses = [in_rows[3 * (k % 3) + 2 - k // 3] for k in range(9)]
    _, parts, arrays = score(on_the_plane(presses), camera_noise=0.0)
    figure = draw(SimpleNamespace(parts=parts, arrays=arrays))
    titles = [axes.get_title().split(":")[0] for axes in figure.axes[:9]]
    assert titles == ["7", "4", "1", "8", "5", "2", "9", "6", "3"]


@pytest.fixture(scope="module")
def relighting() -> Relighting:
    settings = Settings(resolution=(200, 150), photons=200_000, places=PLACES)
    return Relighting(Evaluation(OpticalModel(ots.load("gelsight-mini-ideal")), settings))


def test_presses_under_other_lights_read_the_same_whether_cut_or_whole(
    relighting: Relighting,
) -> None:
    design = ots.load("gelsight-mini-ideal")
    for name in design.lights:
        design = set_value(design, f"lights.{name}.colour", (0.9, 0.3, 0.2))
    one_colour, usual = design, ots.load("gelsight-mini-ideal")
    values = []
    for each in (usual, one_colour):
        whole = evaluate(relighting.relit(each), ["reading", "depth"])
        cut = evaluate(relighting.relit(each, whole=False), ["reading", "depth"])
        for name, score in cut.items():
            assert score.failure is None and whole[name].failure is None
            assert score.value == pytest.approx(whole[name].value, rel=1e-9)
        values.append(whole["reading"].value)
    assert values[0] < values[1] - 2.0  # three colours tell more than one


def test_relit_presses_read_as_rendered_ones(relighting: Relighting) -> None:
    usual = ots.load("gelsight-mini-ideal")
    rendered = Evaluation(OpticalModel(usual), relighting.settings)
    direct = evaluate(rendered, "reading").value
    assert evaluate(relighting.relit(usual), "reading").value == pytest.approx(direct, rel=0.02)


def test_the_exposure_is_that_of_the_untouched_skin() -> None:
    """A shiny coating saturates where other scores turn the exposure down."""
    design = set_value(ots.load("gelsight-mini-ideal"), "coating.specularity", 0.8)
    settings = {"resolution": (120, 90), "photons": 60_000}
    sensor = OpticalModel(design)
    evaluation = Evaluation(sensor, Settings(**settings, places=PLACES))
    as_set = evaluate(evaluation, "reading")
    assert evaluation.untouched_exposure > 3.0 * evaluation.exposure
    brightest = [each.response.max() for each in evaluation.calibration_presses]
    assert min(brightest) == 1.0
    lowered = Settings(**settings, places=PLACES, exposure=evaluation.exposure)
    assert as_set.value > evaluate(Evaluation(sensor, lowered), "reading").value + 2.0
    shared = evaluate(evaluation, "rgb2normal").value  # not changed by what reading exposes
    alone = evaluate(Evaluation(sensor, evaluation.settings), "rgb2normal").value
    assert shared == pytest.approx(alone, rel=1e-4)  # sums of photons differ by their rounding
