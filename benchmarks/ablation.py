"""Effect of each acceleration and refinement of the optics: each is switched off in turn.

``python -m benchmarks.ablation [--sensor NAME] [--only WORD ...] [--dry]`` writes ablation.json and
ablation.md beside this file. The four built-in sensors, each with a diffuse and with a metallic
coating and a ball pressed in, are compared with progressive photon mapping, which shares the photon
pass and the surfaces with the radiance cache but neither its cells nor its shading. Nothing of the
product is made for this: constants and functions are replaced while an image is rendered.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from scipy.ndimage import uniform_filter

from benchmarks.results import machine, say_if_busy
from optisense import OpticalModel, sensors
from optisense.design import set_value
from optisense.geometry import Contact, Sphere
from optisense.mechanics import CONFORMING

FOLDER = Path(__file__).parent
CACHE = FOLDER / ".cache"
SENSORS = ("gelsight-mini-ideal", "gelsight-svelte", "gelbelt", "gelsight360")
COATINGS = {"diffuse": 0.0, "metallic": 0.6}
"""Specularity (0 to 1) of each coating: no metallic share, and more than half."""
RESOLUTION = (160, 120)
"""Width and height (pixels) of the images, half those of `benchmarks.case`, since eight references
are rendered."""
PHOTONS = 600_000
"""Number of photons of an image, near the 560,000 of `benchmarks.case`."""
SEEDS = (1, 2)
"""Seeds of the images; the first run also compiles kernels, so that the last run is timed."""
RUNS = 4
"""Number of images with a kept radiance cache, of which the fastest is reported."""
REFERENCE_PHOTONS = 6_000_000
"""Largest number of photons of each seed of the reference."""
REFERENCE_SEEDS = (101, 102)
"""Seeds of the two reference images, which no judged image has; the difference of the two gives the
noise of the reference."""
BOX = 3
"""Side (pixels) of the square over which pictures are averaged before they are compared, which
removes most of the reference's noise."""
RADIUS, DEPTH = 1.5, 0.8
"""Radius and depth (mm) of the ball, those of `benchmarks.case`."""
ERRORS = ("error_in_contact", "error_elsewhere")
TIMES = ("cpu_s_new_light", "cpu_s_kept_light")

FloatArray = NDArray[np.floating]


class Change(NamedTuple):
    """A value of a module or class that is replaced."""

    place: Any
    name: str
    value: Any


@dataclass(frozen=True)
class Ablation:
    """An acceleration or refinement that is switched off.

    Attributes:
        name: its name in the table.
        changes: function that returns the values to replace; it is called after Mitsuba is loaded.
        light: whether the content of the radiance cache depends on it, and not only the shading.
    """

    name: str
    changes: Callable[[], Sequence[Change]]
    light: bool

    @contextmanager
    def applied(self) -> Iterator[None]:
        """Context in which the feature is switched off."""
        with ExitStack() as stack:
            for change in self.changes():
                stack.enter_context(mock.patch.object(*change))
            yield


def ablations() -> list[Ablation]:
    """Return all ablations; those of shading alone come first, since they share one cache."""
    import drjit as dr
    import mitsuba as mi

    from optisense.optics.backend import sequences
    from optisense.optics.imaging import _grain, cached, sampling
    from optisense.optics.radiance_cache import (
        angular_variance,
        beam_sums,
        beams,
        bin_sums,
        glossy_interreflection,
        interreflection,
        shading,
        shading_points,
        smoothing,
        store,
        tally,
    )
    from optisense.optics.scene import assembly
    from optisense.optics.transport import emission_guide, interact, photons

    def random_4d(index: Any, stream: Any, seed: Any) -> tuple[Any, ...]:
        first, second = mi.sample_tea_32(index, stream ^ (seed * 0x9E3779B9))
        both = mi.sample_tea_32(first ^ 0x85EBCA6B, second)
        return tuple(sequences.unit_float(bits) for bits in (first, second, *both))

    def random_richtmyer(series: Any, number: Any, dimension: int) -> Any:
        return sequences.unit_float(mi.sample_tea_32(series ^ mi.UInt32(dimension), number)[0])

    def own_cell(
        cells: Any, base: Any, active: Any, series: Any, number: Any
    ) -> tuple[Any, Any, Any]:
        home, found = shading_points.cell_at(cells, base, active)
        return home, mi.Vector3f(0), found

    def no_overlap(place: Any, direction: Any, bins: Any) -> tuple[Any, Any]:
        return mi.Float(0), mi.Float(0)

    def no_interreflection(field: Any, *rest: Any) -> list[Any]:
        return [mi.Color3f(0) for _ in range(field.binned.groups)]

    def always_doubtful(balls: Any, count: Any, point: Any, *rest: Any) -> Any:
        return dr.zeros(mi.Float, dr.width(point)) + 2

    def isotropic(axis: Any, towards: Any, cosine: Any, height: Any) -> Any:
        frame = mi.Frame3f(towards)
        half = dr.minimum(1 - cosine, angular_variance.MAX_SPREAD)
        return angular_variance.AngularVariance(towards, frame.s, frame.t, half, half)

    def here(light: Any, fixed: Any, at: Any, k: Any) -> Any:
        return at.cell

    def sharp(coating: Any, cosine: Any) -> Any:
        return coating

    def one_length(cells: Any, halves: Any, radii: FloatArray) -> FloatArray:
        return np.full(cells.cells, np.inf)

    def every_facet(mesh: Any) -> Any:
        return mesh

    def shading_only(name: str, *changes: Change) -> Ablation:
        return Ablation(name, lambda: changes, False)

    def of_light(name: str, *changes: Change) -> Ablation:
        return Ablation(name, lambda: changes, True)

    coherent = property(lambda path: False)
    return [
        shading_only("culled beams", Change(cached, "cull_beams", lambda b, *rest: b)),
        shading_only("shading of every second pixel",
                     Change(cached, "SPARSE_SHADING_BEAMS", np.inf),
                     Change(cached, "SPARSE_METALLIC_BEAMS", np.inf)),
        shading_only("more samples in noisy areas", Change(_grain, "GRAIN_THRESHOLD", np.inf)),
        shading_only("more samples in small contacts", Change(sampling, "MIN_CONTACT_SAMPLES", 0)),
        shading_only("several cells per sample", Change(shading, "CELLS_PER_SAMPLE", 1)),
        shading_only("interpolation of cells", Change(shading, "interpolating_cell", own_cell)),
        shading_only("low-discrepancy samples of a pixel",
                     Change(bin_sums, "richtmyer", random_richtmyer),
                     Change(shading_points, "richtmyer", random_richtmyer)),
        shading_only("interreflection in contacts",
                     Change(shading, "interreflected", no_interreflection),
                     Change(shading, "glossy_interreflection", no_interreflection)),
        shading_only("interreflection beyond one bounce",
                     Change(interreflection, "MAX_BOUNCES", 1),
                     Change(glossy_interreflection, "MAX_BOUNCES", 1)),
        shading_only("occluder horizon", Change(shading, "occluder_horizon", always_doubtful)),
        shading_only("light partly below the horizon",
                     Change(bin_sums, "cosine_half_width", lambda *rest: mi.Float(0))),
        shading_only("anisotropic angular variance",
                     Change(bin_sums, "angular_variance", isotropic),
                     Change(beam_sums, "angular_variance", isotropic)),
        shading_only("lookup displaced along the beam", Change(bin_sums, "_place", here)),
        shading_only("lobes broadened by angular variance",
                     Change(bin_sums, "broadened_coating", sharp)),
        shading_only("coherent camera rays", Change(interact.Path, "is_coherent", coherent)),
        of_light("emission guiding", Change(emission_guide, "MIN_DENSITY", 1.0)),
        of_light("low-discrepancy photons", Change(photons, "sequence_4d", random_4d)),
        of_light("compaction of surviving photons", Change(photons, "STAGES", ())),
        of_light("volume flux", Change(store, "GRAZING_SHARE_LIMIT", 2.0)),
        of_light("kernel widths from pilot photons", Change(smoothing, "varies_over", one_length)),
        of_light("narrow kernels outside the view", Change(store, "SMOOTHED_MARGIN", 1e6)),
        of_light("sharpening", Change(smoothing, "MAX_SHARPENING", 0.0)),
        of_light("overlapping bins", Change(tally, "dither", no_overlap)),
        of_light("weak beams merged", Change(beams, "STRONG_SHARE", 0.0)),
        of_light("flat faces merged", Change(assembly, "_merged", every_facet)),
    ]  # fmt: skip


def main() -> None:
    """Run the benchmark, print its results and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sensor", choices=SENSORS, help="measure one sensor only")
    parser.add_argument(
        "--only", nargs="+", default=[""], help="switch off only what has such a word in its name"
    )
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    console = Console()
    about = machine()
    say_if_busy(console, about)
    path = FOLDER / "ablation.json"
    for name in (options.sensor,) if options.sensor else SENSORS:
        for coating in COATINGS:
            case = f"{name}, {coating}"
            for what, row in measure(name, coating, options.only):
                # Read anew: sensors may be measured by processes of their own.
                found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
                known = found.setdefault(case, {"machine": about, "rows": {}})
                known["machine"] = about
                known["rows"][what] = row
                console.print(f"{case}: {what} " + json.dumps(row), highlight=False)
                if not options.dry:
                    path.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
                    (FOLDER / "ablation.md").write_text(table(found), encoding="utf-8")


def measure(name: str, coating: str, only: Sequence[str]) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield the results of each ablation on a sensor; the first is "nothing", with every feature.

    Args:
        name: built-in sensor.
        coating: key of `COATINGS`.
        only: words; an ablation is measured if its name contains one of them.
    """
    model = OpticalModel(set_value(sensors.build(name), "coating.specularity", COATINGS[coating]))
    place = model.nine_contacts()[4].point
    assert place is not None
    ball = Contact(Sphere(radius=RADIUS), point=place, depth=DEPTH)
    truth, noise = reference(model, ball, f"{name}-{coating}")
    yield "nothing", judged(model, ball, truth, noise, True)
    for ablation in ablations():
        if any(word in ablation.name for word in only):
            with ablation.applied():
                if ablation.name == "flat faces merged":
                    yield (
                        ablation.name,
                        judged(OpticalModel(model.design), ball, truth, noise, True),
                    )
                else:
                    yield ablation.name, judged(model, ball, truth, noise, ablation.light)
    model.forget_light()


def judged(
    model: OpticalModel, ball: Contact, truth: FloatArray, noise: FloatArray, light: bool
) -> dict[str, float]:
    """Return errors, bias and processor seconds of images.

    Args:
        model: sensor.
        ball: contact.
        truth: smoothed radiance (h, w, 3) of the reference.
        noise: variance of the reference's noise in each of the two masks of `masks`.
        light: whether photons are traced again, with the pilot pass, and timed.
    """
    errors, ratios, cpu = [], [], {}
    if light:
        model.forget_light(guide=True)
    for seed in SEEDS:
        if light and seed == SEEDS[-1]:
            model.forget_light(guide=True)
        began = time.process_time()
        image = model.render([ball], RESOLUTION, PHOTONS, seed=seed, skin=CONFORMING)
        cpu["cpu_s_new_light"] = time.process_time() - began
        got = smooth(image.radiance)
        where = masks(image.contact_mask, truth)
        errors.append([((got - truth)[mask] ** 2).mean() for mask in where])
        ratios.append([got[mask].mean() / truth[mask].mean() for mask in where])
    kept = []
    for _ in range(RUNS):
        began = time.process_time()
        model.render([ball], RESOLUTION, PHOTONS, seed=SEEDS[-1], skin=CONFORMING)
        kept.append(time.process_time() - began)
    cpu["cpu_s_kept_light"] = min(kept)
    if not light:
        del cpu["cpu_s_new_light"]
    if light:  # ablations of shading alone read the radiance caches of both seeds
        model.render([ball], RESOLUTION, PHOTONS, seed=SEEDS[0], skin=CONFORMING)
    means = [truth[mask].mean() for mask in where]
    square = np.maximum(np.mean(errors, axis=0) - noise, 0.0)
    relative = np.sqrt(square) / means
    bias = np.mean(ratios, axis=0) - 1
    return {
        **{key: round(float(v), 5) for key, v in zip(ERRORS, relative, strict=True)},
        "bias_in_contact": round(float(bias[0]), 5),
        "bias_elsewhere": round(float(bias[1]), 5),
        **{key: round(value, 3) for key, value in cpu.items()},
    }


def masks(contact: NDArray[np.bool_], truth: FloatArray) -> list[NDArray[np.bool_]]:
    """Return masks (h, w) of the pixels in the contact, and of all others that are not dark.

    Args:
        contact: contact mask (h, w).
        truth: radiance (h, w, 3) of the reference.
    """
    return [contact, ~contact & (truth.sum(axis=-1) > 0.02 * truth.sum(axis=-1).mean())]


def smooth(image: FloatArray) -> FloatArray:
    """Return an image (h, w, 3), averaged over squares of `BOX` pixels."""
    return np.asarray(uniform_filter(image.astype(np.float64), (BOX, BOX, 1)))


def reference(model: OpticalModel, ball: Contact, name: str) -> tuple[FloatArray, FloatArray]:
    """Return the smoothed reference (h, w, 3) and the variance (2,) of its noise in each mask.

    Both are kept in a file of `CACHE`.
    """
    CACHE.mkdir(exist_ok=True)
    path = CACHE / f"ablation-{name}-{REFERENCE_PHOTONS}.npz"
    if not path.is_file():
        images = [
            model.render(
                [ball], RESOLUTION, REFERENCE_PHOTONS, seed=seed, estimator="sppm", skin=CONFORMING
            )
            for seed in REFERENCE_SEEDS
        ]
        seen = images[0].contact_mask
        np.savez(path, *(image.radiance for image in images), contact=seen)
    with np.load(path) as kept:
        one, other, contact = smooth(kept["arr_0"]), smooth(kept["arr_1"]), kept["contact"]
    truth = (one + other) / 2
    noise = [((one - other)[mask] ** 2).mean() / 4 for mask in masks(contact, truth)]
    return truth, np.array(noise)


def changes(rows: dict[str, dict[str, float]], what: str) -> dict[str, float]:
    """Return the relative increase of each error and time without a feature."""
    with_it, without = rows["nothing"], rows[what]
    return {
        key: without[key] / with_it[key] - 1
        for key in (*ERRORS, *TIMES)
        if key in without and with_it[key] > 0
    }


def table(found: dict[str, Any]) -> str:
    """Return the results as Markdown."""
    lines = [
        "# Ablation of the optics", "",
        "The command `python -m benchmarks.ablation` writes this page; do not edit it.", "",
        "Each acceleration and refinement of the optics is switched off in turn. Images have "
        f"{RESOLUTION[0]}x{RESOLUTION[1]} pixels and {PHOTONS:,} photons; a ball of radius "
        f"{RADIUS} mm is pressed in by {DEPTH} mm, and coatings have a specularity of "
        f"{COATINGS['diffuse']:g} (diffuse) or {COATINGS['metallic']:g} (metallic). The error is "
        "the RMS difference from progressive photon mapping with "
        f"{2 * REFERENCE_PHOTONS / 1e6:g} million photons, over squares of {BOX} pixels, relative "
        "to the mean; the noise of the reference is subtracted. The bias is the error of the mean. "
        "Seconds are the processor time of all threads: of an image with its pilot pass and "
        "photons (*new light*), and of a further image with the same radiance cache (*light "
        "kept*).", "",
        "## Largest effects", "",
        "Each cell is the largest increase of the error or the time without the feature among the "
        "measured cases, in brackets the case.", "",
        "| switched off | error in the contact | error elsewhere | seconds, new light "
        "| seconds, light kept |", "|---|---|---|---|---|",
    ]  # fmt: skip
    names = list(dict.fromkeys(what for case in found.values() for what in case["rows"]))
    for what in names:
        cells = []
        for key in (*ERRORS, *TIMES):
            known = [
                (changes(case["rows"], what)[key], name)
                for name, case in found.items()
                if {what, "nothing"} <= set(case["rows"]) and key in changes(case["rows"], what)
            ]
            most = max(known, default=None)
            cells.append("" if most is None else f"{100 * most[0]:+.0f} % ({most[1]})")
        if what != "nothing":
            lines.append(f"| {what} | " + " | ".join(cells) + " |")
    for name, case in found.items():
        lines += ["", f"## {name}", "",
                  "| switched off | error in the contact | error elsewhere | bias in the contact "
                  "| bias elsewhere | seconds, new light | seconds, light kept |",
                  "|---|---|---|---|---|---|---|"]  # fmt: skip
        for what, row in case["rows"].items():
            cells = [f"{100 * row[key]:.2f} %" for key in ERRORS]
            cells += [f"{100 * row[key]:+.2f} %" for key in ("bias_in_contact", "bias_elsewhere")]
            cells += [f"{row[key]:.2f}" if key in row else "" for key in TIMES]
            lines.append(f"| {what} | " + " | ".join(cells) + " |")
        about = case["machine"]
        busy = f"; the machine was busy (load {about['load_at_start']})" if about["busy"] else ""
        lines += ["", f"{about['date']}, {about['processor']}, {about['cores']} cores{busy}"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
