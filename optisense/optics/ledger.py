"""The light ledger of a sensor: a balance of the power of each light group by where it ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from optisense.design.sensor_design import refuse_design
from optisense.errors import RenderError
from optisense.keyword_types import plain_numbers
from optisense.optics._render_settings import number_of_photons
from optisense.optics._skin_view import VIEW_ACROSS
from optisense.optics.backend.arrays import indices
from optisense.optics.scene.assembly import Assembly
from optisense.optics.scene.ray_scene import Piece
from optisense.optics.scene.surface_cells import build_cells, cells_near
from optisense.optics.scene.surfaces import Region, SurfaceKind
from optisense.optics.transport.interact import PHOTON_DEPTH
from optisense.optics.transport.light_ledger import SIDES, Fate, trace_ledger
from optisense.optics.transport.photons import TargetCells
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics._model import OpticalModel

VIEW_CELL = 0.5
"""Side (mm) of the cells of the sensing surface that record the part in the camera's view: that of
the radiance cache's cells, and half of `IN_VIEW`."""

IN_VIEW = 1.0
"""Largest distance (mm) from the middle of a cell in view to the nearest end point of the rays of a
96 x 72 picture; on the largest sensor the end points are 0.9 mm apart."""


class LightEnd(StrEnum):
    """The way in which light ends."""

    SEEN = "coating in view"
    UNSEEN = "coating out of view"
    PART = "absorbed by a part"
    MEDIUM = "absorbed in a medium"
    ESCAPED = "escaped"
    LOST = "lost"


Line = TypeVar("Line")

GIVEN_UP = f"given up after {PHOTON_DEPTH} surfaces"
SEEN, UNSEEN = LightEnd.SEEN.value, LightEnd.UNSEEN.value
FACETS = "lost between the facets of rough faces"


@dataclass(frozen=True)
class LedgerEntry:
    """One line of a ledger.

    Attributes:
        group: the light group.
        where: name of the part or medium at which the light ends.
        kind: the way in which the light ends.
        power: power (mW), over all channels and lights of the group.
        share: share of the group's power, 0 to 1.
        noise: standard deviation of the share.
    """

    group: str
    where: str
    kind: LightEnd
    power: float
    share: float
    noise: float


@dataclass(frozen=True)
class LedgerExit:
    """Light of a group that escapes through the faces of a part with one orientation.

    Attributes:
        group: the light group.
        part: the part, or its faces by their name in the design ("guide.edge").
        side: the axis of the design's frame that the faces' outward normals are nearest to, of
            `SIDES`.
        power: power (mW), over all channels and lights of the group.
        share: share of the group's power, 0 to 1.
        noise: standard deviation of the share.
    """

    group: str
    part: str
    side: str
    power: float
    share: float
    noise: float

    @property
    def face(self) -> str:
        """The name of the faces."""
        return f"{self.part}, {self.side}"


@dataclass(frozen=True)
class LightLedger:
    """The balance of each light group's power: the places where its light ends.

    Attributes:
        emitted: power (mW) of each light group.
        entries: its lines, the largest of each group first.
        photons: number of photons that were traced.
        exits: the escaping light by faces, the largest share of each group first.
    """

    emitted: dict[str, float]
    entries: list[LedgerEntry]
    photons: int
    exits: list[LedgerExit]

    def places(self) -> list[str]:
        """Return the places where light ends, in order of decreasing power."""
        total: dict[str, float] = {}
        for entry in self.entries:
            total[entry.where] = total.get(entry.where, 0.0) + entry.power
        return sorted(total, key=lambda where: -total[where])

    def kinds(self) -> dict[str, LightEnd]:
        """Return the way in which light ends at each place."""
        return {entry.where: entry.kind for entry in self.entries}

    def faces(self, least: float = 0.0) -> dict[str, list[float]]:
        """Return the shares of each group that escape through faces, in order of decreasing light.

        Args:
            least: smallest share of a group's light; faces below it for every group are left out.
        """
        found: dict[str, dict[str, float]] = {}
        for each in self.exits:
            found.setdefault(each.face, {})[each.group] = each.share
        rows = {face: [of.get(g, 0.0) for g in self.emitted] for face, of in found.items()}
        shown = [face for face, shares in rows.items() if max(shares) >= least]
        return {face: rows[face] for face in sorted(shown, key=lambda face: -sum(rows[face]))}

    def share(self, group: str, where: str) -> float:
        """Return the share of a group's power that ends at a place; 0 if there is none."""
        found = (e.share for e in self.entries if (e.group, e.where) == (group, where))
        return next(found, 0.0)

    def closing_sum(self, group: str) -> float:
        """Return the sum of all shares of a group, which is 1 up to rounding."""
        return sum(entry.share for entry in self.entries if entry.group == group)

    def as_data(self) -> dict[str, Any]:
        """Return the ledger as plain numbers and names, ready for JSON."""
        return {
            "units": {"power": "mW"},
            "photons": plain_numbers(self.photons),
            "emitted": self.emitted,
            "entries": [vars(entry) for entry in self.entries],
            "exits": [vars(each) for each in self.exits],
        }


def light_ledger(
    model: OpticalModel,
    photons: int | str = PICTURE_PHOTONS,
    seed: int = 0,
    seen: TargetCells | None = None,
) -> LightLedger:
    """Trace photons from all lights in the untouched sensor, and sum their power by where it ends.

    The losses of a photon at all places add up to its power, so that the ledger balances exactly
    despite the noise of its lines.

    Args:
        model: the sensor.
        photons: number of photons of all lights together, or a level of `optisense.quality`.
        seed: seed of the photons.
        seen: result of `cells_in_view` for the model, if it is known.

    Raises:
        DesignError: there is a design instead of a model.
        RenderError: there are too few photons, or there is no such level.
    """
    photons = enough_photons(model, photons)
    pieces = model.scenes.pieces
    seen = cells_in_view(model) if seen is None else seen
    bookings = trace_ledger(
        model.scene, model.scenes.emitter_table, len(pieces), seen, photons, seed
    )
    entries: list[LedgerEntry] = []
    exits: list[LedgerExit] = []
    emitted = {}
    for number, (name, group) in enumerate(model.design.lights.items()):
        emitted[name] = float(group.flux * len(group.lights))
        flux = group.channel_flux()
        lines: dict[tuple[str, LightEnd], NDArray[np.float64]] = {}
        for place in places_of(model.scenes.assembly):
            power = bookings.power[:, number, :, place.surface, place.fate] @ flux
            line = (place.where, place.kind)
            lines[line] = lines.get(line, 0.0) + power
        lines[GIVEN_UP, LightEnd.LOST] += bookings.rest[:, number] @ flux
        entries += sorted(
            (
                LedgerEntry(name, *line, *found)
                for line, found in _lines_with_noise(lines, emitted[name])
            ),
            key=lambda entry: -entry.power,
        )
        faces: dict[tuple[str, str], NDArray[np.float64]] = {}
        for surface, piece in enumerate(pieces):
            for side, words in enumerate(SIDES):
                power = bookings.exits[:, number, :, surface, side] @ flux
                face = (_face_owner(piece), words)
                faces[face] = faces.get(face, 0.0) + power
        exits += sorted(
            (
                LedgerExit(name, *face, *found)
                for face, found in _lines_with_noise(faces, emitted[name])
            ),
            key=lambda each: -each.power,
        )
    return LightLedger(emitted, entries, photons, exits)


def enough_photons(model: OpticalModel, given: int | str) -> int:
    """Return a number of photons, or that of a level; see `number_of_photons`.

    Raises:
        DesignError: there is a design instead of a model.
        RenderError: there is no such level, or there are fewer than 100 photons for each light.
    """
    refuse_design(model)
    photons = number_of_photons(given)
    lights = sum(len(group.lights) for group in model.design.lights.values())
    if photons < 100 * lights:
        raise RenderError(
            f"{photons} photons are too few for {lights} lights",
            hint=f"Give at least {100 * lights}",
        )
    return photons


def _lines_with_noise(
    lines: dict[Line, NDArray[np.float64]], emitted: float
) -> Iterator[tuple[Line, tuple[float, float, float]]]:
    """Yield power (mW), share and noise of the lines that are not empty, from their batches."""
    for line, batches in lines.items():
        power = float(batches.mean())
        if power != 0.0:
            noise = float(batches.std(ddof=1) / np.sqrt(len(batches)))
            yield line, (power, power / emitted, noise / emitted)


def _face_owner(piece: Piece) -> str:
    """Return the name of a surface's solid, or of its faces if the design names them."""
    solids, _, rest = piece.name.partition("|")
    frosted = rest.partition(":")[2]
    return frosted or solids.split("/")[0]


def cells_in_view(model: OpticalModel) -> TargetCells:
    """Return the cells of the sensing surface, with flags for those in the camera's view."""
    mesh = model.sensing
    cells = build_cells(mesh.vertices, mesh.faces, VIEW_CELL)
    rays = model.chief_rays(model.design.camera.size_at(VIEW_ACROSS))
    points = rays.points[rays.hit].astype(np.float64)
    near = cells_near(cells, points, IN_VIEW) if len(points) else np.zeros(cells.cells, dtype=bool)
    return TargetCells(cells, indices(near))


@dataclass(frozen=True)
class LedgerPlace:
    """The meaning of a row of the ledger's sums.

    Attributes:
        surface: number of the surface; the numbers after the last surface stand for the lights
            themselves, in air and in each solid.
        fate: the fate of light at the surface.
        where: name of the part or medium at which the light ends.
        kind: the way in which the light ends.
    """

    surface: int
    fate: Fate
    where: str
    kind: LightEnd


def places_of(assembly: Assembly) -> Iterator[LedgerPlace]:
    """Yield the places of all rows of the sums; several rows may belong to the same place.

    Touching solids of equal media are one medium, as light meets no surface between them.
    """
    media = {name: _together(names) for names in assembly.media.joined for name in names}
    for number, piece in enumerate(assembly.pieces):
        solid, around, (name, kind) = _names(piece)
        yield LedgerPlace(number, Fate.SEEN, SEEN, LightEnd.SEEN)
        yield LedgerPlace(number, Fate.ABSORBED, name, kind)
        for fate, side in ((Fate.BEHIND, solid), (Fate.BEFORE, around)):
            medium = f"absorbed in {media.get(side, side)}"
            yield LedgerPlace(number, fate, medium, LightEnd.MEDIUM)
        yield LedgerPlace(number, Fate.ESCAPED, f"escaped from {solid}", LightEnd.ESCAPED)
    last = len(assembly.pieces)
    for fate in (Fate.SEEN, Fate.ABSORBED, Fate.BEHIND):
        yield LedgerPlace(last, fate, GIVEN_UP, LightEnd.LOST)
    solids = assembly.media.names
    for number in {medium.solid for emitter in assembly.emitters for medium in emitter.media}:
        if number >= 0:
            medium = f"absorbed in {media.get(solids[number], solids[number])}"
            yield LedgerPlace(last + 1 + number, Fate.BEFORE, medium, LightEnd.MEDIUM)
    yield LedgerPlace(last, Fate.ESCAPED, "escaped at once", LightEnd.ESCAPED)


def _together(names: list[str]) -> str:
    """Return two names or more as text."""
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _names(piece: Piece) -> tuple[str, str, tuple[str, LightEnd]]:
    """Return the solid behind a surface, the medium in front, and the part that absorbs at it."""
    kind = piece.surface.kind
    if kind is SurfaceKind.LIGHT:
        return "a light", "front of a light", ("absorbed by lights", LightEnd.PART)
    if kind is not SurfaceKind.DIELECTRIC:
        part = (f"absorbed by {piece.name}", LightEnd.PART)
        seen = piece.surface.region is Region.SENSING
        return piece.name, f"front of {piece.name}", (UNSEEN, LightEnd.UNSEEN) if seen else part
    solids = piece.name.split("|")[0].split("/")
    return solids[0], solids[1] if len(solids) > 1 else "air", (FACETS, LightEnd.LOST)
