"""Coarse images, from which a search learns which designs are worth full scores.

Like a draft (`optisense.optics.drafts`), a coarse image has wide surface cells, few camera samples
and contacts of few facets. Unlike a draft, it reuses nothing of earlier designs, so that the score
of a design does not depend on those scored before it.
"""

from __future__ import annotations

from optisense.optics._draft_light import DRAFT_CELL_SCALE, DRAFT_PILOT_PHOTONS
from optisense.optics._model import OpticalModel
from optisense.optics.drafts import DraftView
from optisense.optics.radiance_cache.store import CELL_SIZE, CacheStore


class CoarseCacheStore(CacheStore):
    """Store of radiance caches in wide cells."""

    cell_size = DRAFT_CELL_SCALE * CELL_SIZE
    thorough = False
    uses_pilot = False
    pilot_photons = DRAFT_PILOT_PHOTONS


class CoarseModel(OpticalModel):
    """An `OpticalModel` for coarse images, which take about a sixth of the time."""

    is_draft = True
    view_type = DraftView
    store_type = CoarseCacheStore
