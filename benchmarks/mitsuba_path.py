"""The case rendered by Mitsuba's ``path`` integrator."""

from __future__ import annotations

import time

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks.case import RESOLUTION, Case, ball
from benchmarks.mitsuba_export import mitsuba_scene
from benchmarks.snapshots import Snapshot, due_times
from optisense.optics.scene import assembly
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surfaces import Region

PASS_SAMPLES = 16
"""Number of samples per pixel in one call of Mitsuba, few enough for snapshots near their times."""
DEPTH = 32
"""Largest number of surfaces of a path; longer paths carry less than 0.1 % of the light."""


def case_pieces(case: Case) -> tuple[assembly.Assembly, list[Piece]]:
    """Return the assembly of the sensor, and the pieces of the sensor and the ball."""
    model = case.model
    parts = assembly.assemble(model.design)
    coat = assembly.coating_surface(
        model.design.coating,
        parts.ior_before,
        Region.INDENTER,
    )
    return parts, [*parts.pieces, assembly.indenter_piece(model.place(ball()), coat)]


def render_path(case: Case, budget: float) -> list[Snapshot]:
    """Return images after the whole budget (s) and after halves of it.

    Kernels are compiled before the time begins.
    """
    model = case.model
    parts, pieces = case_pieces(case)
    flux = [tuple(model.design.lights[name].channel_flux().tolist()) for name in parts.groups]
    scene = mi.load_dict(
        mitsuba_scene(
            pieces,
            parts.emitters,
            model.camera(RESOLUTION),
            flux,
            samples=PASS_SAMPLES,
            max_depth=DEPTH,
        )
    )
    width, height = RESOLUTION
    total = np.zeros((height, width, 3))
    np.asarray(mi.render(scene, spp=PASS_SAMPLES, seed=0))
    due, out, passes = due_times(budget), [], 0
    began, cpu = time.perf_counter(), time.process_time()
    while due:
        total += np.asarray(mi.render(scene, spp=PASS_SAMPLES, seed=passes + 1))
        passes += 1
        elapsed = time.perf_counter() - began
        if elapsed >= due[0]:
            image = (total / passes).astype(np.float32)
            spent = time.process_time() - cpu
            out.append(Snapshot(elapsed, spent, image, passes * PASS_SAMPLES))
            due = [at for at in due if at > elapsed]
    dr.sync_thread()
    return out
