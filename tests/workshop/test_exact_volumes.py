"""Volumes of exact bodies against the closed forms of the dimensions that they were built with."""

from __future__ import annotations

import math

import numpy as np
import pytest
from step_extra import needs_step

from optisense import sensors
from optisense.design import SensorDesign
from optisense.workshop.shapes import Shape, shapes

SAME_VOLUME = 1e-4
"""Share by which an exact body's volume may differ from that of the design's dimensions; the
meshes, whose corners lie on the round faces, have up to 1.3e-3 less."""


def exact_volume(shape: Shape) -> float:
    """mm3 by Open CASCADE's own integrals, which are right for planes, cylinders and spheres."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from optisense.workshop.exact_shapes import exact_body

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
