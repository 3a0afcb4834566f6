"""Light fields of one sensor, kept between images: the guide, the cells, and the tallies of
each seed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optisense.optics.backend.sequences import seed_of
from optisense.optics.radiance_cache.cache import BINS, FieldTally, LightField
from optisense.optics.radiance_cache.pilot_photons import Scouts
from optisense.optics.radiance_cache.smoothing import Kernels
from optisense.optics.scene.emitters import EmitterTable
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surface_cells import SurfaceCells, build_cells, cells_near
from optisense.optics.transport.emission_guide import Guide, even_guide, learn_guide
from optisense.optics.transport.photons import Target, trace_photons, trace_pilot
from optisense.optics.transport.volume_flux import Slab, slab_above

PASS_PHOTONS = 500_000
ONE_PASS = 2.5 * PASS_PHOTONS
PILOT_PHOTONS = 300_000
CELL_SIZE = 0.5
"""mm; larger where the tally would outgrow its memory."""
TARGET_SIZE = 1.0
"""mm, of the cells that tell whether a photon of the pilot lands where the camera looks."""
MOST_BYTES = 375e6
SEEN_MARGIN = 2.0
"""mm around what the camera sees that photons are sent to: an indenter's flank catches light
that would land there.
"""
SMOOTHED_MARGIN = 5.0
"""mm around what the camera sees, beyond which light is hardly smoothed: little of it is read."""
KEPT_FIELDS = 2
MOST_GRAZING = 0.25
"""Share of such light above which indenters are lit from a field above the surface."""


@dataclass
class _Running:
    tally: FieldTally
    per_light: int


class FieldStore:
    """Traces photons pass by pass and keeps what it finds."""

    cell_size = CELL_SIZE
    asks_scouts = True
    """Whether the photons that teach the guide also tell how light falls: indenters are then lit
    from a field above the surface where it grazes, and kernels are narrower where it varies."""
    lit: Collection[int] | None = None
    """The light groups whose light is traced; all where it is None."""

    def __init__(
        self,
        scene: RayScene,
        opaque: list[Piece],
        table: EmitterTable,
        seen: NDArray[np.floating],
        coloured: bool,
        metallic: bool = True,
    ) -> None:
        """``scene`` without contacts, its opaque pieces, and ``seen`` (n, 3) mm: points that
        the camera sees.
        """
        self._seen = seen
        self._scene = scene
        self._table = table
        self._coloured = coloured
        self._metallic = metallic
        self._opaque = opaque
        self._guide: Guide | None = None
        self._scouts: Scouts | None = None
        self._above: Slab | None = None
        self._cells: SurfaceCells | None = None
        self._kernels: Kernels | None = None
        self._running: dict[tuple[int, int], _Running] = {}
        self._done: dict[tuple[int, int, int], LightField] = {}

    def forget_light(self, coloured: bool, metallic: bool = True) -> None:
        """Surfaces reflect otherwise now: drop the fields, keep guide and cells."""
        self._coloured = coloured
        self._metallic = metallic
        self._running.clear()
        self._done.clear()

    @property
    def _slab(self) -> Slab | None:
        """The slab above the surface where much of the light nearly grazes it, else None."""
        if not self._grazes:
            return None
        if self._above is None:
            self._above = slab_above(self.cells)
        return self._above

    @cached_property
    def _grazes(self) -> bool:
        """Whether much of the light where the camera looks nearly grazes the surface."""
        seen = self._seen_scouts
        return seen is not None and seen.grazing_share() > MOST_GRAZING

    @property
    def _asked_scouts(self) -> Scouts | None:
        """The photons that taught the guide, if they are to be asked."""
        return self._scouts if self.asks_scouts and self.guide else None

    @cached_property
    def _seen_scouts(self) -> Scouts | None:
        """Those of them that landed where photons are wanted."""
        scouts = self._asked_scouts
        return None if scouts is None else scouts.within(*self._target)

    @property
    def guide(self) -> Guide:
        """Where to send photons: to what the camera sees, learned on first use from a pilot
        pass.
        """
        if self._guide is None:
            lights = self._table.count
            cells, near = self._target
            per_light = max(1, PILOT_PHOTONS // lights)
            arrived, landed = trace_pilot(
                self._scene,
                self._table,
                even_guide(lights),
                per_light,
                seed_of(0, 1),
                Target(cells, mi.UInt32(near.astype(np.uint32))),
                self._coloured,
            )
            self._guide = learn_guide(arrived, lights, per_light)
            if self.asks_scouts:
                self._scouts = Scouts.of(landed)
        return self._guide

    @cached_property
    def _opaque_mesh(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Vertices (mm) and faces of all opaque surfaces."""
        vertices, faces, start = [], [], 0
        for piece in self._opaque:
            vertices.append(np.asarray(piece.vertices, dtype=np.float64))
            faces.append(np.asarray(piece.faces, dtype=np.int64) + start)
            start += len(piece.vertices)
        return np.concatenate(vertices), np.concatenate(faces)

    @cached_property
    def _target(self) -> tuple[SurfaceCells, NDArray[np.bool_]]:
        """Rough cells over all opaque surfaces, and where photons are wanted: in those that the
        camera sees and around them."""
        cells = build_cells(*self._opaque_mesh, TARGET_SIZE)
        return cells, cells_near(cells, self._seen, SEEN_MARGIN)

    @property
    def cells(self) -> SurfaceCells:
        """The cells over all opaque surfaces of the sensor."""
        if self._cells is None:
            points, triangles = self._opaque_mesh
            a, b, c = (points[triangles[:, k]] for k in range(3))
            area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
            entry = BINS * self._table.groups * (36 if self._coloured else 20)
            if self._grazes:
                entry *= 2
            least = float(np.sqrt(1.3 * area * entry / MOST_BYTES))
            scale = self.cell_size / CELL_SIZE
            self._cells = build_cells(points, triangles, max(self.cell_size, scale * least))
        return self._cells

    @property
    def kernels(self) -> Kernels:
        """How light is smoothed among these cells."""
        if self._kernels is None:
            cells, (rough, where) = self.cells, self._target
            area = float(rough.areas[where].sum())
            landed, scouts = None, 0.0
            if self._asked_scouts is not None and self._seen_scouts is not None:
                landed = self._asked_scouts.landed(cells, self._table.groups)
                scouts = len(self._seen_scouts.powers) / area
            self._kernels = Kernels(
                cells,
                self._lamp_distance(cells.centres),
                self.guide.arriving / area,
                cells_near(cells, self._seen, SMOOTHED_MARGIN),
                landed,
                scouts,
            )
        return self._kernels

    def _lamp_distance(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """(n,) mm from points to the nearest lamp's window."""
        lamps = self._table.emitters
        places = np.array([lamp.position for lamp in lamps])
        nearest, which = cKDTree(places).query(points)
        half = np.array([max(lamp.size) / 2 for lamp in lamps])
        return np.asarray(nearest - half[which])

    def field(
        self,
        seed: int,
        photons: int | None,
        noise: float | None,
        seconds: float | None,
        most: int,
        began: float,
        tell: Callable[[float, int, float | None], None],
    ) -> tuple[LightField, bool]:
        """The field after ``photons``, or once ``noise`` (relative) or ``seconds`` (since
        ``began``) are reached.

        Returns the field and whether Ctrl-C ended it early.
        """
        lights = self._table.count
        # A pass costs a little by itself, so few photons are one.
        size = photons if photons is not None and photons < ONE_PASS else PASS_PHOTONS
        per_light = max(1, size // lights)
        wanted = None if photons is None else max(1, round(photons / (per_light * lights)))
        cap = max(1, most // (per_light * lights))
        key = (seed, per_light)
        if wanted is not None and noise is None and seconds is None:
            done = self._done.get((*key, wanted))
            if done is not None:
                return done, False
        running = self._running.get(key)
        if (
            running is None
            or (wanted is not None and running.tally.passes > wanted)
            or (wanted is None and seconds is None)
        ):
            running = _Running(
                FieldTally(
                    self.kernels,
                    self._table.groups,
                    self._coloured,
                    self._metallic,
                    self._slab,
                ),
                per_light,
            )
            self._running = {key: running}
        tally = running.tally
        limit = cap if wanted is None else wanted
        check, reached, interrupted = 1, None, False
        try:
            while tally.passes < limit:
                started = time.perf_counter()
                tally.add(
                    trace_photons(
                        self._scene,
                        self._table,
                        self.guide,
                        per_light,
                        seed_of(seed, 2),
                        first=tally.passes * per_light,
                        coloured=self._coloured,
                        groups=self.lit,
                        slab=self._slab,
                    )
                )
                now = time.perf_counter()
                fraction = tally.passes / limit if wanted is not None else 0.0
                if noise is not None and tally.passes >= check:
                    reached = tally.noise()
                    if reached <= noise:
                        break
                    check = tally.passes * 2
                if noise is not None and reached:
                    fraction = max(fraction, min(0.95, (noise / reached) ** 2))
                if seconds is not None:
                    fraction = max(fraction, min(0.95, (now - began) / seconds))
                    if now - began + (now - started) > 0.8 * seconds:
                        break
                tell(0.95 * fraction, tally.photons, reached)
        except KeyboardInterrupt:
            if tally.passes < 1:
                raise
            interrupted = True
        name = (*key, tally.passes)
        if name not in self._done:
            self._done[name] = tally.smoothed()
            while len(self._done) > KEPT_FIELDS:
                del self._done[next(iter(self._done))]
        return self._done[name], interrupted
