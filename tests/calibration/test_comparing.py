"""Contacts are located, and measures of realism give the difference of pictures."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.calibration import (
    Comparison,
    PhotographedPress,
    Photographs,
    compare,
    photograph_model,
    save_photographs,
)
from optisense.calibration._cross_readings import cross_readings
from optisense.calibration._far_field import without_noise
from optisense.calibration._orientation import orientation_notes
from optisense.calibration.contact_finding import FoundContact, find_contact
from optisense.calibration.model_pictures import ModelPictures, model_pictures
from optisense.calibration.realism import realism, similarity
from optisense.calibration.seen_contacts import (
    ContactFinder,
    SeenContact,
    check_shape,
    contact_of,
)
from optisense.cli import app
from optisense.cli.compare import reading_lines
from optisense.design import set_value
from optisense.errors import CalibrationError
from optisense.report.comparison import reading_rows

from .conftest import PHOTONS, PLACES, SIZE, SMALL

if TYPE_CHECKING:
    from optisense.optics import OpticalModel


def cone(centre: tuple[float, float], radius: float) -> np.ndarray:
    """(120, 160, 3) levels of a response that is odd about a place, grows up to a radius, and falls
    off beyond it as the slope of a gel's skin does."""
    rows, columns = np.mgrid[:120, :160] + 0.5
    x, y = (columns - centre[0]) / radius, (rows - centre[1]) / radius
    away = np.hypot(x, y)
    share = np.where(away <= 1.0, 1.0, np.exp(-4.0 * (away - 1.0)) / np.maximum(away, 1.0))
    return np.stack([40.0 * x, 30.0 * y, -30.0 * (x + y)], axis=2) * share[..., None]


PLAIN = np.full((120, 160, 3), 120.0)
"""Levels of an even background."""


def found_in(
    shown: np.ndarray, near: tuple[float, float] | None = None, radius: float | None = None
) -> FoundContact | None:
    """The contact in levels (120, 160, 3) before the plain background, as photographs have them."""
    levels = np.clip(np.round(shown), 0, 255).astype(np.uint8)
    return find_contact(levels, PLAIN.astype(np.uint8), near, radius)


@pytest.mark.parametrize("centre", [(70.3, 60.8), (40.0, 44.5)])
def test_an_odd_response_is_found_to_half_a_pixel(centre: tuple[float, float]) -> None:
    noise = 2.0 * np.random.default_rng(3).standard_normal(PLAIN.shape)
    found = found_in(PLAIN + cone(centre, 18.0) + noise)
    assert found is not None
    assert math.dist(found.centre, centre) < 0.5
    assert found.radius == pytest.approx(18.0, abs=1.0)
    assert found.asymmetry < 0.1


def test_a_label_leads_past_a_response_that_is_strongest_inside_the_contact() -> None:
    """As if flanks beyond a few degrees responded no stronger."""
    rows, columns = np.mgrid[:120, :160] + 0.5
    x, y = columns - 80.0, rows - 60.0
    away = np.hypot(x, y)
    strength = 300.0 / (25.0 + away**2) * (away <= 24.0)
    response = np.stack([x, y, -x], axis=2) * strength[..., None]
    free = found_in(PLAIN + response)
    led = found_in(PLAIN + response, (82.0, 59.0), 22.0)
    assert free is not None and led is not None
    assert free.radius < 17.0
    assert math.dist(led.centre, (80.0, 60.0)) < 0.5
    assert 18.0 < led.radius < 26.0


def test_a_model_without_errors_has_the_figures_of_noise_alone() -> None:
    rng = np.random.default_rng(6)
    response = cone((70.0, 60.0), 18.0)
    noisy = np.round(PLAIN + response + 3.0 * rng.standard_normal(PLAIN.shape))
    press = PhotographedPress("a.png", noisy.astype(np.uint8), 6.0)
    photographs = Photographs(PLAIN.astype(np.uint8), (press,))
    perfect = ModelPictures(1.0, PLAIN, (PLAIN + response,), ())
    (found,) = realism(photographs, [SeenContact((70.0, 60.0), 18.0)], perfect).presses
    for name in ("unexplained", "contact", "ring"):
        assert getattr(found.noise, name) == pytest.approx(getattr(found, name), rel=0.1)
    assert found.noise.similarity == pytest.approx(found.similarity, abs=0.01)
    assert found.similarity < 0.99


def test_a_drift_between_background_and_press_is_no_error_of_the_model() -> None:
    """Only the figures of the far field and of the drift contain it."""
    response = cone((70.0, 60.0), 12.0)
    pictures = ModelPictures(1.0, PLAIN, (PLAIN + response,), ())
    found = []
    for drift in (0.0, 3.0):
        noise = 2.0 * np.random.default_rng(8).standard_normal(PLAIN.shape)
        taken = np.round(PLAIN + response + noise + (drift, 0.0, 0.0)).astype(np.uint8)
        press = PhotographedPress("a.png", taken, 6.0)
        photographs = Photographs(PLAIN.astype(np.uint8), (press,))
        found += realism(photographs, [SeenContact((70.0, 60.0), 12.0)], pictures).presses
    steady, drifted = found
    assert drifted.unexplained == pytest.approx(steady.unexplained, rel=0.01)
    assert drifted.similarity == pytest.approx(steady.similarity, abs=0.002)
    assert np.array(drifted.drift) - steady.drift == pytest.approx([3.0, 0.0, 0.0], abs=0.01)
    # beyond three radii, there is the slope of the response
    assert steady.far_smooth < 0.5
    assert drifted.far_smooth**2 - steady.far_smooth**2 == pytest.approx(3.0, rel=0.2)


def test_the_part_of_an_error_without_noise_is_that_of_a_smooth_error() -> None:
    columns = np.tile(np.arange(160), (120, 1))
    smooth = np.repeat(np.sin(columns / 20.0)[..., None], 3, axis=2)
    noise = 5.0 * np.random.default_rng(4).standard_normal(smooth.shape)
    everywhere = np.ones((120, 160), dtype=bool)
    assert without_noise(smooth + noise, everywhere) == pytest.approx(np.sqrt(0.5), rel=0.2)


def test_no_contact_is_found_in_noise() -> None:
    assert found_in(PLAIN + 2.0 * np.random.default_rng(3).standard_normal(PLAIN.shape)) is None


def test_contacts_of_a_model_are_found_where_they_press(
    mini: OpticalModel, photographs: Photographs
) -> None:
    rays = mini.chief_rays(photographs.size)
    for place, press, seen in zip(
        PLACES, photographs.presses, ContactFinder(photographs).contacts(), strict=True
    ):
        assert seen is not None
        contact = contact_of(press, seen, mini, rays)
        point = mini.surface.point_at(*place).point
        scale = 18.6 / photographs.size[0]
        assert math.dist(contact.point or (), point) < 1.5 * scale
        assert contact.depth == pytest.approx(0.6, rel=0.2)


@pytest.fixture(scope="module")
def likeness(mini: OpticalModel, photographs: Photographs) -> Comparison:
    """The comparison of a model with photographs that were made of it."""
    return compare(mini, photographs, photons=PHOTONS, seed=5)


def test_a_model_is_its_own_likeness(likeness: Comparison) -> None:
    found = likeness
    assert found.notes == ()
    for press in found.realism.presses:
        assert press.unexplained < 0.06
        assert press.similarity > 0.9
        assert press.far == pytest.approx(press.far_real, rel=0.1)
        assert np.median(np.abs(press.turn)) < 3.0
        assert np.abs(np.array(press.gain) - 1.0).max() < 0.2
    assert found.realism.background.ratio > 38.0
    assert min(found.realism.background.correlation) > 0.99


def test_a_turned_sensor_is_told(mini: OpticalModel, small_photographs: Photographs) -> None:
    design = mini.design
    swapped = design.copy()
    for one, other in (("red", "blue"), ("blue", "red")):
        swapped = set_value(swapped, f"lights.{one}.colour", design.lights[other].colour)
    one = small_photographs.subset([0])
    (seen,) = ContactFinder(one).contacts()
    assert seen is not None
    pictures = model_pictures(ots.OpticalModel(swapped), one, [seen], photons=PHOTONS, seed=5)
    found = realism(one, [seen], pictures)
    assert found.median("unexplained") > 0.5
    turns = [abs(press.turn[0]) for press in found.presses]
    assert min(turns) > 120.0


def changed(photographs: Photographs, *steps: int) -> Photographs:
    """Photographs with their rows, columns and channels taken in steps."""
    change = tuple(slice(None, None, step) for step in steps)

    def of(picture: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(picture[change])

    presses = [replace(each, picture=of(each.picture)) for each in photographs.presses]
    return replace(photographs, background=of(photographs.background), presses=tuple(presses))


def test_exchanged_colours_are_told(photographs: Photographs, likeness: Comparison) -> None:
    blue_first = changed(photographs, 1, 1, -1)
    (note,) = orientation_notes(blue_first, likeness.seen, likeness.pictures)
    assert "stored with red and blue exchanged" in note
    assert orientation_notes(photographs, likeness.seen, likeness.pictures) == []


def test_mirrored_photographs_are_told(mini: OpticalModel, small_photographs: Photographs) -> None:
    mirrored = changed(small_photographs.subset([0]), 1, -1, 1)
    (seen,) = ContactFinder(mirrored).contacts()
    assert seen is not None
    pictures = model_pictures(mini, mirrored, [seen], photons=PHOTONS, seed=5)
    (note,) = orientation_notes(mirrored, [seen], pictures)
    assert note.startswith("the photographs seem to be mirrored left to right")


def test_photographs_of_the_transposed_shape_are_to_be_turned(
    mini: OpticalModel, small_photographs: Photographs
) -> None:
    first = small_photographs.presses[0]
    upright = replace(first, picture=first.picture.transpose(1, 0, 2))
    background = small_photographs.background.transpose(1, 0, 2)
    with pytest.raises(CalibrationError, match="another shape") as raised:
        check_shape(Photographs(background, (upright,)), mini)
    assert raised.value.hint == "Turn the photographs by 90 degrees"


def test_the_similarity_is_one_of_equals_and_less_of_opposites() -> None:
    response = cone((70.0, 60.0), 18.0)
    assert similarity(response, response, 4.0).min() == pytest.approx(1.0)
    assert similarity(response, -response, 4.0)[50:70, 60:80].mean() < 0.5


def test_wrong_labels_and_missing_contacts_are_told(photographs: Photographs) -> None:
    first, second, third = photographs.presses
    odd = replace(
        photographs,
        presses=(
            replace(first, centre=(140.0, 20.0), radius=12.0),
            replace(second, picture=photographs.background),
            third,
        ),
    )
    words = ContactFinder(odd).doubts()
    assert "away from the contact" in words[0]
    assert "it shows no contact" in words[1]
    assert len(words) == 2
    used, missing, _ = ContactFinder(odd).contacts()
    true = ContactFinder(photographs).contacts()[0]
    assert missing is None
    assert used is not None and true is not None
    assert math.dist(used.centre, true.centre) < 0.1 * true.radius


def test_a_blemish_of_the_background_replaces_no_label() -> None:
    """A press that the camera hardly shows keeps its label; all photographs show the blemish."""
    rng = np.random.default_rng(4)
    places = [(100.0, 40.0), (60.0, 50.0), (110.0, 80.0), (80.0, 60.0)]
    presses = []
    for place, strength in zip(places, (0.5, 0.5, 0.5, 0.0), strict=True):
        shown = PLAIN + strength * cone(place, 10.0) + rng.standard_normal(PLAIN.shape)
        picture = np.round(shown).astype(np.uint8)
        presses.append(PhotographedPress("a.png", picture, 6.0, place, 10.0))
    background = np.round(PLAIN - cone((30.0, 90.0), 8.0)).astype(np.uint8)
    photographs = Photographs(background, tuple(presses))
    found = ContactFinder(photographs).contacts()
    for seen, place in zip(found, places, strict=True):
        assert seen is not None and math.dist(seen.centre, place) < 1.0
    alone = ContactFinder(photographs.subset([3])).contacts()[0]
    assert alone is not None and math.dist(alone.centre, (30.0, 90.0)) < 1.0


def test_a_background_with_a_contact_is_told(photographs: Photographs) -> None:
    assert ContactFinder(photographs).doubts() == []
    first, *others = photographs.presses
    pressed = replace(photographs, background=first.picture, presses=tuple(others))
    assert any("seems to show a contact" in note for note in ContactFinder(pressed).doubts())
    # Labels deny the contact that all photographs show.
    presses = [replace(first, centre=(column, 16.0), radius=12.0) for column in (16.0, 24.0, 32.0)]
    words = ContactFinder(replace(photographs, presses=tuple(presses))).doubts()
    assert "several photographs show one at column" in words[0]


def test_presses_at_one_place_are_told(photographs: Photographs) -> None:
    rng = np.random.default_rng(3)
    one = photographs.presses[0]
    noisy = (one.picture + rng.integers(-1, 2, one.picture.shape) for _ in range(2))
    again = [replace(one, picture=np.clip(each, 0, 255).astype(np.uint8)) for each in noisy]
    some = replace(photographs, presses=(one, *again, photographs.presses[1]))
    assert "most presses are at the same place" in ContactFinder(some).doubts()[0]


def test_impossible_contacts_are_refused(mini: OpticalModel, photographs: Photographs) -> None:
    rays = mini.chief_rays(photographs.size)
    press = photographs.presses[0]
    with pytest.raises(CalibrationError, match=r"the ball one of 0\.5 mm"):
        contact_of(replace(press, diameter=1.0), SeenContact((80.0, 60.0), 12.0), mini, rays)
    with pytest.raises(CalibrationError, match="the gel is 21 mm wide"):
        contact_of(replace(press, diameter=60.0), SeenContact((80.0, 60.0), 12.0), mini, rays)
    with pytest.raises(CalibrationError, match="sees no skin"):
        contact_of(press, SeenContact((500.0, 60.0), 12.0), mini, rays)
    with pytest.raises(CalibrationError, match="can't be pressed in"):
        contact_of(replace(press, diameter=12.0), SeenContact((80.0, 60.0), 50.0), mini, rays)


def test_the_command_writes_a_page_and_prints_figures(
    small_photographs: Photographs, tmp_path: Path
) -> None:
    folder = tmp_path / "photos"
    save_photographs(folder, small_photographs.subset([0]))
    run = CliRunner().invoke(
        app,
        ["compare", "gelsight-mini-ideal", str(folder), "--photons", "60000", "--json"]
        + ["--out", str(tmp_path / "page.html")],
    )
    assert run.exit_code == 0, run.output
    data = json.loads(run.stdout)
    assert data["presses"][0]["unexplained"] < 0.1
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert page.count("data:image/png") == 3 + 5 + 1
    assert "<script" not in page


def test_the_command_says_what_is_wrong(photographs: Photographs, tmp_path: Path) -> None:
    save_photographs(tmp_path, photographs.subset([0]))
    run = CliRunner().invoke(app, ["compare", "digit", str(tmp_path)])
    assert run.exit_code == 2
    assert "another shape" in run.output
    (tmp_path / "background.png").unlink()
    run = CliRunner().invoke(app, ["compare", "gelsight-mini-ideal", str(tmp_path)])
    assert run.exit_code == 2
    assert "there is no background.png" in run.output


def test_found_contacts_are_told_and_shown_for_correction(
    photographs: Photographs, tmp_path: Path
) -> None:
    save_photographs(tmp_path / "photos", photographs)
    page = tmp_path / "contacts.html"
    run = CliRunner().invoke(app, ["contacts", str(tmp_path / "photos"), "--out", str(page)])
    assert run.exit_code == 0, run.output
    text = page.read_text("utf-8")
    found = json.loads(text.split('id="contacts-data">')[1].split("</script>")[0])
    assert [each["file"] for each in found] == [press.name for press in photographs.presses]
    assert all(each["used"] for each in found)
    assert f"{found[0]['column']:.1f}" in run.output


def test_readers_of_pictures_that_are_alike_read_each_others_balls(
    mini: OpticalModel, photographs: Photographs, likeness: Comparison
) -> None:
    """The reader finds the true size of balls in a model's pictures, but not in amplified ones."""
    found = likeness
    assert [each.name for each in found.realism.readings] == [
        press.name for press in photographs.presses
    ]
    assert found.realism.median_reading("radius") == pytest.approx(1.0, abs=0.15)
    assert found.realism.median_reading("radius_back") == pytest.approx(1.0, abs=0.15)
    assert found.realism.median_reading("degrees") < 8.0
    assert all(each.degrees_alone is None for each in found.realism.readings)  # two can't tell
    weaker = found.pictures.background
    half = replace(
        found.pictures,
        presses=tuple(0.5 * (each + weaker) for each in found.pictures.presses),
    )
    rays, axes = mini.chief_rays(SIZE), mini.design.camera.axes()
    read = cross_readings(photographs, found.seen, half, rays, axes, 2.0)
    # Tilts of what is photographed look too steep to a reader of weaker responses.
    assert np.median([each.radius for each in read]) < 0.93
    assert np.median([each.radius_back for each in read]) > 1.07
    assert cross_readings(photographs.subset([0, 1]), found.seen[:2], half, rays, axes, 2.0) == ()


def test_readers_that_see_no_curvature_are_told_in_words(
    mini: OpticalModel, photographs: Photographs, likeness: Comparison
) -> None:
    """The responses are reversed, so that balls look like hollows."""
    ground = likeness.pictures.background
    hollow = replace(
        likeness.pictures, presses=tuple(2.0 * ground - each for each in likeness.pictures.presses)
    )
    rays, axes = mini.chief_rays(SIZE), mini.design.camera.axes()
    read = cross_readings(photographs, likeness.seen, hollow, rays, axes, 2.0)
    found = replace(likeness.realism, readings=read)
    start = (
        "a reader calibrated on the model sees no curvature in the balls of the photographs, and"
    )
    assert reading_lines(found)[0].startswith(start)
    assert reading_rows(found)[0][1] == "no curvature"
    assert "times as large as they are" in reading_lines(likeness.realism)[0]


def test_seven_presses_tell_what_readers_of_the_photographs_alone_achieve(
    mini: OpticalModel, likeness: Comparison
) -> None:
    """Whatever the model's pictures are, which here are the photographs themselves."""
    places = [(x, y) for x in (-4.0, 0.0, 4.0) for y in (-3.0, 3.0)] + [(1.0, 0.0)]
    points = [mini.surface.point_at(*place).point for place in places]
    balls = [ots.Contact(ots.Sphere(3.0), point=tuple(each), depth=0.6) for each in points]
    taken = photograph_model(mini, balls, resolution=SMALL, photons=PHOTONS, seed=5, noise=1.0)
    seen = [place for place in ContactFinder(taken).contacts() if place is not None]
    ground, *presses = (
        levels.astype(np.float64)
        for levels in (taken.background, *(press.picture for press in taken.presses))
    )
    shown = ModelPictures(1.0, ground, tuple(presses), tuple(balls))
    rays, axes = mini.chief_rays(SMALL), mini.design.camera.axes()
    read = cross_readings(taken, seen, shown, rays, axes, 1.0)
    assert len(read) == len(places)
    found = replace(likeness.realism, readings=read)
    radius, degrees = (found.median_reading(f"{name}_alone") for name in ("radius", "degrees"))
    assert radius == pytest.approx(1.0, abs=0.15)
    assert degrees < 8.0
    assert reading_lines(found)[2] == (
        f"a reader calibrated on the photographs reads the balls of other photographs {radius:.2f} "
        f"times as large as they are, and normals with an error of {degrees:.1f} degrees"
    )
