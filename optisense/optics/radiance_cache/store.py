"""The radiance caches of one sensor, kept between images, with the emission guide and the cells."""

from __future__ import annotations

import time
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optisense.optics.backend.arrays import indices
from optisense.optics.backend.sequences import seed_of
from optisense.optics.backend.stages import Stage, StageCallback
from optisense.optics.radiance_cache._direction_bins import COARSE_BINS, CURVED_BINS, DirectionBins
from optisense.optics.radiance_cache._pilot_photons import PilotPhotons
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.lit_scene import LitScene
from optisense.optics.radiance_cache.smoothing import Kernels
from optisense.optics.radiance_cache.tally import DENSE, CacheTally
from optisense.optics.radiance_cache.tracing_limits import Passes, TracingLimits
from optisense.optics.scene.surface_cells import (
    SurfaceCells,
    build_cells,
    cells_near,
    coarseness,
    fineness,
)
from optisense.optics.transport.emission_guide import EmissionGuide, learn_guide, uniform_guide
from optisense.optics.transport.photons import (
    Emission,
    TargetCells,
    trace_photons,
    trace_pilot,
)

PILOT_PHOTONS = 300_000
"""Number of photons of the pilot pass, from which the emission guide is learned: enough for the
cells of the guide (see `GUIDE_CELLS`), and half of a pass."""
CELL_SIZE = 0.5
"""Side (mm) of the surface cells: a third of the usual kernel radius (`REFERENCE_RADIUS`), so that
the cells blur little. It is smaller on small sensing surfaces (see `fineness`), and larger where
the tally would exceed `MAX_TALLY_BYTES`, or where a large sensing surface (see `coarseness`) has no
lamp within `NEAR_LAMP`."""
NEAR_LAMP = 10.0
"""Distance (mm) from the nearest lamp to what the camera sees above which the cells of a large
sensing surface grow with it, as the length over which light varies does; it is at most 8 mm on the
built-in sensors. On a skin of 80 x 64 mm, the first picture then takes a third of the time."""
PILOT_CELL_SIZE = 1.0
"""Side (mm) of the cells that decide whether a pilot photon lands where the camera looks: half of
`VIEW_MARGIN`."""
MAX_TALLY_BYTES = 375e6
"""Memory (bytes) that the tally of one seed may take. Cells are made larger to stay below it, so
that a process takes less than the `MOST_RESIDENT` memory of `backend.memory`."""
MAX_FINE_TALLY_BYTES = 750e6
"""Memory (bytes) that the tally of one seed may take with the fine direction bins of narrow lobes,
of which there are two to four times as many."""
BYTES_OF_GREY, BYTES_OF_COLOUR = 20, 36
"""Memory (bytes) of a direction bin of one group in a cell: the five numbers of `Tables` in single
precision, or nine where surfaces are coloured."""
CUT_CELLS = 1.3
"""Ratio of the number of cells of a surface to its area divided by that of a cell, from which the
memory is estimated. Edges and borders cut cells; on the built-in sensors, the ratio is 1.0 to
1.2."""
VIEW_MARGIN = 2.0
"""Margin (mm) around the camera's view to which photons are sent as well: light that lands there
would meet the flank of an indenter, which stands off the surface by 1 to 2 mm."""
SMOOTHED_MARGIN = 5.0
"""Margin (mm) around the camera's view beyond which cells are smoothed with the narrowest kernel
only, as few of them are read: more than three kernel radii."""
MAX_CACHES = 2
"""Number of radiance caches that a store keeps; the oldest is dropped when there are more. Two let
a user go back and forth between two sets of lights or seeds."""
GRAZING_SHARE_LIMIT = 0.17
"""Share of grazing light above which indenters are lit by the volume flux above the surface as
well. Without it, the error in a contact of GelSight Svelte, whose share is 0.42, would be three
times as large (benchmarks/ablation.md); to sensors of 0.07 to 0.12, it would only add noise."""


class _Traced(NamedTuple):
    """The photons whose light a cache holds: the traced light groups (None for all), the seed,
    and the photons of each light in a pass."""

    groups: frozenset[int] | None
    seed: int
    per_light: int


class CacheStore:
    """Tracer of photon passes that keeps the tallies and the radiance caches computed from them."""

    cell_size = CELL_SIZE
    """Side (mm) of the surface cells; see `CELL_SIZE`."""
    thorough = True
    """Whether curved surfaces get direction bins of their own, and surfaces a raised plane."""
    uses_pilot = True
    """Whether the pilot photons also estimate the distribution of the light: where it grazes,
    indenters are then lit by the flux layer above the surface, and where it varies, kernels are
    narrower."""
    pilot_photons = PILOT_PHOTONS
    """Number of photons of the pilot pass; see `PILOT_PHOTONS`."""
    groups: frozenset[int] | None = None
    """The light groups whose light is traced; all groups if None."""

    def __init__(self, lit: LitScene, seen: NDArray[np.floating]) -> None:
        """Create an empty store; nothing is traced yet.

        Args:
            seen: (n, 3) points (mm) that the camera sees.
        """
        self._lit = lit
        self._seen = seen
        self._guide: EmissionGuide | None = None
        self._pilot: PilotPhotons | None = None
        self._cells: SurfaceCells | None = None
        self._kernels: Kernels | None = None
        self._running: dict[_Traced, CacheTally] = {}
        self._done: dict[tuple[_Traced, int], RadianceCache] = {}

    def coated(self, lit: LitScene) -> Self:
        """Return a store, without any light, of the same sensor with another coating.

        It takes over the guide, and also the cells unless the colours or lobes of the coating need
        cells of another size.
        """
        other = copy(self)
        other._lit = lit
        other._running, other._done = {}, {}
        if lit.coloured != self._lit.coloured or other._directions != self._directions:
            other._cells = other._kernels = None
        return other

    @property
    def _directions(self) -> DirectionBins:
        """The direction bins that the coating needs."""
        shape = self._curved and not self._grazes, self._raises and not self._curved
        return DirectionBins.for_coating(self._lit.roughness, *shape)

    @cached_property
    def _curved(self) -> bool:
        """Whether surfaces are curved and `thorough` gives them direction bins of their own."""
        return self.thorough and any(piece.normals is not None for piece in self._lit.opaque)

    @property
    def _raises(self) -> bool:
        """Whether coarse bins have a raised plane: unless cells would be larger, or light grazes
        and the volume flux takes the place of the raised plane.
        """
        if not self.thorough or self._grazes:
            return False
        bins = CURVED_BINS if self._curved else COARSE_BINS
        return 2 * self._tally_bytes(bins, self.cell_size * self._scale) < MAX_TALLY_BYTES

    def _planes(self, photons: int) -> int:
        """Return the number of planes in which light is tallied until a number of photons.

        Above curved surfaces the raised plane is only worth its time where the blur of the
        smoothing and of the bins exceeds the noise: the light takes 1.2 times as long with it.
        """
        if not self._raises or self._directions.fine:
            return 1
        density = self.kernels.density * photons * self._scale**2
        return 2 if not self._curved or density >= DENSE else 1

    @property
    def _flux_cells(self) -> SurfaceCells | None:
        """The cells of the flux layer, where much of the light is grazing, else None."""
        return self.cells if self._grazes else None

    @cached_property
    def _fineness(self) -> float:
        """The factor on lengths that suits the size of the sensing surface."""
        return fineness(self._lit.opaque)

    @cached_property
    def _scale(self) -> float:
        """The factor on the side of cells that suits the sensing surface and its lamps."""
        most = coarseness(self._lit.opaque)
        if most == 1.0 or len(self._seen) == 0:
            return self._fineness
        near = float(self._lamp_distance(self._seen).min())
        return float(np.clip(near / NEAR_LAMP, 1.0, most))

    @cached_property
    def _grazes(self) -> bool:
        """Whether much of the light in the camera's view is grazing, and the flux layer is used."""
        seen = self._seen_pilot
        return seen is not None and seen.grazing_share() > GRAZING_SHARE_LIMIT

    @property
    def _used_pilot(self) -> PilotPhotons | None:
        """The pilot photons, if they are used for more than the guide."""
        return self._pilot if self.uses_pilot and self.guide else None

    @cached_property
    def _seen_pilot(self) -> PilotPhotons | None:
        """The pilot photons that landed in or near the camera's view."""
        pilot = self._used_pilot
        return None if pilot is None else pilot.within(*self._target)

    @property
    def guide(self) -> EmissionGuide:
        """The emission guide, learned from a pilot pass on first use."""
        if self._guide is None:
            lit, lights = self._lit, self._lit.table.count
            cells, near = self._target
            per_light = max(1, self.pilot_photons // lights)
            arrived, landed = trace_pilot(
                lit.scene if lit.pilot is None else lit.pilot,
                Emission(lit.table, uniform_guide(lights), per_light, seed_of(0, 1)),
                TargetCells(cells, indices(near)),
                lit.coloured if lit.pilot is None else lit.pilot_coloured,
            )
            self._guide = learn_guide(arrived, lights, per_light)
            if self.uses_pilot:
                self._pilot = PilotPhotons.of(landed)
        return self._guide

    @cached_property
    def _opaque_mesh(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Vertices (mm) and faces of all opaque surfaces."""
        vertices, faces, start = [], [], 0
        for piece in self._lit.opaque:
            vertices.append(np.asarray(piece.vertices, dtype=np.float64))
            faces.append(np.asarray(piece.faces, dtype=np.int64) + start)
            start += len(piece.vertices)
        return np.concatenate(vertices), np.concatenate(faces)

    @cached_property
    def _corner_normals(self) -> NDArray[np.float32]:
        """Unit normals (m, 3, 3) at the corners of all faces."""
        found = []
        for piece in self._lit.opaque:
            flat = np.repeat(piece.rows[:, None, :3], 3, axis=1)
            found.append(flat if piece.normals is None else piece.corners[:, :, :3])
        return np.concatenate(found)

    @cached_property
    def _target(self) -> tuple[SurfaceCells, NDArray[np.bool_]]:
        """Coarse cells of all opaque surfaces, and the mask of those in or near the view."""
        cells = build_cells(*self._opaque_mesh, PILOT_CELL_SIZE)
        return cells, cells_near(cells, self._seen, VIEW_MARGIN)

    @property
    def cells(self) -> SurfaceCells:
        """The cells over all opaque surfaces of the sensor."""
        if self._cells is None:
            most = MAX_FINE_TALLY_BYTES if self._directions.fine else MAX_TALLY_BYTES
            least = float(np.sqrt(self._tally_bytes(self._directions, 1.0) / most))
            if self._grazes:
                least *= np.sqrt(2)
            scale = self.cell_size / CELL_SIZE
            size = max(self.cell_size * self._scale, scale * least)
            normals = self._corner_normals if self._curved else None
            self._cells = build_cells(*self._opaque_mesh, size, normals, self._fineness)
        return self._cells

    def _tally_bytes(self, directions: DirectionBins, size: float) -> float:
        """Return the memory (bytes) that a plane's tally takes with cells of this side (mm)."""
        points, triangles = self._opaque_mesh
        a, b, c = (points[triangles[:, k]] for k in range(3))
        area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
        entry = directions.count * self._lit.table.groups
        entry *= BYTES_OF_COLOUR if self._lit.coloured else BYTES_OF_GREY
        return CUT_CELLS * area / size**2 * entry

    @property
    def kernels(self) -> Kernels:
        """The smoothing kernels of these cells."""
        if self._kernels is None:
            cells, (rough, where) = self.cells, self._target
            area = float(rough.areas[where].sum())
            landed, pilot_density = None, 0.0
            if self._used_pilot is not None and self._seen_pilot is not None:
                landed = self._used_pilot.landed(cells, self._lit.table.groups)
                pilot_density = len(self._seen_pilot.powers) / area
            self._kernels = Kernels(
                cells,
                self._lamp_distance(cells.centres),
                self.guide.arriving / area,
                cells_near(cells, self._seen, SMOOTHED_MARGIN),
                landed,
                pilot_density,
            )
        return self._kernels

    def _lamp_distance(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return the distance (n,), mm, from points to the window of the nearest lamp."""
        lamps = self._lit.table.emitters
        places = np.array([lamp.position for lamp in lamps])
        nearest, which = cKDTree(places).query(points)
        half = np.array([max(lamp.size) / 2 for lamp in lamps])
        return np.asarray(nearest - half[which])

    def radiance_cache(
        self, seed: int, limits: TracingLimits, on_stage: StageCallback, partial: bool = False
    ) -> tuple[RadianceCache, bool]:
        """Return the cache once a limit is reached.

        Args:
            limits: when tracing ends.
            on_stage: function that is called when a stage begins and after each pass; see
                `StageCallback`.
            partial: whether Ctrl-C after the first pass ends the tracing; otherwise
                KeyboardInterrupt is raised.

        Returns:
            The cache, and whether Ctrl-C ended the tracing early.
        """
        passes = limits.passes(self._lit.table.count)
        key = _Traced(self.groups, seed, passes.per_light)
        if limits.counts_only:
            done = self._done.get((key, passes.most))
            if done is not None:
                return done, False
        if self._guide is None:
            on_stage(Stage.PILOT, 0.0, 0, None)
        tally = self._tally(key, passes, limits.counts_only)
        noise, interrupted = None, False
        try:
            for noise in self._trace(tally, key, passes, limits, on_stage):  # noqa: B007
                pass
        except KeyboardInterrupt:
            self._running.clear()  # the tally may hold a part of the last pass
            if tally.passes < 1 or not partial:
                raise
            interrupted = True
        name = (key, tally.passes)
        if interrupted or name not in self._done:
            on_stage(Stage.SMOOTHING, 1.0, tally.photons, noise)
            light = replace(tally.smoothed(), traced_lobes=self._lit.traced_lobes)
            if interrupted:
                return light, True
            self._done[name] = light
            while len(self._done) > MAX_CACHES:
                del self._done[next(iter(self._done))]
        return self._done[name], False

    def _tally(self, key: _Traced, passes: Passes, continues: bool) -> CacheTally:
        """Return an earlier tally if it ``continues`` and has no more passes, else an empty one."""
        planes = self._planes(passes.most * passes.photons)
        tally = self._running.get(key)
        if tally is None or not continues or tally.planes != planes or tally.passes > passes.most:
            tally = CacheTally(
                self.kernels,
                self._lit.table.groups,
                self._lit.coloured,
                self._lit.roughness,
                self._flux_cells,
                self._directions,
                planes,
                self._curved,
            )
            self._running = {key: tally}
        return tally

    def _trace(
        self,
        tally: CacheTally,
        key: _Traced,
        passes: Passes,
        limits: TracingLimits,
        on_stage: StageCallback,
    ) -> Iterator[float | None]:
        """Trace passes until a limit is reached; yield the noise after each, or None."""
        noise, next_check = None, 1
        if tally.passes < passes.most:
            self.guide  # noqa: B018  learned before photons are counted
            on_stage(Stage.PHOTONS, 0.0, tally.photons, None)
        while tally.passes < passes.most:
            started = time.perf_counter()
            tally.add(
                trace_photons(
                    self._lit.scene,
                    Emission(
                        self._lit.table,
                        self.guide,
                        passes.per_light,
                        seed_of(key.seed, 2),
                        first=tally.passes * passes.per_light,
                        groups=self.groups,
                    ),
                    coloured=self._lit.coloured,
                    flux_cells=self._flux_cells,
                )
            )
            took = time.perf_counter() - started
            if limits.noise is not None and tally.passes >= next_check:
                noise = tally.noise()
                next_check = 2 * tally.passes
            yield noise
            if limits.noise is not None and noise is not None and noise <= limits.noise:
                return
            if limits.ends_before(took):
                return
            fraction = limits.fraction(tally.passes / passes.most, noise)
            on_stage(Stage.PHOTONS, fraction, tally.photons, noise)
