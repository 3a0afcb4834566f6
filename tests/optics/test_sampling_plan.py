"""How interreflected light is averaged over the pixels of contacts."""

from __future__ import annotations

import numpy as np
import pytest
from reference_scenes import rays_that_hit

from optisense.optics.imaging.sampling import PixelRegions, SamplingPlan
from optisense.optics.scene.surfaces import Region

WIDTH, HEIGHT = 320, 240


def disc(radius: float) -> PixelRegions:
    """The regions of an image with one round contact of a radius in pixels."""
    rows, columns = np.indices((HEIGHT, WIDTH))
    inside = np.hypot(rows - HEIGHT / 2, columns - WIDTH / 2) < radius
    points = np.zeros((HEIGHT, WIDTH, 3), dtype=np.float32)
    region = np.where(inside, Region.INDENTER, Region.SENSING)
    return PixelRegions.of(rays_that_hit(points, region))


@pytest.mark.parametrize("radius", [7.0, 9.0, 14.0])
def test_averages_in_small_contacts_are_narrower_for_about_as_many_samples(radius: float) -> None:
    large, small = disc(40.0), disc(radius)
    wide, narrow = (SamplingPlan().interreflection_width(each) for each in (large, small))
    usual, more = (SamplingPlan().contact_samples(each)[0] for each in (large, small))
    assert wide == 3
    assert narrow <= radius / 4
    assert more * narrow**2 >= 0.5 * usual * wide**2
