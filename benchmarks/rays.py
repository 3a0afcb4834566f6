"""Photons and rays per second, compared with the ray tracer alone in the same scene.

    .venv/bin/python -m benchmarks.rays

prints the rays per second of the ray tracer alone, which tells how fast a machine is.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks.case import Case
from benchmarks.timing import timed
from optisense.optics.scene.ray_scene import Ray, RayScene, SurfaceHit
from optisense.optics.transport.photons import Emission, trace_photons

PHOTONS = 1_000_000
"""Number of photons of a timed pass, the default number of an image."""
PURE_RAYS = 4_000_000
"""Number of rays with which the ray tracer alone is timed; they take some tenths of a second."""
RUNS = 5
"""Number of timed runs, whose median is reported."""


def photon_rates(case: Case) -> dict[str, Any]:
    """Return photons and rays per second of the photon pass, and of the ray tracer alone."""
    model = case.model
    table = model.scenes.emitter_table
    per_light = PHOTONS // table.count
    guide = model.guide()

    def trace(seed: int) -> None:
        trace_photons(model.scene, Emission(table, guide, per_light, seed), coloured=False)
        dr.sync_thread()

    trace(0)
    seconds = median(timed(lambda s=s: trace(s)).wall for s in range(1, RUNS + 1))  # type: ignore[misc]
    with _counted() as counter:
        trace(1)
    rays = int(counter[0])
    pure = _pure_rate(model.scene)
    emitted = per_light * table.count
    return {
        "photons_per_s": round(emitted / seconds),
        "rays_per_photon": round(rays / emitted, 2),
        "rays_per_s": round(rays / seconds),
        "pure_rays_per_s": round(pure),
        "share_of_pure_rate": round(rays / seconds / pure, 3),
    }


def _pure_rate(scene: Any) -> float:
    """Return the first hits per second of incoherent rays.

    Origins are uniform in the bounding box of the scene, and directions on the sphere.
    """
    lower, upper = (np.asarray(bound, dtype=float) for bound in scene.bounds)
    rng = np.random.default_rng(0)
    points = lower + rng.random((PURE_RAYS, 3)) * (upper - lower)
    ways = rng.normal(size=(PURE_RAYS, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    origin = mi.Point3f(*(mi.Float(points[:, k].astype(np.float32)) for k in range(3)))
    way = mi.Vector3f(*(mi.Float(ways[:, k].astype(np.float32)) for k in range(3)))
    dr.eval(origin, way)

    def shoot() -> None:
        found = scene.scene.ray_intersect_preliminary(mi.Ray3f(origin, way), coherent=False)
        dr.eval(found.t, found.prim_index)
        dr.sync_thread()

    shoot()
    return PURE_RAYS / median(timed(shoot).wall for _ in range(RUNS))


@contextmanager
def _counted() -> Iterator[mi.UInt32]:
    """Count the photon pass's rays while the context lasts."""
    counter = dr.zeros(mi.UInt32, 1)
    dr.make_opaque(counter)
    original = RayScene.intersect

    def counting(scene: RayScene, ray: Ray) -> SurfaceHit:
        dr.scatter_inc(counter, mi.UInt32(0), ray.active)
        return original(scene, ray)

    RayScene.intersect = counting  # type: ignore[method-assign]
    try:
        yield counter
    finally:
        RayScene.intersect = original  # type: ignore[method-assign]


if __name__ == "__main__":
    print(round(_pure_rate(Case.load().model.scene)))
