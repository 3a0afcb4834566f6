"""Solids to put together, and the chain of media that a ray must meet in them.

The fact that counts: along any straight ray the interfaces form a chain. The medium that the ray
is in is the near side of the next interface, and halfway between two interfaces it is the medium
that belongs there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from optisense.geometry import TriangleMesh
from optisense.geometry.rays import ray_hits
from optisense.optics.scene.media import Interface

GEL, ACRYLIC = 1.41, 1.49

Truth = Callable[[np.ndarray], float]


def box(
    lower: Sequence[float], upper: Sequence[float], divisions: tuple[int, int, int] = (1, 1, 1)
) -> TriangleMesh:
    return TriangleMesh.box(lower, upper, divisions)


def in_box(point: np.ndarray, lower: Sequence[float], upper: Sequence[float]) -> bool:
    return bool((point > lower).all() and (point < upper).all())


def first_of(*boxes: tuple[Sequence[float], Sequence[float], float]) -> Truth:
    """The index in the first of boxes (lower and upper corner, index) that holds a point."""

    def truth(point: np.ndarray) -> float:
        return next((ior for lower, upper, ior in boxes if in_box(point, lower, upper)), 1.0)

    return truth


def ball(radius: float, centre: Sequence[float] = (0, 0, 0), subdivisions: int = 3) -> TriangleMesh:
    import trimesh

    sphere = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return TriangleMesh(sphere.vertices + np.asarray(centre), sphere.faces)


def random_rays(reach: float, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a sphere of radius 3 `reach` through points of a ball of radius `reach`."""
    rng = np.random.default_rng(seed)
    start = rng.normal(size=(count, 3))
    start *= 3 * reach / np.linalg.norm(start, axis=1, keepdims=True)
    target = rng.uniform(-reach, reach, size=(count, 3))
    direction = target - start
    return start, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def check_chain(
    interfaces: list[Interface],
    truth: Truth,
    reach: float = 6.0,
    count: int = 1500,
    margin: float = 1e-4,
    stop: TriangleMesh | None = None,
) -> None:
    """Follow random rays and assert the chain; `stop` is an opaque surface that ends a ray."""
    start, direction = random_rays(reach, count)
    meshes = [face.mesh for face in interfaces]
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    everything = TriangleMesh.joined([TriangleMesh(m.vertices, m.faces) for m in meshes])
    hits = ray_hits(everything, start, direction)
    end = np.full(count, np.inf)
    if stop is not None:
        stopped = ray_hits(stop, start, direction)
        np.minimum.at(end, stopped.ray, stopped.distance)
    crossed = 0
    for ray in range(count):
        mine = (hits.ray == ray) & (hits.distance < end[ray])
        state, here = 1.0, 0.0
        for distance, face in zip(hits.distance[mine], hits.face[mine], strict=True):
            interface = interfaces[owner[face]]
            leaving = everything.face_normals[face] @ direction[ray] > 0
            near, far = interface.ior_inside, interface.ior_outside
            if not leaving:
                near, far = far, near
            place = start[ray] + distance * direction[ray]
            assert near == state, f"ray {ray} at {place}: in {state}, but the face is {interface}"
            if distance - here > margin:
                middle = start[ray] + (0.53 * here + 0.47 * distance) * direction[ray]
                assert state == truth(middle), f"ray {ray} at {middle}"
            state, here = far, distance
            crossed += 1
        if end[ray] == np.inf:
            assert state == 1.0, f"ray {ray} ends inside a solid"
    assert crossed > count / 20


def pairs(interfaces: list[Interface]) -> set[tuple[str, str]]:
    return {(face.inside, face.outside) for face in interfaces}


def area(interfaces: list[Interface], *names: str) -> float:
    return sum(face.mesh.area for face in interfaces if face.names == names)
