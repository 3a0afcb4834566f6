"""Light that contacts reflect to the skin. It varies smoothly, so few rays are averaged over
pixels.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.sequences import seed_of
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import REFERENCE_WIDTH, Film, repeated
from optisense.optics.radiance_cache.cache import RadianceCache
from optisense.optics.radiance_cache.shading import beside_contacts
from optisense.optics.scene.contact_scenes import ContactScenes
from optisense.optics.transport.camera_paths import film_samples, find_visible_points

BESIDE_WIDTH = 1.0 / 40.0
"""Width over which light from contacts is averaged, as a fraction of the image width: half a
millimetre on GelSight Mini."""
BESIDE_DIRECTIONS = 2
"""Number of rays per pixel that sample the light that contacts reflect to the skin beside them, in
an image `REFERENCE_WIDTH` wide; smaller images take more. They are averaged over `BESIDE_WIDTH`,
which leaves noise of some tenths of a per cent."""


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
    if scenes.indenters is None or np.count_nonzero(where) < 2:
        return None
    width, height = camera.width, camera.height
    more = (REFERENCE_WIDTH / width) ** 2
    directions = max(BESIDE_DIRECTIONS, round(BESIDE_DIRECTIONS * more))
    film = Film(width * height, cache.binned.groups)
    pixel, _ = repeated(where, 1)
    first = dr.zeros(mi.UInt32, dr.width(pixel))
    film.count(pixel)
    spots = film_samples(pixel, width, first, seed_of(seed, 3))
    for channel in scenes.full.channels:
        points, _ = find_visible_points(
            scenes.full, camera, pixel, first, spots, seed_of(seed, 10), True, channel
        )
        film.add(points, beside_contacts(cache, scenes, points, directions))
    return film.averaged_layers(width, height, [(where, round(BESIDE_WIDTH * width) | 1)])
