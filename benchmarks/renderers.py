"""Comparison with other renderers on the same scene, at equal error inside the contact."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import luxcore
from benchmarks.case import RESOLUTION, Case, FloatArray, ball, relative_error
from benchmarks.mitsuba_path import pieces_with, render_path
from benchmarks.reference import CACHE, Reference
from benchmarks.snapshots import Snapshot
from optisense.design.colour import encode
from optisense.design.responses import USUAL_RESPONSE
from optisense.mechanics import CONFORMING

MITSUBA = "Mitsuba path"
BUDGET = 60.0
"""Rendering time (s) of each renderer, some 150 times that of our image."""


def compare_renderers(
    case: Case,
    reference: Reference,
    target_error: float,
    our_seconds: float,
    budget: float,
    tell: Callable[[str], None],
) -> dict[str, Any]:
    """Return the time that each renderer needs to reach our error, as plain data for JSON.

    Each image is scaled to the reference's mean inside the contact before its error is measured, so
    that another unit of radiance does not count as an error; the scale is reported. A renderer that
    does not reach the target in its budget (s) gets the time of its last image times (error /
    target)^2. Monte Carlo noise falls at this rate and bias does not, so this favours the other
    renderers.
    """
    ours = case.model.render([ball()], resolution=RESOLUTION, skin=CONFORMING).radiance
    rows: list[dict[str, Any]] = []
    pictures = {"OptiSense": ours}
    for name in [MITSUBA, *luxcore.ENGINES]:
        if name != MITSUBA and find_spec("pyluxcore") is None:
            rows.append({"renderer": name, "failed": "pyluxcore is not installed"})
            continue
        tell(f"renderers: {name}, {budget:.0f} s")
        try:
            snapshots = _render(case, name, budget)
        except RuntimeError as error:
            rows.append({"renderer": name, "failed": str(error)})
            continue
        row = _row(case, reference, snapshots, target_error, our_seconds)
        whole = snapshots[-1].image.mean() / ours.mean()
        row["whole_image_mean_over_ours"] = round(float(whole), 4)
        rows.append({"renderer": name, **row})
        pictures[name] = snapshots[-1].image
    _save_pictures(pictures)
    ratios = [row["time_ratio"] for row in rows if row.get("time_ratio")]
    return {
        "target_error": round(target_error, 5),
        "our_seconds": round(our_seconds, 4),
        "threads": luxcore.THREADS,
        "rows": rows,
        "fastest_other_over_ours": min(ratios) if ratios else None,
    }


def _render(case: Case, name: str, budget: float) -> list[Snapshot]:
    if name == MITSUBA:
        return render_path(case, budget)
    parts, pieces, flux = pieces_with(case.model, ball())
    camera = case.model.camera(RESOLUTION)
    scene = luxcore.plain_scene(pieces, parts.emitters, camera, flux)
    return luxcore.render_luxcore(scene, name, budget)


def _row(
    case: Case, reference: Reference, snapshots: list[Snapshot], target: float, our_seconds: float
) -> dict[str, Any]:
    steps = []
    truth = reference.radiance[case.mask].mean()
    for snapshot in snapshots:
        level = snapshot.image[case.mask].mean()
        if not level > 0:
            continue  # nothing was rendered yet
        scale = float(truth / level)
        error = relative_error(
            snapshot.image * np.float32(scale), reference.radiance, case.mask, reference.noise
        )
        steps.append(
            {
                "wall_s": round(snapshot.seconds, 2),
                "cpu_s": round(snapshot.cpu, 2),
                "samples_per_pixel": snapshot.samples,
                "relative_rms_error": round(error, 5),
                "scale_to_reference": round(scale, 4),
            }
        )
    if not steps:
        return {"failed": "no image within the budget"}
    last = steps[-1]
    reached = [s["wall_s"] for s in steps if s["relative_rms_error"] <= target]
    needed = reached[0] if reached else last["wall_s"] * (last["relative_rms_error"] / target) ** 2
    return {
        "steps": steps,
        "seconds_to_target": round(needed, 2),
        "extrapolated": not reached,
        "time_ratio": round(needed / our_seconds, 1),
    }


def _save_pictures(images: dict[str, FloatArray]) -> None:
    """Write PNG files (h, w, 3) of all renderers with one exposure, each scaled to one mean."""
    import mitsuba as mi

    folder: Path = CACHE / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    ours = images["OptiSense"]
    exposure = USUAL_RESPONSE.auto_exposure(ours)
    for name, image in images.items():
        scale = ours.mean() / max(float(image.mean()), sys.float_info.min)
        shown = encode(image * (scale * exposure))
        mi.Bitmap(np.ascontiguousarray(shown)).write(str(folder / f"{name.replace(' ', '-')}.png"))
