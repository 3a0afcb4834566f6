"""How interreflected light is averaged over the pixels of contacts."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.optics.imaging.sampling import PixelRegions, SamplingPlan
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.chief_rays import ChiefRays, RayOutcome

WIDTH, HEIGHT = 320, 240


def disc(radius: float) -> PixelRegions:
    """The regions of an image with one round contact of a radius in pixels."""
    rows, columns = np.indices((HEIGHT, WIDTH))
    inside = np.hypot(rows - HEIGHT / 2, columns - WIDTH / 2) < radius
    vectors = np.zeros((HEIGHT, WIDTH, 3), dtype=np.float32)
    return PixelRegions.of(
        ChiefRays(
            points=vectors,
            normals=vectors,
            directions=vectors,
            incidence=vectors[..., 0],
            outcome=np.full(inside.shape, RayOutcome.HIT, dtype=np.uint8),
            face=np.zeros(inside.shape, dtype=np.int64),
            region=np.where(inside, Region.INDENTER, Region.SENSING).astype(np.uint8),
            mirrors=np.zeros(inside.shape, dtype=np.uint32),
            reflections=np.zeros(inside.shape, dtype=np.uint32),
        )
    )


@pytest.mark.parametrize("radius", [7.0, 9.0, 14.0])
def test_averages_in_small_contacts_are_narrower_for_about_as_many_samples(radius: float) -> None:
    large, small = disc(40.0), disc(radius)
    wide, narrow = (SamplingPlan().interreflection_width(each) for each in (large, small))
    usual, more = (SamplingPlan().contact_samples(each)[0] for each in (large, small))
    assert wide == 3
    assert narrow <= radius / 4
    assert more * narrow**2 >= 0.5 * usual * wide**2
