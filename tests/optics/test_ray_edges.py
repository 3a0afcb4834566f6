"""Boundaries in a picture: where they lie, what causes them, and how a number follows them."""

from __future__ import annotations

import numpy as np
import pytest
from reference_scenes import diffuse_coating, floor

from optisense.geometry import TriangleMesh
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Surface, SurfaceKind
from optisense.optics.transport._ray_edges import Discontinuity
from optisense.optics.transport.ray_gradient import DifferentiableRays

WIDTH, HEIGHT = 96, 72
HALF = 10.0
"""Half of the width (mm) of the camera's picture on the skin 10 mm below it (90 degrees)."""
PIXEL = 2 * HALF / WIDTH


def camera(x: float = 0.0, fov: float = 90.0) -> RayCamera:
    """Looks down on the skin, image right along +x."""
    return RayCamera((x, 0.0, 10.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), fov, WIDTH, HEIGHT)


def flat(size: tuple[float, float], place: tuple[float, float, float]) -> TriangleMesh:
    mesh = TriangleMesh.grid(size)
    return mesh.with_vertices(mesh.vertices + np.array(place))


def tilted(mesh: TriangleMesh, slope: float) -> TriangleMesh:
    """Raised by `slope` for each mm along x."""
    moved = mesh.vertices.copy()
    moved[:, 2] += slope * moved[:, 0]
    return mesh.with_vertices(moved)


SKIN = floor(diffuse_coating(0.5), 50.0)


def traced(
    mesh: TriangleMesh, surface: Surface, moving: bool = True, at: RayCamera | None = None
) -> DifferentiableRays:
    scene = RayScene([SKIN, Piece("part", mesh.vertices, mesh.faces, surface)])
    return DifferentiableRays(scene, at or camera(), {"part": mesh} if moving else {})


BLOCKER = Surface(SurfaceKind.ABSORBER)


def test_the_edges_of_a_blocker_are_found_to_a_fraction_of_a_pixel() -> None:
    """A square of 3.33 mm, half way down, covers one of 6.66 mm on the skin."""
    of = traced(flat((3.33, 3.33), (0.0, 0.0, 5.0)), BLOCKER)
    edges = of.edges
    assert edges is not None
    assert set(edges.cause.tolist()) == {Discontinuity.EDGE}
    assert set(edges.depth.tolist()) == {0}
    side = np.abs(np.where(edges.along_x, edges.x - WIDTH / 2, edges.y - HEIGHT / 2)) * PIXEL
    assert side == pytest.approx(3.33, abs=2e-3 * PIXEL + 1e-3)
    assert WIDTH * HEIGHT - of.weight.sum() == pytest.approx((6.66 / PIXEL) ** 2, rel=2e-3)


def test_what_a_blocker_covers_changes_as_its_edges_move() -> None:
    mesh = flat((3.33, 3.33), (0.0, 0.0, 5.0))
    of = traced(mesh, BLOCKER)
    back = of.pull_back(weight=np.ones_like(of.weight))
    # A wider one covers a stripe at either side; the shadow is twice as large as the blocker.
    wider = np.sign(mesh.vertices) * [1.0, 0.0, 0.0]
    expected = -2 * 2.0 * 6.66 / PIXEL**2
    assert float((back.parts["part"] * wider).sum()) == pytest.approx(expected, rel=0.03)
    # One moved aside covers as much as before, and one nearer to the camera more.
    assert float(back.parts["part"][:, 0].sum()) == pytest.approx(0.0, abs=0.02 * abs(expected))
    nearer = -(2 * 6.66 * 6.66 / 5.0) / PIXEL**2
    assert float(back.parts["part"][:, 2].sum()) == pytest.approx(nearer, rel=0.03)


def test_a_camera_that_moves_behind_a_blocker_sees_its_edges_move() -> None:
    """A blocker over the right half of the picture, fixed."""
    of = traced(flat((40.0, 80.0), (21.23, 0.0, 5.0)), BLOCKER, moving=False)
    back = of.pull_back(weight=np.ones_like(of.weight))
    # The camera's way along x moves the edge in the picture back by twice as much on the skin.
    assert back.camera[0] == pytest.approx(-2.0 * HEIGHT / PIXEL, rel=0.01)


def test_a_surface_that_cuts_through_another_moves_the_line_where_they_meet() -> None:
    """A ramp that rises out of the skin, 0.4 mm for each mm, and covers what lies behind that."""
    ramp = tilted(flat((60.0, 80.0), (0.0, 0.0, 0.0)), 0.4)
    lowered = ramp.with_vertices(ramp.vertices - [0.0, 0.0, 1.0])
    of = traced(lowered, BLOCKER)
    edges = of.edges
    assert edges is not None
    assert set(edges.cause.tolist()) == {Discontinuity.CROSSING}
    assert (edges.x - WIDTH / 2) * PIXEL == pytest.approx(1.0 / 0.4, abs=5e-3)
    back = of.pull_back(weight=np.ones_like(of.weight))
    # Lower by 1 mm, the line moves 2.5 mm to the right, and more of the skin is seen.
    expected = -(1.0 / 0.4) * HEIGHT / PIXEL
    assert float(back.parts["part"][:, 2].sum()) == pytest.approx(expected, rel=0.01)


def test_the_limit_of_total_reflection_moves_with_a_tilted_interface() -> None:
    """The camera is in glass, the skin behind it: only totally reflected rays arrive there."""
    eta = 1.5
    sheet = flat((200.0, 200.0), (0.0, 0.0, 5.0))
    glass = Surface(SurfaceKind.DIELECTRIC, eta=1.0 / eta)
    behind = flat((400.0, 400.0), (0.0, 0.0, 20.0))
    skin = Piece("skin", behind.vertices, behind.faces[:, ::-1], SKIN.surface)

    def tilted_by(slope: float) -> DifferentiableRays:
        mesh = tilted(sheet, slope)
        scene = RayScene([skin, Piece("part", mesh.vertices, mesh.faces, glass)])
        return DifferentiableRays(scene, camera(), {"part": mesh})

    def column(of: DifferentiableRays) -> np.ndarray:
        return (of.hit.nonzero()[1] + 0.5 - WIDTH / 2) * PIXEL

    def moment(of: DifferentiableRays) -> float:
        return float((of.weight * column(of)).sum())

    of = tilted_by(0.0)
    edges = of.edges
    assert edges is not None
    assert set(edges.cause.tolist()) == {Discontinuity.TOTAL_REFLECTION}
    radius = np.hypot(edges.x - WIDTH / 2, edges.y - HEIGHT / 2) * PIXEL
    assert radius == pytest.approx(10.0 * np.tan(np.arcsin(1.0 / eta)), abs=5e-3)
    way = sheet.vertices[:, :1] * [0.0, 0.0, 1.0]
    slope = float((of.pull_back(weight=column(of)).parts["part"] * way).sum())
    differences = (moment(tilted_by(0.02)) - moment(tilted_by(-0.02))) / 0.04
    assert slope == pytest.approx(differences, rel=0.05)
