"""Which of two sensors reads better, where it is known beforehand."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from optisense import OpticalModel, load, set_value
from optisense.errors import TaskError
from optisense.geometry.objects import OBJECTS
from optisense.kept_arrays import KeptArrays
from optisense.optics import TactileImage
from optisense.sensors._gelsight_mini_ideal import gelsight_mini_ideal
from optisense.tasks import ReconstructionSettings, VerificationSettings, verify
from optisense.tasks._calibration import CalibratedSensor
from optisense.tasks._unseen_presses import MOST_DEEP, VIEW_RIM, choose_presses
from optisense.tasks.paired_errors import INCONCLUSIVE, WORSE
from optisense.tasks.press_readings import PressReading, whole_errors

FEW = ("screw-head", "cable", "wedge", "nut", "bean", "braille")
READING = ReconstructionSettings(presses=8, resolution=(96, 72), seed=2)
SETTINGS = VerificationSettings(FEW, places=1, readers=1, reading=READING)


class DimSensor:
    """A sensor whose green and blue light have gone out: half of what tilts it reads is lost."""

    def __init__(self, sensor: Any) -> None:
        self._sensor = sensor

    def __getattr__(self, name: str) -> Any:
        return getattr(self._sensor, name)

    def render(self, *given: Any, **named: Any) -> TactileImage:
        image = self._sensor.render(*given, **named)
        dim = {name: layer * np.float32([1, 0, 0]) for name, layer in image.layers.items()}
        return TactileImage(
            layers=dim,
            normals=image.normals,
            contact_mask=image.contact_mask,
            points=image.points,
        )


def test_a_sensor_that_lost_two_colours_reads_worse(lambertian: Any) -> None:
    dim = DimSensor(lambertian)
    taken: list[tuple[int, int, int]] = []
    found = verify(
        (lambertian, dim),
        SETTINGS,
        names=("bright", "dim"),
        progress=lambda *each: taken.append(each),
    )
    assert found.verdict == WORSE
    assert found.in_words().startswith("dim reads worse")
    normals = found.normal_change
    assert normals.change > 3.0
    assert 0.0 < normals.low < normals.change < normals.high
    assert normals.before < found.flat[0] / 2  # reading nothing is far worse than three lights
    assert found.views[0] == found.views[1]
    assert taken[-1] == (1, 14, 14)
    values = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert values["verdict"] == "worse"
    assert values["before"]["name"] == "bright"
    assert set(values["objects"]) == set(FEW)


def test_a_sensor_is_not_better_than_itself(lambertian: Any) -> None:
    # Whatever the readers learn, both sensors read the same: few presses are as good as many.
    reading = replace(READING, presses=3)
    settings = VerificationSettings(FEW, places=1, readers=2, reading=reading)
    found = verify((lambertian, lambertian), settings)
    assert found.normal_change.change == 0.0
    assert found.verdict == INCONCLUSIVE
    assert "inconclusive" in found.in_words()


def test_an_interrupted_verification_continues_where_it_was(
    lambertian: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Balls and objects that were read are not pressed again, and the result is the same."""
    objects, reading = FEW[:2], replace(READING, presses=3, method="table")
    settings = VerificationSettings(objects, places=1, readers=1, reading=reading)
    pair = (lambertian, lambertian)
    pressed = []
    take = CalibratedSensor._render

    def counted(sensor: CalibratedSensor, contacts: Any) -> TactileImage:
        pressed.extend(contacts)
        return take(sensor, contacts)

    def stop(side: int, done: int, count: int) -> None:
        if done == count - 1:  # the last object of the first sensor
            raise KeyboardInterrupt

    monkeypatch.setattr(CalibratedSensor, "_render", counted)
    with pytest.raises(KeyboardInterrupt):
        verify(pair, settings, progress=stop, kept=KeptArrays(tmp_path / "presses"))
    before = len(pressed)
    assert before >= reading.presses + 1
    found = verify(pair, settings, kept=KeptArrays(tmp_path / "presses"))
    # Both sensors are the same, so that the second one finds everything.
    assert len(pressed) == before + 1
    whole = verify(pair, settings)
    assert found.to_dict() == whole.to_dict()
    for one, other in zip(found.pictures[objects[0]], whole.pictures[objects[0]], strict=True):
        assert (one.picture == other.picture).all()
        np.testing.assert_array_equal(one.angles, other.angles)


def test_presses_are_alike_in_both_and_not_too_deep(mini: OpticalModel) -> None:
    chosen = choose_presses((mini, mini), list(OBJECTS), 2, seed=3)
    assert chosen.same_places
    assert chosen.scale == 1.0
    assert len(chosen.presses) == 2 * len(OBJECTS)
    places = np.array([press.contacts[0].point for press in chosen.presses])
    away, _ = cKDTree(places).query(places, k=2)
    assert away[:, 1].min() > 0.8  # spread over 260 mm^2
    for press in chosen.presses:
        first, second = press.contacts
        assert first == second
        # The gel is thick enough for far more.
        mini.place(replace(first, depth=first.depth / MOST_DEEP))


def test_presses_fill_a_tall_view_but_its_border(mini: OpticalModel) -> None:
    tall = set_value(set_value(mini.design, "camera.fov", 45.0), "camera.resolution", [60, 80])
    model = OpticalModel(tall)
    seen = model.chief_rays((60, 80)).points
    sides = np.sort(np.ptp(seen.reshape(-1, 3)[:, :2], axis=0))
    chosen = choose_presses((model, model), ["nut", "bean", "wedge"], 10, seed=0)
    places = np.array([press.contacts[0].point for press in chosen.presses])
    border = np.concatenate([seen[0], seen[-1], seen[:, 0], seen[:, -1]])
    away, _ = cKDTree(border).query(places)
    pixel = sides[0] / 60
    assert away.min() > VIEW_RIM * sides[0] - pixel
    # Places between these borders span 0.7 of the height.
    assert np.ptp(places[:, 1]) > 0.6 * sides[1]


def test_presses_are_less_deep_where_the_gel_is_thin() -> None:
    thin = OpticalModel(gelsight_mini_ideal(gel_thickness=1.2))
    chosen = choose_presses((thin, thin), ["wedge"], 2, seed=0)
    for press in chosen.presses:
        assert press.contacts[0].depth <= MOST_DEEP * 1.2
        assert press.contacts[0].depth < OBJECTS["wedge"].depth


def test_objects_are_scaled_to_what_the_camera_sees() -> None:
    narrow = OpticalModel(set_value(load("gelsight-mini-ideal"), "camera.fov", 20.0))
    chosen = choose_presses((narrow, narrow), ["coin", "nut"], 1, seed=0)
    rays = narrow.chief_rays((64, 48))
    seen = np.ptp(rays.points[rays.hit], axis=0)
    assert chosen.scale < 1.0
    assert chosen.scale * max(OBJECTS["coin"].size) == pytest.approx(
        0.8 * np.sort(seen)[1], rel=0.1
    )


def test_sensors_with_other_skins_are_pressed_at_places_of_their_own(
    mini: OpticalModel, cylindrical_mini: OpticalModel
) -> None:
    chosen = choose_presses((mini, cylindrical_mini), ["coin", "nut"], 1, seed=0)
    assert not chosen.same_places
    for press in chosen.presses:
        for model, contact in zip((mini, cylindrical_mini), press.contacts, strict=True):
            place = model.surface.nearest(contact.point).point
            np.testing.assert_allclose(place, contact.point, atol=1e-6)
        assert press.contacts[0].depth == press.contacts[1].depth


def _reading(points: np.ndarray, angle: float) -> PressReading:
    count = len(points)
    return PressReading(
        points=points,
        areas=np.full(count, 0.5),
        angles=np.full((1, count), angle),
        depths=np.full((1, count), angle / 100),
        flat_angles=np.full(count, 30.0),
        flat_depths=np.full(count, 0.6),
    )


def test_what_only_the_other_camera_sees_counts_as_read_flat() -> None:
    grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [0.0]), axis=-1).reshape(-1, 3)
    half = grid[grid[:, 0] < 5.0]
    trees = [cKDTree(grid), cKDTree(half)]
    normals, depths = whole_errors((_reading(grid, 4.0), _reading(half, 2.0)), trees, 0.4)
    assert normals[0] == pytest.approx([4.0])
    assert normals[1] == pytest.approx([(2.0 + 30.0) / 2])
    assert depths[1] == pytest.approx([(0.02 + 0.6) / 2])
    none = _reading(grid[:0], 0.0)
    normals, _ = whole_errors((_reading(grid, 4.0), none), [cKDTree(grid), cKDTree(half)], np.inf)
    assert normals[1] == pytest.approx([30.0])


def test_a_press_that_no_camera_sees_is_told_before_anything_is_rendered(
    lambertian: Any,
) -> None:
    """With five by four pixels in a picture, the dots of the braille lie between pixels."""
    few = replace(READING, resolution=(5, 4), seed=0)
    taken: list[tuple[int, int, int]] = []
    with pytest.raises(TaskError, match="no camera sees the braille where it presses"):
        verify(
            (lambertian, lambertian),
            VerificationSettings(("braille",), places=4, readers=1, reading=few),
            progress=lambda *each: taken.append(each),
        )
    assert taken == []


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"objects": ("coyn",)}, "no object 'coyn'"),
        ({"objects": ()}, "none is"),
        ({"objects": ("coin", "coin")}, "twice"),
        ({"places": 0}, "0 places"),
    ],
)
def test_strange_settings_are_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(TaskError, match=words):
        VerificationSettings(**given)
