"""The case rendered by Mitsuba's ``path`` integrator."""

from __future__ import annotations

import time
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks.case import RESOLUTION, Case, ball
from benchmarks.mitsuba_export import Colour, mitsuba_scene
from benchmarks.snapshots import Snapshot, due_times
from optisense import OpticalModel
from optisense.geometry import Contact
from optisense.optics.scene import assembly
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surfaces import Region

PASS_SAMPLES = 16
"""Number of samples per pixel in one call of Mitsuba, few enough for snapshots near their times."""


def pieces_with(
    model: OpticalModel, contact: Contact
) -> tuple[assembly.Assembly, list[Piece], list[Colour]]:
    """Return the assembly of the sensor, the pieces of the sensor and the indenter, and the flux
    (mW) of each light of a group per channel.
    """
    design = model.design
    parts = assembly.assemble(design)
    coat = assembly.coating_surface(design.coating, parts.ior_before, Region.INDENTER)
    pieces = [*parts.pieces, assembly.indenter_piece(model.place(contact), coat)]
    return parts, pieces, [tuple(design.lights[g].channel_flux().tolist()) for g in parts.groups]


def scene_with(
    model: OpticalModel, contact: Contact, size: tuple[int, int], samples: int
) -> dict[str, Any]:
    """Return the sensor and the indenter for `mi.load_dict`, seen by the sensor's camera."""
    parts, pieces, flux = pieces_with(model, contact)
    camera = model.camera(size)
    return mitsuba_scene(pieces, parts.emitters, camera, flux, samples=samples)


def render_path(case: Case, budget: float) -> list[Snapshot]:
    """Return images after the whole budget (s) and after halves of it.

    Kernels are compiled before the time begins.
    """
    scene = mi.load_dict(scene_with(case.model, ball(), RESOLUTION, PASS_SAMPLES))
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
