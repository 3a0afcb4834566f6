"""The same things pressed at the same places into two sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion
from scipy.spatial import cKDTree

from optisense.errors import ContactError, TaskError
from optisense.geometry import Contact, TriangleMesh
from optisense.geometry.objects import OBJECTS, ObjectIndenter
from optisense.geometry.surface import closest_points
from optisense.tasks.draws import PLACES_SEEN

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

FloatArray = NDArray[np.float64]

CANDIDATES = 1500
"""Places on the skin among which those of presses are chosen."""

CHOICES = 12
"""Places that are drawn for each press, of which the one farthest from all earlier ones is taken:
Mitchell's best candidate, which spreads presses over the skin without a pattern."""

ATTEMPTS = 8
"""Places that are tried for a press before it is made less deep, as some lie over an edge."""

ONE_SKIN = 0.1
"""mm within which two sensing surfaces count as one: less than objects are pressed in by far."""

SAMPLED = 200
"""Corners of a sensing surface whose distance from the other one is looked at."""

FITS = 0.8
"""Share of the narrower side of the seen skin that an object may be long; all are scaled to it."""

RIM = 0.12
"""Share of the same that a press keeps away from the border of the skin."""

VIEW_RIM = 0.2
"""Share of the same that a press keeps away from the border of what a camera sees, so that most of
an object is in the picture."""

MOST_DEEP = 0.4
"""Largest share of the gel's thickness that an object is pressed in: gels that are pressed deeper
tear."""

SHALLOWER = (1.0, 0.7, 0.5, 0.35, 0.25)
"""Factors on an object's depth that are tried until the gel is thick enough."""


@dataclass(frozen=True)
class UnseenPress:
    """Something that is pressed into two sensors alike.

    Attributes:
        name: of the object.
        contacts: into the first and into the second sensor.
    """

    name: str
    contacts: tuple[Contact, Contact]


@dataclass(frozen=True)
class UnseenPresses:
    """Presses of the same objects into two sensors.

    Attributes:
        presses: as many for each object, object by object.
        scale: factor on the real sizes of all objects; 1 where they fit.
        same_places: whether both have one skin and are pressed at the same places of it; else the
            places of each are chosen on its own skin.
    """

    presses: list[UnseenPress]
    scale: float
    same_places: bool


@dataclass
class _Skin:
    """A skin that one sensor has, or both, and the places on it where presses may be."""

    models: Sequence[OpticalModel]
    seed: int
    points: FloatArray = field(init=False)
    room: float = field(init=False)
    chosen: list[FloatArray] = field(default_factory=list)

    def __post_init__(self) -> None:
        points = _seen_places(self.models, self.seed)
        seen = [model.chief_rays(PLACES_SEEN) for model in self.models]
        self.room = max(_narrower_side(rays.points[rays.hit].astype(np.float64)) for rays in seen)
        self.points = points[_inside(points, self.models, RIM * self.room)]
        if not len(self.points):
            raise TaskError("the cameras see only the border of the sensing surface")

    def press(
        self, indenter: ObjectIndenter, depth: float, rotation: float, rng: np.random.Generator
    ) -> list[Contact]:
        """A contact with each of the models, at one place far from those before.

        Raises:
            ContactError: the gel is too thin for the depth wherever it was tried.
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
    models: tuple[OpticalModel, OpticalModel], objects: Sequence[str], places: int, seed: int
) -> UnseenPresses:
    """Choose where and how objects press, on the skin that either sensor's camera sees.

    Args:
        models: the two sensors. objects: keys of `OBJECTS`. places: presses of each object.
        seed: of places and turns.

    Raises:
        TaskError: the cameras see nothing, or an object can be pressed nowhere.
    """
    alike = _have_one_skin(models)
    skins = [_Skin(models, seed)] if alike else [_Skin([each], seed) for each in models]
    longest = max(max(OBJECTS[name].size) for name in objects)
    scale = min(1.0, FITS * min(skin.room for skin in skins) / longest)
    presses = []
    for number, name in enumerate(objects):
        for place in range(places):
            presses.append(_one(skins, ObjectIndenter(name, scale), [seed, number, place]))
    return UnseenPresses(presses, scale, alike)


def _have_one_skin(models: tuple[OpticalModel, OpticalModel]) -> bool:
    """Whether both sensing surfaces lie on each other, each within `ONE_SKIN`."""
    meshes = [model.surface.mesh for model in models]
    for here, there in (meshes, meshes[::-1]):
        step = max(1, len(here.vertices) // SAMPLED)
        for vertex in here.vertices[::step]:
            near = closest_points(there, vertex)
            if np.nanmin(np.linalg.norm(near - vertex, axis=1)) > ONE_SKIN:
                return False
    return True


def _one(skins: Sequence[_Skin], indenter: ObjectIndenter, seed: list[int]) -> UnseenPress:
    """One press into both sensors, equally deep."""
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
    """A contact at the place of a sensor's skin that is nearest to a point.

    Raises:
        ContactError: the gel there is too thin for the depth.
    """
    x, y, z = model.surface.nearest(point).point.tolist()
    # A place where it would fit much deeper as well is one where it may press so deep.
    model.place(Contact(indenter, point=(x, y, z), depth=depth / MOST_DEEP, rotation=rotation))
    return Contact(indenter, point=(x, y, z), depth=depth, rotation=rotation)


def _far_from(chosen: list[FloatArray], candidates: FloatArray) -> FloatArray:
    if not chosen:
        return candidates[0]
    away, _ = cKDTree(np.array(chosen)).query(candidates)
    return candidates[int(np.argmax(away))]


def _seen_places(models: Sequence[OpticalModel], seed: int) -> FloatArray:
    """Points (n, 3) mm, evenly by area, that a camera sees."""
    from optisense.optics.transport.chief_rays import pixel_areas

    found: list[FloatArray] = []
    density = 0.0
    for number, model in enumerate(models):
        rays = model.chief_rays(PLACES_SEEN)
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
            # Between neighbouring candidates lies about this much.
            away, _ = cKDTree(np.concatenate(found)).query(points)
            points = points[away > 2.0 / np.sqrt(density)]
        found.append(points)
    return np.concatenate(found)


def _away_from_the_border(points: FloatArray, areas: FloatArray) -> FloatArray:
    """Areas (h, w) of pixels, 0 where they are near the border of what is seen; the points are
    (h, w, 3) mm. All of them where nothing else is left.
    """
    seen = areas > 0.0
    border = seen & ~binary_erosion(seen)
    near = VIEW_RIM * _narrower_side(points[seen])
    away = np.zeros(seen.shape)
    away[seen] = cKDTree(points[border]).query(points[seen])[0]
    kept = np.where(away > near, areas, 0.0)
    return kept if kept.any() else areas


def _narrower_side(points: FloatArray) -> float:
    """mm, the second longest extent of points along their main axes."""
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    return float(np.sort(np.ptp(centred @ axes.T, axis=0))[-2])


def _inside(points: FloatArray, models: Sequence[OpticalModel], rim: float) -> NDArray[np.bool_]:
    """(n,) whether points keep away from the border of every model's skin."""
    kept = np.ones(len(points), dtype=bool)
    for model in models:
        border = _border(model.surface.mesh)
        if len(border):
            away, _ = cKDTree(border).query(points)
            kept &= away > rim
    return kept


def _border(mesh: TriangleMesh) -> FloatArray:
    """(n, 3) mm: points along the edges that only one triangle has."""
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    each, count = np.unique(edges, axis=0, return_counts=True)
    start, end = mesh.vertices[each[count == 1]].transpose(1, 0, 2)
    shares = np.linspace(0.0, 1.0, 9)[:, None, None]
    points: FloatArray = (start + shares * (end - start)).reshape(-1, 3)
    return points
