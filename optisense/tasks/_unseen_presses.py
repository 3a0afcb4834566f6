"""Presses of the same objects at the same places into two sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion
from scipy.spatial import cKDTree

from optisense.array_types import FloatArray
from optisense.errors import ContactError, TaskError
from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.mesh_points import closest_points
from optisense.geometry.objects import OBJECTS, ObjectIndenter
from optisense.tasks._draws import rays_of_places

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

CANDIDATES = 1500
"""Number of places on the skin from which those of presses are chosen: far more than presses, so
that they may lie anywhere.
"""

CHOICES = 12
"""Number of places drawn for each press, of which the one farthest from all earlier presses is
taken (Mitchell's best-candidate sampling, which spreads presses over the skin without a
pattern)."""

ATTEMPTS = 8
"""Number of places tried for a press before its depth is reduced, as some lie over an edge."""

ONE_SKIN = 0.1
"""Largest distance (mm) between two sensing surfaces that are one, far below press depths."""

SAMPLED = 200
"""Number of vertices of a sensing surface whose distance from the other surface is computed, spread
over it; skins that differ do so over large areas.
"""

FITS = 0.8
"""Largest length of an object as a share of the narrower side of the skin in view; all objects are
scaled to it, so that skin remains visible around them."""

RIM = 0.12
"""Margin between a press and the border of the skin, as a share of the narrower side of the skin in
view, so that the border affects the shape of the skin little."""

VIEW_RIM = 0.2
"""Margin between a press and the border of a camera's view, as a share of the narrower side of the
skin in view, so that most of an object is in the picture."""

MOST_DEEP = 0.4
"""Largest depth of a press as a share of the gel's thickness; gels that are pressed deeper tear."""

SHALLOWER = (1.0, 0.7, 0.5, 0.35, 0.25)
"""Factors on an object's depth that are tried until the gel is thick enough."""


@dataclass(frozen=True)
class UnseenPress:
    """The press of one object into two sensors.

    Attributes:
        name: name of the object.
        contacts: the contacts with the first and with the second sensor.
    """

    name: str
    contacts: tuple[Contact, Contact]


@dataclass(frozen=True)
class UnseenPresses:
    """Presses of the same objects into two sensors.

    Attributes:
        presses: the presses in the order of objects, the same number for each.
        scale: factor on the real sizes of all objects; 1 if they fit.
        same_places: whether both sensors have the same skin and are pressed at the same places;
            otherwise places are chosen on each skin separately.
    """

    presses: list[UnseenPress]
    scale: float
    same_places: bool


@dataclass
class _Skin:
    """The skin of one sensor, or of both, and its possible places of presses."""

    models: Sequence[OpticalModel]
    seed: int
    resolution: tuple[int, int] | None
    points: FloatArray = field(init=False)
    room: float = field(init=False)
    chosen: list[FloatArray] = field(default_factory=list)

    def __post_init__(self) -> None:
        points = _seen_places(self.models, self.seed, self.resolution)
        seen = [rays_of_places(model, self.resolution) for model in self.models]
        self.room = max(_narrower_side(rays.points[rays.hit].astype(np.float64)) for rays in seen)
        self.points = points[_inside(points, self.models, RIM * self.room)]
        if not len(self.points):
            raise TaskError("the cameras see only the border of the sensing surface")

    def press(
        self, indenter: ObjectIndenter, depth: float, rotation: float, rng: np.random.Generator
    ) -> list[Contact]:
        """Return a contact with each of the models, at one place far from earlier ones;
        ContactError is raised if the gel is too thin for the depth at all places that were tried.
        """
        for attempt in range(ATTEMPTS):
            point = _far_from(
                self.chosen, self.points[rng.integers(len(self.points), size=CHOICES)]
            )
            try:
                found = [_pressed(each, indenter, point, depth, rotation) for each in self.models]
            except ContactError:
                if attempt == ATTEMPTS - 1:
                    raise
                continue
            self.chosen.append(point)
            return found
        raise AssertionError("there is at least one attempt")


def choose_presses(
    models: tuple[OpticalModel, OpticalModel],
    objects: Sequence[str],
    places: int,
    seed: int,
    resolution: tuple[int, int] | None = None,
) -> UnseenPresses:
    """Choose places, depths and rotations of objects, keys of `OBJECTS`, on the skin that either
    sensor's camera sees, with a number of places for each object.

    Only the aspect ratio of the resolution matters; if it is None, that of each camera is taken.
    TaskError is raised if the cameras see nothing, or if there is no place for an object.
    """
    alike = _have_one_skin(models)
    groups: list[Sequence[OpticalModel]] = [models] if alike else [[each] for each in models]
    skins = [_Skin(group, seed, resolution) for group in groups]
    longest = max(max(OBJECTS[name].size) for name in objects)
    scale = min(1.0, FITS * min(skin.room for skin in skins) / longest)
    presses = []
    for number, name in enumerate(objects):
        for place in range(places):
            presses.append(_one(skins, ObjectIndenter(name, scale), [seed, number, place]))
    return UnseenPresses(presses, scale, alike)


def _have_one_skin(models: tuple[OpticalModel, OpticalModel]) -> bool:
    """Return whether each sensing surface lies within `ONE_SKIN` of the other."""
    meshes = [model.surface.mesh for model in models]
    for here, there in (meshes, meshes[::-1]):
        sampled = here.vertices[:: max(1, len(here.vertices) // SAMPLED)]
        # A vertex near one of the other surface is near that surface.
        away, _ = cKDTree(there.vertices).query(sampled)
        for vertex in sampled[away > ONE_SKIN]:
            near = closest_points(there, vertex)
            if np.nanmin(np.linalg.norm(near - vertex, axis=1)) > ONE_SKIN:
                return False
    return True


def _one(skins: Sequence[_Skin], indenter: ObjectIndenter, seed: list[int]) -> UnseenPress:
    """Return one press into both sensors at equal depth."""
    rng = np.random.default_rng(seed)
    rotation = float(rng.uniform(0.0, 360.0))
    reason: ContactError | None = None
    for factor in SHALLOWER:
        depth = factor * indenter.scale * OBJECTS[indenter.name].depth
        try:
            found = [skin.press(indenter, depth, rotation, rng) for skin in skins]
        except ContactError as error:
            reason = error
            continue
        first, second = (contact for contacts in found for contact in contacts)
        return UnseenPress(indenter.name, (first, second))
    raise TaskError(f"the {indenter.name} can be pressed nowhere: {reason}") from reason


def _pressed(
    model: OpticalModel, indenter: ObjectIndenter, point: FloatArray, depth: float, rotation: float
) -> Contact:
    """Return a contact at the place of a sensor's skin that is nearest to a point (mm);
    ContactError is raised if the gel there is too thin for the depth.
    """
    x, y, z = model.surface.nearest(point).point.tolist()
    # The place is accepted if the object could also be pressed in deeper, by a factor of 1 /
    # MOST_DEEP.
    model.place(Contact(indenter, point=(x, y, z), depth=depth / MOST_DEEP, rotation=rotation))
    return Contact(indenter, point=(x, y, z), depth=depth, rotation=rotation)


def _far_from(chosen: list[FloatArray], candidates: FloatArray) -> FloatArray:
    if not chosen:
        return candidates[0]
    away, _ = cKDTree(np.array(chosen)).query(candidates)
    return candidates[int(np.argmax(away))]


def _seen_places(
    models: Sequence[OpticalModel], seed: int, resolution: tuple[int, int] | None
) -> FloatArray:
    """Return points (n, 3), mm, that a camera sees, distributed uniformly by area."""
    from optisense.optics.transport.chief_rays import pixel_areas

    found: list[FloatArray] = []
    density = 0.0
    for number, model in enumerate(models):
        rays = rays_of_places(model, resolution)
        areas = np.where(rays.hit, pixel_areas(rays), 0.0)
        if not areas.any():
            raise TaskError("a camera sees nothing of the sensing surface")
        areas = _away_from_the_border(rays.points.astype(np.float64), areas)
        density = density or CANDIDATES / float(areas.sum())
        rng = np.random.default_rng([seed, number])
        pixels = rng.choice(
            areas.size, max(1, round(density * areas.sum())), p=(areas / areas.sum()).ravel()
        )
        points = rays.points.reshape(-1, 3)[pixels].astype(np.float64)
        if found:
            # The distance of neighbouring candidates is about this.
            away, _ = cKDTree(np.concatenate(found)).query(points)
            points = points[away > 2.0 / np.sqrt(density)]
        found.append(points)
    return np.concatenate(found)


def _away_from_the_border(points: FloatArray, areas: FloatArray) -> FloatArray:
    """Return areas (h, w) of pixels that see points (h, w, 3), mm, set to 0 near the border of the
    view; unchanged if none would remain.
    """
    seen = areas > 0.0
    border = seen & ~binary_erosion(seen)
    near = VIEW_RIM * _narrower_side(points[seen])
    away = np.zeros(seen.shape)
    away[seen] = cKDTree(points[border]).query(points[seen])[0]
    kept = np.where(away > near, areas, 0.0)
    return kept if kept.any() else areas


def _narrower_side(points: FloatArray) -> float:
    """Return the second longest extent (mm) of points along their principal axes."""
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    return float(np.sort(np.ptp(centred @ axes.T, axis=0))[-2])


def _inside(points: FloatArray, models: Sequence[OpticalModel], rim: float) -> NDArray[np.bool_]:
    """Return a mask (n,) of the points at least ``rim`` (mm) from the border of each skin."""
    kept = np.ones(len(points), dtype=bool)
    for model in models:
        border = _border(model.surface.mesh)
        if len(border):
            away, _ = cKDTree(border).query(points)
            kept &= away > rim
    return kept


def _border(mesh: TriangleMesh) -> FloatArray:
    """Return points (n, 3), mm, along the edges that belong to a single triangle."""
    start, end = mesh.vertices[mesh.open_edges].transpose(1, 0, 2)
    shares = np.linspace(0.0, 1.0, 9)[:, None, None]
    points: FloatArray = (start + shares * (end - start)).reshape(-1, 3)
    return points
