"""Light that contacts reflect to the skin. It varies smoothly, so few rays are averaged over
pixels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.sequences import seed_of
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import REFERENCE_WIDTH, Film, repeated
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.mirrored_contacts import mirrored_contacts
from optisense.optics.radiance_cache.shading import beside_contacts
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.transport.camera_paths import film_samples, find_visible_points

if TYPE_CHECKING:
    from optisense.optics.transport.camera_paths import VisiblePoints

    PointLight = tuple[VisiblePoints, list[mi.Color3f]]
    """Points and their radiance, one colour for each light group."""

MIRRORED_RAYS = 8
"""Number of rays per pixel that sample the light that contacts reflect through the interfaces, in
an image `REFERENCE_WIDTH` wide; smaller images take more. Few of the rays end where a contact
mirrors a lamp; eight give the noise that `NARROW_MIRRORED_WIDTH` states."""
MIRRORED_ROUGHNESS = 0.35
"""GGX alpha of metallic lobes from which on light that contacts reflect through the interfaces is
left out. At 0.4 it is at most 0.2 % of the light around contacts of GelSight Mini, Svelte and
GelBelt, and a tenth of the time of an image."""
BROAD_MIRRORED_RAYS = 1
"""Value of `MIRRORED_RAYS` for lobes that are not narrower than most lamps; one suffices, as they
receive little such light, and evenly from all directions."""
MIRRORED_WIDTH = 1.0 / 40.0
"""Width over which light from contacts is averaged, as a fraction of the image width: half a
millimetre on GelSight Mini."""
NARROW_MIRRORED_WIDTH = 1.0 / 107.0
"""Width over which light that contacts reflect through the interfaces is averaged for narrow lobes:
3 pixels of 320. In a contact of GelSight Mini of specularity 1 this reduces the noise from 10 to 3
% of the mean and adds a blur of 2 %. On the skin within 0.6 mm of a contact of GelBelt,
`MIRRORED_WIDTH` would make red and blue a sixth too dark in front of the flanks that face their
lamps."""
BESIDE_DIRECTIONS = 2
"""Number of rays per pixel that sample the light that contacts reflect to the skin beside them, in
an image `REFERENCE_WIDTH` wide; smaller images take more. They are averaged over `MIRRORED_WIDTH`,
which leaves noise of some tenths of a per cent."""


def mirrored_contact_layers(
    cache: RadianceCache,
    scenes: ContactScenes,
    camera: RayCamera,
    where: NDArray[np.bool_],
    skin: NDArray[np.bool_],
    seed: int,
) -> NDArray[np.float32] | None:
    """Return the radiance due to light that contacts reflect through the interfaces to pixels.

    Args:
        cache: the radiance cache.
        scenes: scenes of the sensor with its contacts.
        where: (h, w) mask of the pixels.
        skin: (h, w) mask of those outside contacts; the light is averaged over them, and over the
            others.
        seed: seed of the rays.

    Returns:
        The radiance (groups, h, w, 3), mW/(mm^2 sr); None if there is none.
    """
    least = MIRRORED_RAYS if cache.binned.narrow_lobes else BROAD_MIRRORED_RAYS
    rays = max(least, round(least * (REFERENCE_WIDTH / camera.width) ** 2))

    def light(points: VisiblePoints) -> PointLight | None:
        return mirrored_contacts(cache, scenes, points, rays)

    width = NARROW_MIRRORED_WIDTH if cache.binned.narrow_lobes else MIRRORED_WIDTH
    over = [(skin, width), (where & ~skin, width)]
    return _averaged_layers(cache.binned.groups, scenes, camera, where, over, (seed, 9), light)


def beside_layers(
    cache: RadianceCache,
    scenes: ContactScenes,
    camera: RayCamera,
    where: NDArray[np.bool_],
    seed: int,
) -> NDArray[np.float32] | None:
    """Return the radiance due to light that contacts reflect to the skin beside them, averaged over
    that skin.

    Args:
        cache: the radiance cache.
        scenes: scenes of the sensor with its contacts.
        where: (h, w) mask of the pixels that see this skin.
        seed: seed of the rays.

    Returns:
        The radiance (groups, h, w, 3), mW/(mm^2 sr); None if there is none.
    """
    more = (REFERENCE_WIDTH / camera.width) ** 2
    directions = max(BESIDE_DIRECTIONS, round(BESIDE_DIRECTIONS * more))

    def light(points: VisiblePoints) -> PointLight:
        return points, beside_contacts(cache, scenes, points, directions)

    over = [(where, MIRRORED_WIDTH)]
    return _averaged_layers(cache.binned.groups, scenes, camera, where, over, (seed, 10), light)


def _averaged_layers(
    groups: int,
    scenes: ContactScenes,
    camera: RayCamera,
    where: NDArray[np.bool_],
    over: list[tuple[NDArray[np.bool_], float]],
    seeds: tuple[int, int],
    light: Callable[[VisiblePoints], PointLight | None],
) -> NDArray[np.float32] | None:
    """Return the radiance (groups, h, w, 3) of what one camera ray through each pixel sees,
    averaged over regions of the image; None if there is none.

    Args:
        groups: number of light groups.
        scenes: scenes of the sensor with its contacts.
        where: pixels (h, w) that the rays go through.
        over: pixels (h, w) that are averaged with one another, and over which fraction of the image
            width.
        seeds: seed of the image, and number of these rays in it.
        light: function of the points seen that returns the points whose light counts, and their
            radiance; None if there are none.
    """
    if scenes.indenters is None or np.count_nonzero(where) < 2:
        return None
    width, height = camera.width, camera.height
    film = Film(width * height, groups)
    pixel, _ = repeated(where, 1)
    first = dr.zeros(mi.UInt32, dr.width(pixel))
    film.count(pixel)
    for channel in scenes.full.channels:
        spots = film_samples(pixel, width, first, seed_of(seeds[0], 3))
        own = seed_of(*seeds)
        main, _ = find_visible_points(scenes.full, camera, pixel, first, spots, own, True, channel)
        found = light(main)
        if found is not None:
            film.add(*found)
    regions = [(region, round(reach * width) | 1) for region, reach in over]
    return film.averaged_layers(width, height, regions)
