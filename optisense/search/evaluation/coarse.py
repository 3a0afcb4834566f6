"""Coarse scores, which a search can use to find the promising trials.

A coarse score is biased, but ranks designs nearly as the full one does (docs/search.md), so it
suffices to tell which trials are worth a full score.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from optisense.design import SensorDesign
from optisense.errors import OptiSenseError, SetupError
from optisense.objectives import Evaluation, Settings
from optisense.objectives.press import press_frame
from optisense.objectives.run import split_settings
from optisense.objectives.settings import ACROSS
from optisense.quality import PHOTONS, SCORE_PHOTONS, photons_of
from optisense.search.evaluation.evaluator import DesignEvaluator

PHOTON_SHARE = 1 / 8
"""Share of the photons of a full score. A half of it saves a tenth of the time of a coarse score of
the cylindrical GelSight Mini, and ranks its designs worse."""

LEAST_PHOTONS = PHOTONS["draft"]
"""Smallest number of photons, unless the full score has fewer: the light of a draft."""

LEAST_SHARE = 1 / 4
"""Smallest width of the images, as a share of that of full scores. Narrower ones save no time."""

CONTACT_PIXELS = 150
"""Number of pixels of the smallest contact in coarse images, unless it has fewer in full ones:
three times the 50 that `reading` needs, because other designs may show the contact smaller."""


def coarse_settings(
    design: SensorDesign, settings: Mapping[str, Any], share: float = LEAST_SHARE
) -> dict[str, Any]:
    """Return the settings of coarse scores for those of full scores: images of a share of their
    width, an eighth of the photons, and all presses in one image, where contacts do not overlap.
    Rays of the camera are not changed: they cost little beside images, and conditions on coverage
    and distortion are then as exact as in a full score.
    """
    width, height = _full_size(design, settings)
    across = math.ceil(share * width)
    photons = photons_of(settings.get("photons") or SCORE_PHOTONS)
    fewer = max(round(photons * PHOTON_SHARE), min(photons, LEAST_PHOTONS))
    return {
        **settings,
        "resolution": [across, max(1, round(across * height / width))],
        "photons": fewer,
        "together": True,
    }


class CoarseEvaluator(DesignEvaluator):
    """Evaluator of coarse scores, whose images are coarse as well (`optisense.optics.drafts`)."""

    coarse = True

    def __init__(self, usual: DesignEvaluator) -> None:
        """Copy the evaluator of full scores; nothing is rendered yet."""
        super().__init__(
            usual.space,
            usual.goals,
            coarse_settings(usual.space.design, usual.settings),
            requirements=[str(each) for each in usual.requirements],
            apart=usual.apart,
            variant=usual.variant,
        )
        self._full = dict(usual.settings)

    @cached_property
    def used_settings(self) -> Mapping[str, Any]:
        """The settings, with images in which contacts have enough pixels."""
        design = self.space.design
        shared, _ = split_settings(self._full, self._all_objectives)
        settings = Settings(**{**shared, "resolution": _full_size(design, self._full)})
        try:
            pixels = _smallest_contact(Evaluation(self.models.model(design), settings))
        except SetupError:
            raise
        except OptiSenseError:  # the start has no score either, and says why
            pixels = 0
        share = math.sqrt(CONTACT_PIXELS / max(pixels, 1))
        return coarse_settings(design, self._full, min(1.0, max(LEAST_SHARE, share)))


def _full_size(design: SensorDesign, settings: Mapping[str, Any]) -> tuple[int, int]:
    """Return the size (width, height) of the images of full scores, pixels."""
    given = Settings(resolution=settings.get("resolution")).resolution
    return given or design.camera.size_at(ACROSS)


def _smallest_contact(evaluation: Evaluation) -> int:
    """Return the number of pixels of the smallest contact: those whose points on the untouched skin
    the ball touches.
    """
    ball, depth = evaluation.settings.radius, evaluation.settings.depth
    reach = math.sqrt(depth * (2.0 * ball - depth))
    rays = evaluation.model.chief_rays(evaluation.resolution)
    points = rays.points[rays.hit]
    surface = evaluation.model.surface
    places = [press_frame(contact, surface).place for contact in evaluation.contacts]
    return min(int((np.linalg.norm(points - each, axis=1) < reach).sum()) for each in places)
