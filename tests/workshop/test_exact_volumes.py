"""Volumes of exact bodies against the closed forms of the dimensions that they were built with."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from step_extra import needs_step

from optisense import sensors
from optisense.design import SensorDesign
from optisense.sensors._digit import CORNERS
from optisense.sensors._gelsight_svelte import BACK_OUTLINE, PALM_OUTLINE
from optisense.sensors._half_round import HalfRound
from optisense.sensors._svelte_profile import FlatMirror, Palm
from optisense.workshop._exact_shapes import _through
from optisense.workshop._recognised import dome
from optisense.workshop.shapes import Shape, shapes

SAME_VOLUME = 1e-4
"""Share by which an exact body's volume may differ from that of the design's dimensions; the
meshes, whose corners lie on the round faces, have up to 1.3e-3 less."""


def exact_volume(shape: Shape) -> float:
    """mm3 by Open CASCADE's own integrals, which are right for planes, cylinders and spheres."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from optisense.workshop._exact_shapes import exact_body

    body = exact_body(shape)
    assert body is not None, shape.name
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(body, found)
    return float(found.Mass())


def parts(design: SensorDesign) -> dict[str, Shape]:
    return {shape.name: shape for shape in shapes(design)}


def rod(outer: float, inner: float, length: float) -> float:
    return math.pi * (outer**2 - inner**2) * length


@needs_step
class TestExactVolumes:
    def test_a_round_fingertip(self) -> None:
        """A straight wall of 20 mm below a hemisphere of 14 mm, in layers of 3 and 2.5 mm."""

        def layer(outer: float, inner: float) -> float:
            return rod(outer, inner, 20.0) + 2.0 / 3.0 * math.pi * (outer**3 - inner**3)

        made = parts(sensors.gelsight360())
        for name, volume in (
            ("gel", layer(14.0, 11.0)),
            ("shell", layer(11.0, 8.5)),
            ("base", rod(14.0, 8.5, 2.0)),
        ):
            assert exact_volume(made[name]) == pytest.approx(volume, rel=SAME_VOLUME), name

    def test_a_belt_on_two_wheels(self) -> None:
        """A straight run of 90 mm, and a quarter turn around each wheel of 25 mm."""
        made = parts(sensors.gelbelt(light_design=1))

        def layer(inner: float, outer: float) -> float:
            return 36.0 * (90.0 * (outer - inner) + math.pi / 2.0 * (outer**2 - inner**2))

        for name, volume in (
            ("tape", layer(25.0, 25.05)),
            ("gel", layer(25.05, 28.05)),
            ("wheels", 2.0 * rod(25.0 - 0.02, 0.0, 36.0)),
        ):
            assert exact_volume(made[name]) == pytest.approx(volume, rel=SAME_VOLUME), name

    def test_the_coat_of_the_belt_is_round_on_both_sides(self) -> None:
        """Two arcs of 28.05 mm, apart: the far face of a mitred mesh ends on another circle."""
        made = parts(sensors.gelbelt())["far-coat"]
        assert made.sheet is not None
        mesh = made.sheet.mesh
        volume = 0.0
        for side in (-1.0, 1.0):
            arc = mesh.vertices[mesh.vertices[:, 0] * side > 0.0][:, [0, 2]]
            arc = arc[np.argsort(arc[:, 1])]
            chord = float(np.linalg.norm(arc[-1] - arc[0]))
            angle = 2.0 * math.asin(chord / 2.0 / 28.05)
            volume += 36.0 * angle / 2.0 * (28.15**2 - 28.05**2)
        assert exact_volume(made) == pytest.approx(volume, rel=SAME_VOLUME)

    def test_a_dome_over_a_half_round(self) -> None:
        """DIGIT: a wall, an edge whose sections are parabolas, and a paraboloid."""
        made = parts(sensors.digit())
        acrylic = HalfRound(18.3, 15.85, CORNERS[1], 0.0)
        assert exact_volume(made["acrylic"]) == pytest.approx(6.15 * area(acrylic), rel=SAME_VOLUME)
        gel, inset = HalfRound(18.4, 15.85, CORNERS[0], 3.325), 0.6
        low, high, rise = 1.35, 4.07 - 1.94, 1.94  # of the edge, from the foot of the gel
        foot, rim = gel.points(0.6), gel.inset(inset).like(gel, 0.6)
        slope = 2.0 * rise * np.linalg.norm(foot - rim, axis=1) / np.linalg.norm(rim, axis=1)
        bend = high - float(slope.mean())
        volume = low * area(gel) + (high - low + 0.5 * rise) * area(gel.inset(inset))
        t, weights = np.polynomial.legendre.leggauss(20)
        for share, weight in zip(0.5 * (t + 1.0), 0.5 * weights, strict=True):
            level = (1 - share) ** 2 * low + 2 * share * (1 - share) * bend + share**2 * high
            near = [area(gel.inset(inset * (share + step) ** 2)) for step in (-1e-4, 1e-4)]
            volume += weight * (level - low) * (near[0] - near[1]) / 2e-4
        found = dome(made["gel"].mesh)
        assert found is not None
        below = volume_below(_through(found)) - found.foot * area(gel)
        assert below == pytest.approx(volume, rel=SAME_VOLUME)

    def test_what_cages_bend(self) -> None:
        """A point that moves by 9 mm has the weight 2 u (1 - u) each way, 1/3 in the mean."""
        made = parts(sensors.gelsight_mini_ideal_spherical())
        flat, bulge = 25.25 * 20.75 * 4.25, 25.25 * 20.75 * 9.0 / 9.0
        assert exact_volume(made["gel"]) == pytest.approx(flat + bulge, rel=SAME_VOLUME)

    def test_a_gel_bent_to_a_cylinder(self) -> None:
        """Three points that move by 6 mm have the weight 2 u (1 - u), 1/3 in the mean."""
        made = parts(sensors.gelsight_mini_ideal_cylindrical())
        expected = 25.25 * 20.75 * (4.25 + 6.0 / 3.0)
        assert exact_volume(made["gel"]) == pytest.approx(expected, rel=SAME_VOLUME)
        assert drawn_volume(made["gel"], axis=1) == pytest.approx(expected, rel=SAME_VOLUME)


@pytest.fixture(scope="module")
def made() -> dict[str, Shape]:
    return parts(sensors.gelsight_svelte())


@pytest.fixture(scope="module")
def palm() -> Palm:
    return Palm.through(PALM_OUTLINE, 0.005)


@pytest.fixture(scope="module")
def body(palm: Palm) -> np.ndarray:
    """Corners (x, z) of Svelte's base and back, from the palm's base around to its tip."""
    m2 = FlatMirror.facing((16.7, -2.8), 22.4, None, palm.offset(3.5))
    behind = m2.ends() + (m2.along[1], -m2.along[0])
    bottom = [(behind[0, 0], BACK_OUTLINE[0][1])]
    ends = palm.points[:1], palm.points[-1:]
    return np.concatenate([ends[0], behind[::-1], bottom, BACK_OUTLINE, ends[1]])


@needs_step
class TestPlatesOfSvelte:
    """Sheets of 1 mm: a curve of length L that turns by the angle A has a parallel curve of the
    length L + A at 1 mm, and L + A / 2 mm2 between the two; corners are mitred."""

    HALF = 12.1
    """Distance from the middle of the finger to the inside of its walls, mm: gel, gap, LED."""

    def turn(self, palm: Palm) -> float:
        angles = np.arctan2(palm.inward[[0, -1], 1], palm.inward[[0, -1], 0])
        return float(angles[1] - angles[0])

    def test_the_gel(self, made: dict[str, Shape], palm: Palm) -> None:
        between = 3.5 * palm.length - 0.5 * 3.5**2 * self.turn(palm)
        assert drawn_volume(made["gel"]) == pytest.approx(20.0 * between, rel=SAME_VOLUME)

    def test_the_curved_mirror_is_a_parabola(self, made: dict[str, Shape]) -> None:
        chord = math.hypot(10.4 - 5.8, 88.2 - 13.3)
        slope = 4.0 * 5.5 / chord  # at its ends, of a sagitta of 5.5 mm
        length = 0.5 * chord * (math.sqrt(1.0 + slope**2) + math.asinh(slope) / slope)
        between = length + math.atan(slope)
        assert drawn_volume(made["M1"]) == pytest.approx(22.0 * between, rel=SAME_VOLUME)

    def test_the_flat_mirror(self, made: dict[str, Shape], palm: Palm) -> None:
        m2 = FlatMirror.facing((16.7, -2.8), 22.4, None, palm.offset(3.5))
        assert made["M2"].volume == pytest.approx(18.0 * m2.length, rel=SAME_VOLUME)

    def test_back_and_base_keep_their_corners(
        self, made: dict[str, Shape], body: np.ndarray
    ) -> None:
        sides = np.diff(body, axis=0)
        lengths = np.linalg.norm(sides, axis=1)
        ways = np.arctan2(sides[:, 1], sides[:, 0])
        turns = (np.diff(ways) + np.pi) % (2.0 * np.pi) - np.pi  # clockwise around the outside
        between = lengths.sum() - np.tan(0.5 * turns).sum()
        wide = 2.0 * (self.HALF + 1.0)
        assert drawn_volume(made["body"]) == pytest.approx(wide * between, rel=SAME_VOLUME)

    def test_the_side_walls(self, made: dict[str, Shape], palm: Palm, body: np.ndarray) -> None:
        x, z = np.concatenate([palm.points[::-1], body[1:-1]]).T
        inside = 0.5 * abs(float(x @ np.roll(z, -1) - z @ np.roll(x, -1)))
        assert drawn_volume(made["side-walls"]) == pytest.approx(2.0 * inside, rel=SAME_VOLUME)

    def test_the_covers_of_the_leds(self, made: dict[str, Shape], palm: Palm) -> None:
        """The bends of palm and inner face cancel, and each of four corners adds 1 mm2."""
        around = 2.0 * palm.length - 3.5 * self.turn(palm) + 2.0 * 3.5 + 4.0
        expected = 2.0 * (self.HALF - 10.0) * around
        assert drawn_volume(made["led-covers"]) == pytest.approx(expected, rel=SAME_VOLUME)


def drawn_volume(shape: Shape, axis: int = 1) -> float:
    """mm3 of a body drawn out along an axis: the mean over its faces across the axis of their area
    times their place, by Gauss's rule along the edges, as Open CASCADE's own integrals over smooth
    walls are off by up to a percent."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    from optisense.workshop._exact_shapes import exact_body

    def each(whole: Any, kind: Any) -> Iterator[Any]:
        explorer = TopExp_Explorer(whole, kind)
        while explorer.More():
            yield explorer.Current()
            explorer.Next()

    body = exact_body(shape)
    assert body is not None, shape.name
    cast = getattr(TopoDS, "Edge_s", None) or TopoDS.Edge
    at, weights = np.polynomial.legendre.leggauss(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    total = 0.0
    point, way = gp_Pnt(), gp_Vec()
    for face in each(body, TopAbs_FACE):
        turned, places = 0.0, []
        for edge in each(face, TopAbs_EDGE):
            curve = BRepAdaptor_Curve(cast(edge))
            sign = -0.5 if edge.Orientation() == TopAbs_REVERSED else 0.5
            cuts = np.linspace(curve.FirstParameter(), curve.LastParameter(), 60)
            half = 0.5 * np.diff(cuts)
            steps = (cuts[:-1, None] + half[:, None] * (at + 1.0)).ravel()
            for step, weight in zip(steps, (half[:, None] * weights).ravel(), strict=True):
                curve.D1(step, point, way)
                p, w = (point.X(), point.Y(), point.Z()), (way.X(), way.Y(), way.Z())
                turned += sign * weight * (p[i] * w[j] - p[j] * w[i])
                places.append(p[axis])
        if np.ptp(places) < 1e-6:
            total += turned * float(np.mean(places))
    return total


def area(outline: HalfRound) -> float:
    """mm2: a half round, a rectangle, and the lack of two rounded corners."""
    lack = (2.0 - 0.5 * math.pi) * outline.corner**2
    return 0.5 * math.pi * outline.radius**2 + outline.width * outline.straight - lack


def volume_below(surface: Any) -> float:
    """mm3 between a B-spline surface and z = 0, by Gauss's rule in each of its spans."""
    from OCP.gp import gp_Pnt, gp_Vec

    def rule(count: int, knot: Callable[[int], float]) -> tuple[np.ndarray, np.ndarray]:
        knots = np.array([knot(k + 1) for k in range(count)])
        at, weights = np.polynomial.legendre.leggauss(4)
        half = 0.5 * np.diff(knots)[:, None]
        return (knots[:-1, None] + half * (at + 1.0)).ravel(), (half * weights).ravel()

    along, up = rule(surface.NbUKnots(), surface.UKnot), rule(surface.NbVKnots(), surface.VKnot)
    total = 0.0
    place, by_u, by_v = gp_Pnt(), gp_Vec(), gp_Vec()
    for v, weight_v in zip(*up, strict=True):
        for u, weight_u in zip(*along, strict=True):
            surface.D1(u, v, place, by_u, by_v)
            turned = by_u.X() * by_v.Y() - by_u.Y() * by_v.X()
            total += weight_u * weight_v * place.Z() * turned
    return total
