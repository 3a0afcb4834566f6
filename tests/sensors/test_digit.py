"""DIGIT: its dimensions, and what its picture shows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optisense import OpticalModel, sensors, set_value
from optisense.design import SensorDesign
from optisense.geometry import TriangleMesh
from optisense.optics import light_at
from optisense.sensors._half_round import HalfRound, stacked

RED, GREEN, BLUE = 0, 1, 2


@pytest.fixture(scope="module")
def design() -> SensorDesign:
    return sensors.digit()


def test_its_parts_have_the_published_sizes(design: SensorDesign) -> None:
    gel, acrylic = design.meshes["gel"], design.meshes["acrylic"]
    np.testing.assert_allclose(np.ptp(gel.bounds, axis=0), (18.4, 25.05, 4.07), atol=0.01)
    np.testing.assert_allclose(np.ptp(acrylic.bounds, axis=0), (18.3, 25.0, 6.15), atol=0.01)
    wall = gel.vertices[np.abs(gel.vertices[:, 0]) > 9.199]
    assert np.ptp(wall[:, 2]) == pytest.approx(1.35)
    dome = gel.vertices[gel.vertices[:, 2] > -1.94 - 1e-9]
    assert np.ptp(dome[:, 0]) == pytest.approx(17.2)
    assert np.ptp(dome[:, 1]) == pytest.approx(23.85, abs=0.01)
    opening = wall_of_the_opening(design.meshes["housing"], acrylic.bounds[1, 2])
    np.testing.assert_allclose(np.ptp(opening, axis=0), (18.58, 25.19), atol=0.06)


def wall_of_the_opening(housing: TriangleMesh, roof: float) -> np.ndarray:
    """(n, 2) mm: places with a corner both at the underside of the roof, at z = `roof`, and at its
    top. The cavity's corners are only at the former, the housing's outer ones only at the latter.
    """
    at = [
        {(x, y) for x, y, z in housing.vertices.round(9) if math.isclose(z, level, abs_tol=1e-9)}
        for level in (roof, housing.bounds[1, 2])
    ]
    return np.array(sorted(at[0] & at[1]))


def test_the_acrylic_has_the_volume_of_its_outline(design: SensorDesign) -> None:
    corners = 2.0 * (1.0 - math.pi / 4.0) * 0.5**2
    area = 18.3 * 15.85 - corners + 0.5 * math.pi * 9.15**2
    assert design.meshes["acrylic"].volume == pytest.approx(6.15 * area, rel=1e-3)


def test_leds_are_34_mm_apart_along_the_edge(design: SensorDesign) -> None:
    """Measured along a fine polygon through the outline, without the builder's own walk."""
    outline = HalfRound(18.3, 15.85, 0.5, 0.5 * (15.85 - 9.2))
    fine = outline.points(0.01)
    lengths = np.linalg.norm(np.roll(fine, -1, axis=0) - fine, axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    at = {}
    for name, group in design.lights.items():
        place = np.array(group.lights[0].position[:2]) + 0.2 * np.array(
            group.lights[0].direction[:2]
        )
        nearest = np.linalg.norm(fine - place, axis=1).argmin()
        assert np.linalg.norm(fine[nearest] - place) < 0.01
        at[name] = along[nearest]
    total = lengths.sum()
    assert at["red"] - at["blue"] == pytest.approx(34.0, abs=0.02)
    assert (at["blue"] - at["green"]) % total == pytest.approx(34.0, abs=0.02)


def shares(design: SensorDesign) -> np.ndarray:
    """(3, 3): rows are where the picture is near the red, green and blue LED; columns the light of
    these LEDs on the skin there, in relation to its mean on the skin in view. Noise: 4 to 12 %."""
    model = OpticalModel(design)
    points = model.chief_rays((90, 120)).points
    near = [points[10:30, 15:35], points[10:30, 55:75], points[95:115, 35:55]]
    found = [light_at(model, tuple(each.mean(axis=(0, 1))), photons=150_000) for each in near]
    return np.array([[group.of_mean for group in each.groups.values()] for each in found])


def test_the_skin_is_brightest_near_each_led(design: SensorDesign) -> None:
    """Red on the left, green on the right of the half round, and blue at the straight end."""
    found = shares(design)
    assert (found.argmax(axis=1) == [RED, GREEN, BLUE]).all()
    assert (found.argmax(axis=0) == [RED, GREEN, BLUE]).all()
    assert (found.diagonal() > 1.4).all()


def test_a_polished_edge_shows_each_led_on_the_far_side() -> None:
    assert (shares(sensors.digit(edge_roughness=0.0)).diagonal() < 1.0)[:2].all()


def test_a_polished_edge_has_no_finish() -> None:
    polished = sensors.digit(edge_roughness=0.0)
    assert polished.parts["acrylic"].faces is None
    assert sensors.check(polished) == []
    assert not any(path.startswith("parts.acrylic.faces") for path in polished.provenance)


def test_all_of_the_edge_is_frosted_and_nothing_else(design: SensorDesign) -> None:
    from optisense.design.part_faces import finished_faces

    acrylic = design.parts["acrylic"]
    mesh = design.meshes["acrylic"]
    assert acrylic.faces is not None
    found = np.concatenate(
        [finished_faces(mesh, finish, name, "") for name, finish in acrylic.faces.items()]
    )
    upright = np.flatnonzero(np.abs(mesh.face_normals[:, 2]) < 1e-6)
    np.testing.assert_array_equal(np.unique(found), upright)


def test_its_dome_bends_in_its_cage(design: SensorDesign) -> None:
    top = design.cages["skin"].index(1, 1, 2)
    taller = set_value(design, f"cages.skin.points[{top}].z", 1.0)
    assert sensors.check(taller) == []
    assert taller.deformed_meshes()["gel"].bounds[1, 2] > 0.2


def test_rings_of_different_lengths_make_a_closed_solid() -> None:
    """A cone frustum of rings of 40 and 13 corners has the volume between its two polygons."""

    def ring(count: int, radius: float, z: float) -> np.ndarray:
        angle = 2.0 * np.pi * np.arange(count) / count
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, z)])

    solid: TriangleMesh = stacked([ring(40, 2.0, 0.0), ring(400, 2.0, 1.0), ring(13, 1.0, 2.0)])
    assert solid.is_closed
    assert solid.volume == pytest.approx(math.pi * (4.0 + (4.0 + 2.0 + 1.0) / 3.0), rel=0.03)
