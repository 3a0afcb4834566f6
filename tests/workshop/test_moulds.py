"""Moulds: what they leave free is the gel, and they come off it where they say so."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from optisense import sensors
from optisense.cli import app
from optisense.design import Role, SensorDesign
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh
from optisense.geometry.solids import as_manifold
from optisense.workshop._moulds import (
    CLEARANCE,
    FUNNEL,
    LEVELS,
    PIN,
    PIN_HEIGHT,
    SIDES,
    SPRUE,
    VENT,
    WALL,
    Mould,
    mould_of,
    moulds,
)
from optisense.workshop.shapes import Shape, shapes

UP = np.array([0.0, 0.0, 1.0])
ROUND = 0.5 * SIDES * math.sin(2.0 * math.pi / SIDES)  # area of a polygon of radius 1


def gel(mesh: trimesh.Trimesh) -> Shape:
    made = TriangleMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32))
    return Shape("gel", Role.ELASTOMER, "silicone", made.welded())


def cone(low: float, high: float, height: float = 5.0) -> Shape:
    """A round gel of radii at its bottom and its top."""
    profile = [[0.0, 0.0], [low, 0.0], [high, height], [0.0, height]]
    return gel(trimesh.creation.revolve(profile, sections=64))


def shell(inner: float = 8.0, outer: float = 11.0, length: float = 36.0) -> Shape:
    """Half a tube along x, whose feet stand on z = 0."""
    import shapely

    ring = shapely.Point(0.0, 0.0).buffer(outer) - shapely.Point(0.0, 0.0).buffer(inner)
    half = ring & shapely.box(-outer, 0.0, outer, outer)
    body = trimesh.creation.extrude_polygon(half, length)  # along z, upper half along y
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return gel(trimesh.Trimesh((body.vertices - [0.0, 0.0, 0.5 * length]) @ turn.T, body.faces))


def common(one: TriangleMesh, other: TriangleMesh) -> float:
    """mm^3 that two bodies share."""
    return float((as_manifold(one) ^ as_manifold(other)).volume())


@pytest.fixture(scope="module")
def digit() -> SensorDesign:
    return sensors.digit()


@pytest.fixture(scope="module")
def of_digit(digit: SensorDesign) -> Mould:
    (made,) = moulds(shapes(digit))
    return made


def test_the_halves_leave_the_gel_free(digit: SensorDesign, of_digit: Mould) -> None:
    (body,) = [shape for shape in shapes(digit) if shape.role is Role.ELASTOMER]
    for half in (of_digit.front, of_digit.back):
        assert half.is_closed and half.volume > 0.0
        assert common(half, body.mesh) < 1e-6 * half.volume
    # No film is left across the cavity where the back of the gel is flat.
    assert len(as_manifold(of_digit.front).decompose()) == 1
    assert common(of_digit.front, of_digit.back) < 1e-6 * of_digit.front.volume
    # A smaller block around the gel is filled by the halves, but for the gel itself.
    low, high = body.mesh.bounds
    block = trimesh.creation.box(bounds=[low - [2, 2, 0], high + [2, 2, 2]])
    around = gel(block).mesh
    free = around.volume - common(around, of_digit.front) - common(around, of_digit.back)
    assert free == pytest.approx(abs(body.mesh.volume), rel=1e-4)


def test_the_volumes_are_those_of_box_holes_and_pins() -> None:
    """A block of 20 x 12 x 4 mm parts at its back."""
    made = mould_of(gel(trimesh.creation.box((20.0, 12.0, 4.0))), UP)
    floor = (20.0 + 2.0 * WALL) * (12.0 + 2.0 * WALL)
    hole = ROUND * (0.5 * PIN + CLEARANCE) ** 2 * (PIN_HEIGHT + CLEARANCE)
    front = floor * (4.0 + WALL) - 960.0 - 3.0 * hole
    assert made.front.volume == pytest.approx(front, rel=1e-6)
    pins = 3.0 * ROUND * (0.5 * PIN) ** 2 * PIN_HEIGHT
    # The sprue is cut from 1 mm below the mould to 0.08 mm inside the gel.
    length = WALL + 1.0 + 0.08

    def radius(at: float) -> float:
        return 0.5 * (FUNNEL + (SPRUE - FUNNEL) * at / length)

    first, last = radius(1.0), radius(1.0 + WALL)
    funnel = ROUND * WALL * (first**2 + first * last + last**2) / 3.0
    back = floor * WALL + pins - funnel - ROUND * (0.5 * VENT) ** 2 * WALL
    assert made.back.volume == pytest.approx(back, rel=1e-6)


@pytest.mark.parametrize("turn", [90, 180, 270])
def test_a_turned_half_does_not_fit(turn: int) -> None:
    """A pin of the back is where the front has no hole, also where the gel is square."""
    made = mould_of(gel(trimesh.creation.box((12.0, 12.0, 4.0))), UP)
    turned = trimesh.transformations.rotation_matrix(math.radians(turn), UP)[:3, :3]
    front = made.front.with_vertices(made.front.vertices @ turned.T)
    assert common(made.front, made.back) < 1e-6
    assert common(front, made.back) > 0.9 * ROUND * (0.5 * PIN) ** 2 * PIN_HEIGHT


@pytest.mark.parametrize("lift", [0.5, 3.0, 6.0])
def test_a_half_with_draft_comes_off(lift: float) -> None:
    body = cone(8.0, 7.0)
    made = mould_of(body, UP)
    assert made.upright == made.undercut == 0.0
    lifted = made.front.with_vertices(made.front.vertices + lift * UP)
    assert common(lifted, body.mesh) < 1e-6 * body.mesh.volume
    assert "draft of 1 degree or more" in made.notes()[0]


def test_upright_sides_and_undercuts_are_told() -> None:
    upright = mould_of(cone(8.0, 8.0), UP)
    side = 2.0 * 64 * 8.0 * math.sin(math.pi / 64) * 5.0
    assert upright.upright == pytest.approx(side, rel=1e-6)
    assert upright.undercut == 0.0 and "release agent" in upright.notes()[0]
    narrow = mould_of(cone(8.0, 7.0), -UP)  # pulled the other way, it parts at its front
    assert narrow.undercut == 0.0
    waist = [[0.0, 0.0], [8.0, 0.0], [6.0, 2.5], [8.0, 5.0], [0.0, 5.0]]
    made = mould_of(gel(trimesh.creation.revolve(waist, sections=64)), UP)
    half_way = 6.0 + 8.0
    slope = 64 * math.sin(math.pi / 64) * half_way  # sum of the sides of both rings, halved
    height = math.hypot(2.5, 2.0 * math.cos(math.pi / 64))
    assert made.undercut == pytest.approx(slope * height, rel=1e-6)
    assert "undercut" in made.notes()[0]


def test_areas_have_no_exponent() -> None:
    made = mould_of(cone(8.0, 8.0), UP)
    for area, text in ((0.0123, "0.0123"), (31.42, "31.4"), (314.2, "314"), (3141.6, "3,142")):
        assert f" {text} mm^2 of" in replace(made, upright=area).notes()[0]
        assert f" {text} mm^2 of" in replace(made, undercut=area).notes()[0]


@pytest.mark.parametrize("distance", [0.0, 0.3, 4.0, 12.0])
def test_both_halves_come_off_a_gel_that_wraps_around_a_core(distance: float) -> None:
    """They part at the feet, and the back half fills the space between these."""
    body = shell()
    made = mould_of(body, UP)
    assert made.undercut == 0.0
    assert made.front.bounds[0, 2] == pytest.approx(0.0, abs=1e-9)
    for half, way in ((made.front, UP), (made.back, -UP)):
        assert len(as_manifold(half).decompose()) == 1
        moved = half.with_vertices(half.vertices + distance * way)
        assert common(moved, body.mesh) < 1e-6 * body.mesh.volume
    lifted = made.front.with_vertices(made.front.vertices + distance * UP)
    assert common(lifted, made.back) < 1e-6 * body.mesh.volume
    core = as_manifold(made.back).trim_by_plane((0.0, 0.0, 1.0), 1e-3).volume()
    pins = 3.0 * ROUND * (0.5 * PIN) ** 2 * PIN_HEIGHT
    assert core == pytest.approx(0.5 * math.pi * 8.0**2 * 36.0 + pins, rel=3e-3)


def test_a_pocket_in_the_back_belongs_to_the_back_half() -> None:
    """No block of the front half remains in it, which the gel would hold."""
    block = trimesh.creation.box((20.0, 12.0, 4.0))
    pocket = trimesh.creation.box(bounds=[[-4.0, -3.0, -3.0], [4.0, 3.0, 0.0]])
    made = mould_of(gel(trimesh.boolean.difference([block, pocket])), UP)
    assert made.undercut == 0.0
    assert [len(as_manifold(half).decompose()) for half in (made.front, made.back)] == [1, 1]
    assert made.back.bounds[1, 2] == pytest.approx(-2.0 + PIN_HEIGHT)
    core = as_manifold(made.back).trim_by_plane((0.0, 0.0, 1.0), -2.0 + 1e-3).volume()
    pins = 3.0 * ROUND * (0.5 * PIN) ** 2 * PIN_HEIGHT
    assert core == pytest.approx(8.0 * 6.0 * 2.0 + pins, rel=1e-3)


def test_a_ball_parts_at_its_equator() -> None:
    made = mould_of(gel(trimesh.creation.icosphere(subdivisions=3, radius=10.0)), UP)
    assert made.front.bounds[0, 2] == pytest.approx(0.0, abs=20.0 / LEVELS)
    assert made.undercut < 20.0 * math.pi * 20.0 / LEVELS  # the zone between two levels


def holes(back: TriangleMesh, height: float) -> list[np.ndarray]:
    """Outlines (n, 2) of the holes of a half at a height, mm, the largest first."""
    found = [np.asarray(each) for each in as_manifold(back).slice(height).to_polygons()]
    return sorted(found, key=lambda each: float(np.ptp(each[:, 0])), reverse=True)[1:]


def test_a_gel_with_two_feet_has_its_sprue_and_its_vent_on_different_ones() -> None:
    made = mould_of(shell(), UP)
    sprue, vent = holes(made.back, -1e-3)
    for hole, largest in ((sprue, SPRUE), (vent, VENT)):
        assert 0.5 * largest < np.ptp(hole[:, 0]) <= largest
        assert np.abs(hole[:, 1]).min() > 8.0 and np.abs(hole[:, 1]).max() < 11.0
    sides = np.array([hole.mean(axis=0) for hole in (sprue, vent)])
    assert (sides[0] * sides[1] < 0.0).all()  # on different feet, and at different ends
    assert len(made.notes()) == 1


def test_a_back_without_room_for_a_vent_tells_where_to_drill_one() -> None:
    made = mould_of(gel(trimesh.creation.icosphere(subdivisions=3, radius=10.0)), UP)
    assert len(holes(made.back, made.back.bounds[0, 2] + 1.0)) == 1
    assert "drill one of 2 mm through gel-mould-back" in made.notes()[1]


def test_a_turned_sensor_has_the_same_mould(of_digit: Mould, digit: SensorDesign) -> None:
    turn = trimesh.transformations.rotation_matrix(0.7, [1.0, 2.0, 0.5])[:3, :3]
    made = [
        replace(each, mesh=each.mesh.with_vertices(each.mesh.vertices @ turn.T))
        for each in shapes(digit)
    ]
    (turned,) = moulds(made)
    np.testing.assert_allclose(turned.pull, turn @ of_digit.pull, atol=1e-9)
    assert turned.front.volume == pytest.approx(of_digit.front.volume, rel=1e-4)
    assert turned.upright == pytest.approx(of_digit.upright, rel=1e-3)


def test_what_has_no_mould_says_why() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    skin = Shape("skin", Role.SENSING_SURFACE, None, gel(ball).mesh)
    with pytest.raises(DesignError, match="faces all sides"):
        moulds([skin, gel(ball)])
    sheet = TriangleMesh(np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(DesignError, match="encloses no volume"):
        mould_of(Shape("gel", Role.ELASTOMER, None, sheet), UP)


def test_the_command_writes_the_halves_and_tells_the_draft(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = CliRunner().invoke(
        app, ["export", "gelsight-mini-ideal", "--moulds", "-f", "stl", "-f", "3mf", "-o", str(out)]
    )
    assert done.exit_code == 0, done.output
    assert "gel-mould: 391 mm^2 of the gel's sides" in done.output
    names = {file.name for file in out.iterdir()}
    assert {"gel-mould-front.stl", "gel-mould-back.stl", "gelsight-mini-ideal-moulds.3mf"} <= names
    front = trimesh.load(out / "gel-mould-front.stl")
    assert front.is_watertight
    plain = CliRunner().invoke(
        app, ["export", "gelsight-mini-ideal", "-o", str(tmp_path / "plain")]
    )
    assert plain.exit_code == 0
    assert not [file for file in (tmp_path / "plain").iterdir() if "mould" in file.name]
