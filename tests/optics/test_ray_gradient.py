"""Derivatives of chief rays against central differences, and at places that algebra knows."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.design.lenses import LensDistortion
from optisense.design.lenses.distortion import BrownConrady, KannalaBrandt
from optisense.errors import RenderError
from optisense.geometry import TriangleMesh
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Region, Surface, SurfaceKind
from optisense.optics.transport.ray_gradient import DifferentiableRays

STEP = 0.03
"""mm, about half of what a pixel sees. Weights follow boundaries exactly within a pixel, and to
first order from one to the next: differences over less see the steps."""

CLOSE = 0.015

CANCELS = 0.002
"""Of the rays that arrive: what comes into view on one side leaves it on the other, and only the
sum is compared. A mm, and `unit` times that for what moves rays by as much as `unit` mm."""


def mirror(bend: float = 0.02) -> TriangleMesh:
    """A bent mirror under the camera that looks down on it, tilted to throw rays along +x."""
    flat = TriangleMesh.grid((8.0, 8.0), (24, 24))
    height = bend * (flat.vertices[:, 0] ** 2 + 0.5 * flat.vertices[:, 1] ** 2)
    bent = flat.with_vertices(flat.vertices + height[:, None] * [0.0, 0.0, 1.0])
    turn = np.radians(25.0)
    matrix = [
        [np.cos(turn), 0, np.sin(turn)],
        [0, 1, 0],
        [-np.sin(turn), 0, np.cos(turn)],
    ]
    return bent.transformed(np.array(matrix))


def skin() -> TriangleMesh:
    """The surface that is looked at, on the right."""
    flat = TriangleMesh.grid((14.0, 14.0), (20, 20))
    wave = 0.3 * np.sin(flat.vertices[:, 0] / 3) * np.cos(flat.vertices[:, 1] / 4)
    waved = flat.with_vertices(flat.vertices + wave[:, None] * [0.0, 0.0, 1.0])
    upright = [[0, 0, -1, 14.0], [0, 1, 0, 0], [1, 0, 0, 10.0], [0, 0, 0, 1]]
    return waved.transformed(np.array(upright, dtype=float))


def pane() -> TriangleMesh:
    """A sheet of glass on the way from mirror to skin."""
    flat = TriangleMesh.grid((30.0, 30.0))
    upright = [[0, 0, -1, 8.0], [0, 1, 0, 0], [1, 0, 0, 8.0], [0, 0, 0, 1]]
    return flat.transformed(np.array(upright, dtype=float))


def camera(**changes: object) -> RayCamera:
    usual: dict[str, object] = {
        "position": (0.0, 0.0, 9.0), "direction": (0.0, 0.0, -1.0), "up": (0.0, 1.0, 0.0),
        "fov": 70.0, "width": 192, "height": 144,
    }  # fmt: skip
    return RayCamera(**{**usual, **changes})  # type: ignore[arg-type]


def piece(name: str, mesh: TriangleMesh, surface: Surface) -> Piece:
    smooth = mesh.vertex_normals()
    return Piece(name, smooth.vertices, smooth.faces, surface, smooth.normals)


def rays(
    bent: TriangleMesh | None = None, seen: TriangleMesh | None = None, **changes: object
) -> DifferentiableRays:
    bent, seen = bent or mirror(), seen or skin()
    scene = RayScene(
        [
            piece("mirror", bent, Surface(SurfaceKind.MIRROR)),
            piece("pane", pane(), Surface(SurfaceKind.DIELECTRIC, eta=1.41)),
            piece("skin", seen, Surface(SurfaceKind.OPAQUE, region=Region.SENSING)),
        ]
    )
    return DifferentiableRays(scene, camera(**changes), {"mirror": bent, "skin": seen})


def number(of: DifferentiableRays) -> float:
    """Something that depends on all that rays do."""
    return float((of.weight * of.cosine).sum() + (of.weight * of.points[:, 1] ** 2).sum() / 50)


def gradient(of: DifferentiableRays):  # type: ignore[no-untyped-def]
    points = np.zeros_like(of.points)
    points[:, 1] = of.weight * of.points[:, 1] / 25
    return of.pull_back(of.weight, of.cosine + of.points[:, 1] ** 2 / 50, points)


WAYS = {
    "along": lambda v: np.ones((len(v), 1)) * [0.0, 0.0, 1.0],
    "tilt": lambda v: v[:, :1] * [0.0, 0.0, 0.3],
    "bend": lambda v: (v[:, :1] ** 2 + v[:, 1:2]) * [-0.05, 0.0, 0.1],
    "stretch": lambda v: v * [0.0, 0.2, 0.0],
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("part", ["mirror", "skin"])
def test_a_shape_moved_a_little_changes_the_number_as_its_gradient_says(
    part: str, way: str
) -> None:
    meshes = {"mirror": mirror(), "skin": skin()}
    move = WAYS[way](meshes[part].vertices - meshes[part].vertices.mean(axis=0))

    def at(step: float) -> float:
        moved = meshes[part].with_vertices(meshes[part].vertices + step * move)
        return number(rays(**{"bent" if part == "mirror" else "seen": moved}))

    differences = (at(STEP) - at(-STEP)) / (2 * STEP)
    slope = float((gradient(rays()).parts[part] * move).sum())
    assert slope == pytest.approx(differences, rel=CLOSE, abs=CANCELS * rays().hit.sum())


LENSES = [
    (BrownConrady(k1=-0.15, k2=0.02), "k1", 0.004, 0.02),
    (BrownConrady(k1=-0.15, p1=0.02), "p1", 0.004, 0.02),
    (KannalaBrandt(k1=-0.05), "k1", 0.01, 0.02),
]


@pytest.mark.parametrize(("lens", "name", "step", "unit"), LENSES)
def test_a_lens_bent_a_little_changes_the_number_as_its_gradient_says(
    lens: LensDistortion, name: str, step: float, unit: float
) -> None:
    bent = {"equidistant": lens.projection == "equidistant"}

    def at(change: float) -> float:
        other = lens.model_copy(update={name: getattr(lens, name) + change})
        return number(rays(**bent, distortion=other))

    differences = (at(step) - at(-step)) / (2 * step)
    found = rays(**bent, distortion=lens)
    place = [field for field in type(lens).model_fields if field not in ("kind", "centre")]
    slope = gradient(found).camera[13 + place.index(name)]
    tolerance = CANCELS * found.hit.sum() * unit / step
    assert slope == pytest.approx(differences, rel=0.03, abs=tolerance)


@pytest.mark.parametrize(
    ("name", "value", "step", "unit"),
    [
        ("fov", 70.0, 0.3, 0.02),
        ("position", (0.0, 0.0, 9.0), 0.03, 1.0),
        ("direction", (0, 0, -1), 0.008, 3.0),
    ],
)
@pytest.mark.parametrize("equidistant", [False, True])
def test_a_camera_moved_a_little_changes_the_number_as_its_gradient_says(
    name: str, value: object, step: float, unit: float, equidistant: bool
) -> None:
    way = np.array([0.4, 1.0, 0.3]) if name != "fov" else np.array(1.0)

    def moved(amount: float) -> dict[str, object]:
        after = np.asarray(value) + amount * way
        return {name: float(after) if name == "fov" else tuple(map(float, after))}

    def numbers(**changes: object) -> np.ndarray:
        of = camera(**changes)
        return np.concatenate([of.position, of.axes().ravel(), [of.fov]])

    ahead, behind = moved(step), moved(-step)
    found = number(rays(**ahead, equidistant=equidistant))
    differences = (found - number(rays(**behind, equidistant=equidistant))) / (2 * step)
    back = gradient(rays(equidistant=equidistant)).camera
    slope = float(back @ (numbers(**ahead) - numbers(**behind))) / (2 * step)
    allowed = CANCELS * unit * rays().hit.sum()
    assert slope == pytest.approx(differences, rel=CLOSE, abs=allowed)


def test_moving_everything_together_changes_no_angle() -> None:
    of = rays()
    back = of.pull_back(cosine=np.ones_like(of.cosine))
    # The pane stays behind, but it is a plane and moving along it makes no difference.
    total = sum(slopes.sum(axis=0) for slopes in back.parts.values()) + back.camera[:3]
    assert np.abs(total[1:]).max() < 1e-3 * np.abs(back.camera[:3]).max() + 1e-3


def test_rays_weigh_other_than_one_beside_boundaries_only() -> None:
    of = rays(fov=20.0)
    assert of.hit.all()
    assert of.edges is None
    assert np.all(of.weight == 1.0)
    wide = rays()
    assert wide.edges is not None
    assert wide.weight.min() < 0.6
    assert wide.weight.max() > 1.4


def test_cosines_and_points_are_those_of_the_chief_rays() -> None:
    from optisense.optics.transport.chief_rays import trace_chief_rays

    of = rays()
    traced = trace_chief_rays(of._scene, camera())
    assert np.array_equal(traced.hit, of.hit)
    assert of.cosine == pytest.approx(traced.incidence[traced.hit], abs=2e-5)
    assert of.points == pytest.approx(traced.points[traced.hit], abs=2e-4)


def test_a_part_that_is_no_surface_is_refused() -> None:
    scene = RayScene([piece("skin", skin(), Surface(SurfaceKind.OPAQUE, region=Region.SENSING))])
    with pytest.raises(RenderError, match="gel"):
        DifferentiableRays(scene, camera(), {"gel": skin()})
