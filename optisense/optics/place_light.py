"""The light at a place of the sensing surface: its power, light groups, paths and directions.

It explains the brightness of a place in the untouched sensor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.geometry.mesh_points import surface_samples
from optisense.keyword_types import plain_numbers
from optisense.optics.ledger import cells_in_view, enough_photons
from optisense.optics.transport.light_ledger import BATCHES
from optisense.optics.transport.photons import TargetCells
from optisense.optics.transport.place_light import Disc, LightWay, trace_to_place
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics._model import OpticalModel

Place = tuple[float, float] | tuple[float, float, float]
"""Coordinates (mm) on the sensing surface, or a point (mm) in the frame of the design."""

PLACE_RADIUS = 1.0
"""Radius (mm) around a place within which landings count as its light. A million photons on
GelSight Mini then give some thousand landings; light varies by some per cent over such a disc."""

AREA_STEP = 0.02
"""Spacing (mm) of the samples that measure the area of skin within the disc, to about 0.2 %."""

WAY_WORDS = {
    LightWay.REFRACTED: "refracted only",
    LightWay.REFLECTED: "reflected inside the optics",
    LightWay.MIRRORED: "by mirrors",
    LightWay.SCATTERED_BY_PARTS: "scattered by other parts",
    LightWay.SCATTERED_BY_COATING: "scattered by the coating elsewhere",
}
"""Names of the kinds of light paths in pages and tables, from the shortest to the longest path."""


@dataclass(frozen=True)
class GroupLight:
    """The light that one light group brings to a place.

    Attributes:
        irradiance: irradiance (mW/mm^2) on the skin, over all channels and lights of the group.
        noise: standard deviation of the irradiance, relative to it.
        of_mean: the irradiance over its mean on the skin in the camera's view.
        ways: shares of the irradiance by kind of path (see `WAY_WORDS`); they add up to 1.
        sky: (9, 12) shares of the irradiance by the direction of incidence: the angle to the normal
            of the skin in steps of 10 degrees, and the azimuth in steps of 30 degrees,
            anticlockwise from the picture's right.
        mean_angle: mean angle (degrees) between the light and the normal of the skin.
        main_azimuth: azimuth (degrees) of the mean direction from which the light comes,
            anticlockwise from the picture's right, -180 to 180.
    """

    irradiance: float
    noise: float
    of_mean: float
    ways: dict[str, float]
    sky: NDArray[np.float64]
    mean_angle: float
    main_azimuth: float


@dataclass(frozen=True, eq=False)
class PlaceLight:
    """The light at a place.

    Attributes:
        at: the requested place, mm.
        point: (3,) position (mm) in the design's frame.
        groups: the light of each light group; groups that are off are left out.
        photons: number of photons that were traced.
    """

    at: Place
    point: NDArray[np.float64]
    groups: dict[str, GroupLight]
    photons: int

    def as_data(self) -> dict[str, Any]:
        """Return the values as plain numbers and names, ready for JSON."""
        return {
            "units": {"irradiance": "mW/mm^2", "length": "mm", "angle": "degree"},
            "at": plain_numbers(list(self.at)),
            "point": self.point.tolist(),
            "photons": plain_numbers(self.photons),
            "groups": {
                name: {
                    "irradiance": each.irradiance,
                    "noise": each.noise,
                    "of_mean_in_view": each.of_mean,
                    "ways": each.ways,
                    "mean_angle": each.mean_angle,
                    "main_azimuth": each.main_azimuth,
                    "sky": each.sky.tolist(),
                }
                for name, each in self.groups.items()
            },
        }


def light_at(
    model: OpticalModel,
    at: Place,
    photons: int | str = PICTURE_PHOTONS,
    seed: int = 0,
    seen: TargetCells | None = None,
) -> PlaceLight:
    """Trace photons from all lights, and analyse those that land at a place of the untouched skin.

    Args:
        model: the sensor.
        at: the place, given like that of a contact: two coordinates (mm) on the sensing surface, or
            a point (mm) near it in the frame of the design.
        photons: number of photons of all lights together, or a level of `optisense.quality`.
        seed: seed of the photons.
        seen: result of `cells_in_view` for the model, if it is known.

    Raises:
        ContactError: the place is off the surface.
        RenderError: there are too few photons, or there is no such level.
    """
    photons = enough_photons(model, photons)
    place = model.surface.point_at(*at) if len(at) == 2 else model.surface.nearest(at)
    right, _ = model.surface.tangents(place.inward)
    up = np.cross(place.inward, right)
    up *= np.sign(up @ model.surface.v_axis)
    disc = Disc(place.point, place.inward, right, up, PLACE_RADIUS)
    seen = cells_in_view(model) if seen is None else seen
    landed, moments, in_view = trace_to_place(
        model.scene, model.scenes.emitter_table, disc, seen, photons, seed
    )
    area = _area_within(model.sensing.triangles, disc)
    view_area = float(seen.cells.areas[np.asarray(seen.flags) != 0].sum())
    groups = {}
    for number, (name, group) in enumerate(model.design.lights.items()):
        flux = group.channel_flux()
        power = landed[:, number] @ flux  # (batches, ways, tilts, turns)
        total = power.mean(axis=0).sum()
        mean = float((in_view[:, number] @ flux).mean()) / max(view_area, 1e-12)
        if mean > 0.0 or total > 0.0:
            groups[name] = _group_light(power, moments[number] @ flux, area, mean)
    return PlaceLight(at, place.point, groups, photons)


def _group_light(
    power: NDArray[np.float64], moments: NDArray[np.float64], area: float, mean: float
) -> GroupLight:
    """Return the light of a group from the power (n, ways, tilts, turns), mW, of n batches in a
    disc.

    ``moments`` holds the sums (3,) of the power times its angle to the normal (degrees), and times
    the components of its direction to the right and to the top of the picture; ``area`` is the area
    of the disc's skin (mm^2), and ``mean`` the mean irradiance in view (mW/mm^2).
    """
    shares = power.mean(axis=0)
    total = float(shares.sum())
    batches = power.sum(axis=(1, 2, 3))
    noise = float(batches.std(ddof=1) / np.sqrt(BATCHES)) / total if total > 0.0 else 0.0
    shares = shares / total if total > 0.0 else shares
    return GroupLight(
        irradiance=total / area,
        noise=noise,
        of_mean=total / area / mean if mean > 0.0 else 0.0,
        ways={words: float(shares[way].sum()) for way, words in WAY_WORDS.items()},
        sky=shares.sum(axis=0),
        mean_angle=float(moments[0] / total) if total > 0.0 else 0.0,
        main_azimuth=float(np.degrees(np.arctan2(moments[2], moments[1]))),
    )


def _area_within(triangles: NDArray[np.floating], disc: Disc) -> float:
    """Return the area (mm^2) of triangles (n, 3, 3) within a ball around the centre of a disc."""
    chosen = np.asarray(_near(triangles, disc), dtype=np.float64)
    # Large triangles near the disc are divided until they are smaller than it.
    while len(chosen) and (sides := _longest(chosen)).max() > disc.radius:
        chosen = np.concatenate([chosen[sides <= disc.radius], _quarters(chosen, sides, disc)])
    faces = np.arange(3 * len(chosen)).reshape(-1, 3)
    points, _, areas = surface_samples(chosen.reshape(-1, 3), faces, AREA_STEP)
    offsets = points - disc.middle[:, None]
    return float(areas[(offsets**2).sum(axis=0) < disc.radius**2].sum())


def _longest(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1))


def _quarters(
    triangles: NDArray[np.float64], sides: NDArray[np.float64], disc: Disc
) -> NDArray[np.floating]:
    """Divide triangles larger than the disc's radius into quarters, and drop those far away."""
    a, b, c = np.moveaxis(triangles[sides > disc.radius], 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    pieces = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return _near(np.concatenate([np.stack(piece, axis=1) for piece in pieces]), disc)


def _near(triangles: NDArray[np.floating], disc: Disc) -> NDArray[np.floating]:
    """Return those of triangles (n, 3, 3) whose boxes meet the box around a disc."""
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    meet = (low < disc.middle + disc.radius) & (high > disc.middle - disc.radius)
    return triangles[meet.all(axis=1)]
