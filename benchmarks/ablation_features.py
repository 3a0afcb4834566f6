"""The accelerations and refinements of the optics that the ablation switches off.

Nothing of the product is made for this: constants and functions are replaced while an image is
rendered.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any, NamedTuple
from unittest import mock

import numpy as np


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
        changes: the values to replace.
        light: whether the content of the radiance cache depends on it, and not only the shading.
        lobes: whether it is a feature of the tracing of narrow lobes, and does nothing on coatings
            without them.
    """

    name: str
    changes: Sequence[Change]
    light: bool
    lobes: bool = False

    @contextmanager
    def applied(self) -> Iterator[None]:
        """Context in which the feature is switched off."""
        with ExitStack() as stack:
            for change in self.changes:
                stack.enter_context(mock.patch.object(*change))
            yield


def ablations() -> list[Ablation]:
    """Return all ablations: of camera samples and shading, of the light, and of narrow lobes."""
    return [*_of_sampling(), *_of_shading(), *_of_light(), *_of_lobes()]


def _shading(name: str, *changes: Change) -> Ablation:
    return Ablation(name, changes, False)


def _light(name: str, *changes: Change) -> Ablation:
    return Ablation(name, changes, True)


def _lobes(name: str, *changes: Change) -> Ablation:
    return Ablation(name, changes, False, lobes=True)


def _nothing(*given: Any) -> None:
    return None


def _first(given: Any, *rest: Any) -> Any:
    return given


def _of_sampling() -> list[Ablation]:
    import mitsuba as mi

    from optisense.optics.backend import sequences
    from optisense.optics.imaging import cached, lamp_images, sampling
    from optisense.optics.radiance_cache import bin_sums, shading, shading_points
    from optisense.optics.transport import camera_paths

    def random_richtmyer(series: Any, number: Any, dimension: int) -> Any:
        return sequences.unit_float(mi.sample_tea_32(series ^ mi.UInt32(dimension), number)[0])

    def random_2d(index: Any, count: Any, most: int, stream: Any, seed: Any) -> Any:
        bits = mi.sample_tea_32(stream, seed ^ (index * 0x9E3779B9))
        return mi.Point2f(*(sequences.unit_float(each) for each in bits))

    def own_cell(
        cells: Any, base: Any, active: Any, series: Any, number: Any
    ) -> tuple[Any, Any, Any]:
        home, found = shading_points.cell_at(cells, base, active)
        return home, mi.Vector3f(0), found

    one_cell = replace(shading.FULL_EFFORT, cells=1)
    return [
        _shading("shading of every second pixel",
                 Change(cached, "SPARSE_SHADING_BEAMS", np.inf),
                 Change(cached, "SPARSE_METALLIC_BEAMS", np.inf)),
        _shading("more samples in noisy areas", Change(sampling, "GRAIN_THRESHOLD", np.inf)),
        _shading("more samples in small contacts", Change(sampling, "MIN_CONTACT_SAMPLES", 0)),
        _shading("lattice of the samples of a pixel",
                 Change(camera_paths, "folded_lattice", random_2d)),
        _shading("several cells per sample", Change(cached, "FULL_EFFORT", one_cell)),
        _shading("interpolation of cells", Change(shading, "interpolating_cell", own_cell)),
        _shading("low-discrepancy samples of a pixel",
                 Change(bin_sums, "richtmyer", random_richtmyer),
                 Change(shading_points, "richtmyer", random_richtmyer)),
        _shading("spread of specks", Change(lamp_images, "without_specks", _first)),
    ]  # fmt: skip


def _of_shading() -> list[Ablation]:
    import drjit as dr
    import mitsuba as mi

    from optisense.optics.imaging import cached, sampling
    from optisense.optics.radiance_cache import (
        angular_variance,
        beam_sums,
        bin_sums,
        glossy_interreflection,
        interreflection,
        shading,
    )

    def no_interreflection(field: Any, *rest: Any) -> list[Any]:
        return [mi.Color3f(0) for _ in range(field.binned.groups)]

    def always_doubtful(balls: Any, count: Any, point: Any, *rest: Any) -> Any:
        return dr.zeros(mi.Float, dr.width(point)) + 2

    def isotropic(axis: Any, towards: Any, cosine: Any, height: Any) -> Any:
        frame = mi.Frame3f(towards)
        half = dr.minimum(1 - cosine, angular_variance.MAX_SPREAD)
        return angular_variance.AngularVariance(towards, frame.s, frame.t, half, half)

    def here(light: Any, fixed: Any, at: Any, *rest: Any) -> Any:
        return mi.UInt32(at.cell)

    def one_disc(beam: Any) -> Any:
        half = (beam.variance_along + beam.variance_up) * 0.5
        return beam.towards, beam.towards, 1 - half

    def zero(*rest: Any) -> Any:
        return mi.Float(0)

    def single(plan: Any, regions: Any) -> int:
        return 1

    return [
        _shading("culled beams", Change(cached, "cull_beams", _first)),
        _shading("interreflection in contacts",
                 Change(shading, "interreflected", no_interreflection),
                 Change(shading, "glossy_interreflection", no_interreflection)),
        _shading("interreflection beyond one bounce",
                 Change(interreflection, "MAX_BOUNCES", 1),
                 Change(glossy_interreflection, "MAX_BOUNCES", 1)),
        _shading("averaging of interreflection",
                 Change(sampling.SamplingPlan, "interreflection_width", single)),
        _shading("end of negligible paths", Change(glossy_interreflection, "NEGLIGIBLE_SHARE", 0)),
        _shading("light of contacts on the skin", Change(cached, "beside_layers", _nothing)),
        _shading("occluder horizon", Change(bin_sums, "occluder_horizon", always_doubtful)),
        _shading("light partly below the horizon", Change(bin_sums, "cosine_half_width", zero)),
        _shading("shadow rays mirrored above the face", Change(bin_sums, "mirrored_above", _first)),
        _shading("anisotropic angular variance",
                 Change(bin_sums, "angular_variance", isotropic),
                 Change(beam_sums, "angular_variance", isotropic)),
        _shading("lookup displaced along the beam", Change(bin_sums, "_place", here)),
        _shading("lobes broadened by angular variance",
                 Change(bin_sums, "broadened_coating", _first),
                 Change(beam_sums, "broadened_coating", _first)),
        _shading("two discs of narrow lobes", Change(angular_variance, "two_discs", one_disc)),
    ]  # fmt: skip


def _of_light() -> list[Ablation]:
    import mitsuba as mi

    from optisense.optics.backend import sequences
    from optisense.optics.radiance_cache import beams, smoothing, store, tally
    from optisense.optics.scene import assembly
    from optisense.optics.transport import emission_guide, photons

    def random_4d(index: Any, stream: Any, seed: Any) -> tuple[Any, ...]:
        first, second = mi.sample_tea_32(index, stream ^ (seed * 0x9E3779B9))
        both = mi.sample_tea_32(first ^ 0x85EBCA6B, second)
        return tuple(sequences.unit_float(bits) for bits in (first, second, *both))

    def no_overlap(place: Any, bins: Any) -> tuple[Any, Any]:
        return mi.Float(0), mi.Float(0)

    def one_length(cells: Any, halves: Any, radii: Any) -> Any:
        return np.full(cells.cells, np.inf)

    def unchanged(kernels: Any, landed: Any, photons: int) -> Any:
        return np.ones_like(landed)

    false = property(lambda store: False)
    return [
        _light("emission guiding", Change(emission_guide, "MIN_DENSITY", 1.0)),
        _light("low-discrepancy photons", Change(photons, "sequence_4d", random_4d)),
        _light("volume flux", Change(store, "GRAZING_SHARE_LIMIT", 2.0)),
        _light("raised plane", Change(store.CacheStore, "_raises", false)),
        _light("bins of curved surfaces", Change(store.CacheStore, "_curved", false)),
        _light("kernel widths from pilot photons", Change(smoothing, "varies_over", one_length)),
        _light("kernels within one orientation", Change(smoothing, "MIN_NORMAL_COSINE", -2.0)),
        _light("narrow kernels outside the view", Change(store, "SMOOTHED_MARGIN", 1e6)),
        _light("sharpening", Change(smoothing.Kernels, "sharpening", unchanged)),
        _light("overlapping bins", Change(tally, "dither", no_overlap)),
        _light("weak beams merged", Change(beams, "STRONG_SHARE", 0.0)),
        _light("widened beams of single photons", Change(beams, "SPARSE_SHARE", 0.0)),
        _light("empty bins left out", Change(tally, "EMPTY_BIN_SHARE", -1.0)),
        _light("flat faces merged", Change(assembly, "_merged", _first)),
    ]  # fmt: skip


def _of_lobes() -> list[Ablation]:
    import drjit as dr
    import mitsuba as mi

    from optisense.optics.backend import sequences
    from optisense.optics.imaging import _traced_light, cached
    from optisense.optics.radiance_cache import (
        _lobe_branches,
        lit_scene,
        traced_lobes,
    )
    from optisense.optics.transport.interact import RayKind

    class OneWay:
        CAMERA = REFLECTION = RayKind.REFLECTION

    def at_random(series: Any, number: Any, dimension: int) -> Any:
        return sequences.unit_float(mi.sample_tea_32(series, number * 4 + dimension, 8)[0])

    def all_cached(tracer: Any, first: Any, ray: Any) -> Any:
        return dr.full(mi.Bool, False, dr.width(ray.active))

    def blurred(layers: Any, weight: Any, where: Any, reach: int, deblurred: bool) -> None:
        average(layers, weight, where, reach, False)

    def followed(pixels: Any, rays: float) -> Any:
        directions = _traced_light._directions(rays, pixels, 1)
        return _traced_light.LobeSamples(pixels, 1, directions, gathers=False)

    average = _traced_light.average_pixels
    return [
        Ablation("tracing of narrow lobes",
                 [Change(lit_scene, "TRACED_ROUGHNESS", 0.0)], light=True, lobes=True),
        _lobes("rays drawn from beams", Change(traced_lobes, "GUIDED_SHARE", 0.0)),
        _lobes("rays split at rough faces", Change(_lobe_branches, "MOST_SCATTERED", 1)),
        _lobes("both ways at the first interfaces", Change(traced_lobes, "RayKind", OneWay)),
        _lobes("later directions spread evenly",
               Change(_lobe_branches, "richtmyer", at_random),
               Change(traced_lobes, "richtmyer", at_random)),
        _lobes("part of the branches followed", Change(_lobe_branches, "BRANCH_FACTOR", 1e9)),
        _lobes("branches of second segments", Change(traced_lobes, "BRANCHED_SEGMENTS", 1)),
        _lobes("rays split at contacts", Change(_lobe_branches, "SPLIT_SHARE", 0.0)),
        _lobes("drawn places of cached light",
               Change(traced_lobes, "MOST_CACHED", 10**9),
               Change(traced_lobes, "MOST_GATHERED", 10**9)),
        _lobes("final gathering on the skin",
               Change(_traced_light.LobeSamples, "of_skin", staticmethod(followed))),
        _lobes("light straight from other coatings",
               Change(traced_lobes.LobeTracer, "_is_uncached", all_cached)),
        _lobes("skin behind mirrored contacts",
               Change(traced_lobes.LobeTracer, "_subtract_skin_behind", _nothing)),
        _lobes("more rays around contacts", Change(_traced_light, "NEAR_RAYS", 0.03)),
        _lobes("more rays beside contacts", Change(_traced_light, "BESIDE_RAYS", 0.02)),
        _lobes("few rays from mirrored points", Change(_traced_light, "MIRRORED_SHARE", 1.0)),
        _lobes("averages far from contacts", Change(_traced_light, "SKIN_WIDTH", 0.0)),
        _lobes("averages beside contacts", Change(_traced_light, "BESIDE_WIDTH", 0.0)),
        _lobes("averages around contacts",
               Change(_traced_light, "NEAR_WIDTH", 0.0), Change(cached, "NEAR_WIDTH", 0.0)),
        _lobes("blur undone", Change(_traced_light, "average_pixels", blurred)),
        _lobes("spread of traced specks", Change(_traced_light, "without_specks", _first)),
        _lobes("more samples at the outline", Change(_traced_light, "OUTLINE_SAMPLES", 1)),
    ]  # fmt: skip
