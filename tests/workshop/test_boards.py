"""Boards: which LEDs share one, and what their makers read."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from optisense import sensors
from optisense.design import Light, SensorDesign
from optisense.design.lights import frame_of
from optisense.sensors.from_meshes._pick_and_place import read_pick_and_place
from optisense.sensors.from_meshes._strips import from_table
from optisense.sensors.from_meshes.recipe_lights import FromTable
from optisense.workshop import bill_of_materials, export, placements
from optisense.workshop._boards import boards_of


@pytest.fixture(scope="module")
def tip() -> SensorDesign:
    return sensors.gelsight360()


def test_both_faces_of_a_board_are_its_two_layers(tip: SensorDesign) -> None:
    """Eight groups on four boards: lg8 and lg1, lg2 and lg3, ... and the ring on one of its own."""
    on = {(led.board, led.layer, led.group) for led in placements(tip)}
    assert on == {
        (1, "top", "lg1"), (1, "bottom", "lg8"), (2, "top", "lg2"), (2, "bottom", "lg3"),
        (3, "top", "lg4"), (3, "bottom", "lg5"), (4, "top", "lg6"), (4, "bottom", "lg7"),
        (5, "top", "base"),
    }  # fmt: skip


def test_leds_far_apart_or_face_to_face_have_boards_of_their_own() -> None:
    def boards(*lights: tuple[tuple[float, float, float], tuple[float, float, float]]) -> list[int]:
        return [each.board for each in boards_of([Light(position=p, direction=d)
                                                  for p, d in lights])]  # fmt: skip

    up, down = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
    assert boards(((0, 0, 0), up), ((14, 0, 0), up), ((28, 0, 0), up)) == [1, 1, 1]
    assert boards(((0, 0, 0), up), ((16, 0, 0), up)) == [1, 2]
    assert boards(((0, 0, 3), up), ((0, 0, 0), down)) == [1, 1]  # back to back
    assert boards(((0, 0, 0), up), ((0, 0, 3), down)) == [1, 2]  # face to face
    assert boards(((0, 0, 30), up), ((0, 0, 0), down)) == [1, 2]
    assert boards(((0, 0, 3), up), ((9, 0, 0), down)) == [1, 2]  # beside one another
    assert boards(((0, 0, 5), up), ((9, 4, 5), (0, 0, 7))) == [1, 1]
    assert boards(((0, 0, 5), up), ((9, 4, 5.5), up)) == [1, 2]  # in two planes
    tilted = ((9, 4, 5), (0.1, 0, 1))
    assert boards(((0, 0, 5), up), tilted, ((0, 0, 5), up)) == [1, 2, 1]


@pytest.mark.parametrize("name", ["digit", "gelbelt", "gelsight360", "gelsight-mini-ideal"])
def test_position_files_give_places_and_directions_back(name: str, tmp_path: Path) -> None:
    """Both tables of a board, read as those of any program and laid into the sensor again."""
    design = sensors.build(name)
    files = {file.name: file for file in export(design, tmp_path, [])}
    leds = placements(design)
    assert [led.position for led in leds] == [
        light.position for group in design.lights.values() for light in group.lights
    ]
    lights = [light for group in design.lights.values() for light in group.lights]
    for board in {led.board for led in leds}:
        first = next(led for led in leds if led.board == board)
        right, _, forward = frame_of(lights[int(first.designator[1:]) - 1].direction, None)
        height = float(np.dot(first.position, forward))
        frame = FromTable(
            file="f",
            origin=tuple((height * forward).tolist()),
            right=tuple(right.tolist()),
            normal=tuple(forward.tolist()),
            gap=0.0,
        )
        own = [led for led in leds if led.board == board]
        for file in (f"board-{board}.pos", f"board-{board}-cpl.csv"):
            table, notes = read_pick_and_place(files[file])
            assert notes == []
            assert list(table) == [led.designator for led in own]
            for read, led in zip(from_table(frame, table), own, strict=True):
                np.testing.assert_allclose(read.direction, led.direction, atol=1e-5)
                light = lights[int(led.designator[1:]) - 1]
                turned = frame_of(light.direction, None)[1] if light.up is None else light.up
                np.testing.assert_allclose(np.cross(read.up or (0, 0, 0), turned), 0.0, atol=1e-3)
                # The bottom's windows are a board and two LEDs below the top's.
                across = np.array(read.position) - np.array(led.position)
                np.testing.assert_allclose(across - (across @ forward) * forward, 0.0, atol=2e-4)
                assert led.layer == "bottom" or abs(across @ forward) < 2e-4


def test_the_tables_for_jlcpcb(tip: SensorDesign, tmp_path: Path) -> None:
    files = {file.name: file for file in export(tip, tmp_path, [])}
    rows = list(csv.DictReader(files["board-1-bom.csv"].open(encoding="utf-8")))
    assert [row["Comment"] for row in rows] == ["smd-0805 green", "smd-0805 green"]
    assert rows[0]["Designator"] == "D1,D2,D3,D4"
    assert rows[0]["Part number"] == "17-21/GHC-XS1T2M/3T"
    assert rows[0]["Footprint"] == "LED_1.25x2mm"
    places = list(csv.DictReader(files["board-1-cpl.csv"].open(encoding="utf-8")))
    assert list(places[0]) == ["Designator", "Mid X", "Mid Y", "Layer", "Rotation"]
    assert [row["Layer"] for row in places] == ["Top"] * 4 + ["Bottom"] * 4
    assert all(row["Mid X"].endswith("mm") for row in places)


def test_the_outline_is_around_all_bodies(tmp_path: Path) -> None:
    design = sensors.gelsight_mini_ideal()
    files = {file.name: file for file in export(design, tmp_path, [])}
    pairs = files["board-1.dxf"].read_text().split()
    numbers = {code: [float(pairs[k + 1]) for k in range(0, len(pairs) - 1, 2) if pairs[k] == code]
               for code in ("10", "20")}  # fmt: skip
    assert (max(numbers["10"]) - min(numbers["10"])) == pytest.approx(4 * 4.0 + 3.5 + 2.0)
    assert (max(numbers["20"]) - min(numbers["20"])) == pytest.approx(3.5 + 2.0)


def test_designators_of_the_bill_are_those_of_the_table(tip: SensorDesign) -> None:
    lights = [item for item in bill_of_materials(tip).items if item.kind == "light"]
    assert [item.designators for item in lights][:2] == ["D1-D4", "D5-D8"]
    for item in lights:
        first, last = item.designators.split("-")
        groups = {
            led.group for led in placements(tip)
            if int(first[1:]) <= int(led.designator[1:]) <= int(last[1:])
        }  # fmt: skip
        assert groups == {item.used_for}
