"""Usual durations of scores, which estimate the time left before one is measured."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from optisense.design import SensorDesign
from optisense.objectives.named import are_rays_only, named_in
from optisense.objectives.settings import ACROSS, Settings
from optisense.quality import SCORE_PHOTONS, photons_of
from optisense.usual_times import LOADING, UsualTimes

USUAL_PLACES = 9
"""Number of presses of a score whose settings name no places, that of the OptiSense paper."""

IMAGE, IMAGE_PIXELS = 0.1, 0.14
"""Processor time (s) of an image of a press or of the untouched sensor: a constant part, and a part
for each 640 x 480 pixels. It is less than that of a whole picture, because only contacts are
lit."""

LARGE_IMAGE = 640 * 480
"""Number of pixels of an image for which `IMAGE_PIXELS` is stated."""

JUDGING = {
    "rgb2normal": 0.15,
    "normdiff": 0.22,
    "aoap": 0.02,
    "2to3pw": 0.015,
    "reading": 0.5,
    "depth": 0.6,
    "sharpness": 0.05,
    "uniformity": 0.02,
    "shadow": 2.0,
    "power": 0.0,
}
"""Processor time (s) of the built-in objectives in addition to rendering."""

OWN_JUDGING = 0.2
"""Expected processor time (s) of a user's objective in addition to rendering, about that of
NormDiff; its true time is unknown before it has run.
"""

REBUILDING = 0.02
"""Time (s) to build the scene of a design that differs from the last one, measured on GelSight
Svelte with another mirror."""

FIRST_JUDGING = 0.4
"""Additional processor time (s) of the first score, for libraries that it loads."""


STARTED = 0.03
"""Share of the images at which photons are being traced, so that most kernels are compiled."""


@dataclass(frozen=True)
class UsualScore:
    """Usual times of the scores of a sensor, in seconds.

    Attributes:
        starting: additional time of the first score, without loading the renderer.
        loading: time to load the renderer.
        building: time to build the scene.
        light: time of tracing and smoothing, for each seed or changed shape.
        images: time of the images of the presses and of the untouched sensor.
        judging: additional time of the objectives.
        libraries: additional time of the objectives in the first score.
    """

    starting: float
    loading: float
    building: float
    light: float
    images: float
    judging: float
    libraries: float = 0.0

    @property
    def first(self) -> float:
        """Time (s) of the first score, with the renderer loaded."""
        return self.starting + self.whole + self.libraries

    @property
    def whole(self) -> float:
        """Time (s) of a score for which light is traced."""
        return self.light + self.images + self.judging

    @property
    def relit(self) -> float:
        """Time (s) of a score with existing light."""
        return self.images + self.judging

    def done(self, rendered: float, *, first: bool) -> float:
        """Return the usual time (s) of the finished part of a score, without the objectives' own.

        Args:
            rendered: the rendered share of the images.
            first: whether it is the first score, which compiles kernels before it traces photons.
        """
        starting = self.starting * min(1.0, rendered / STARTED) if first else 0.0
        return starting + rendered * (self.light + self.images)

    @property
    def share_of_first_image(self) -> float:
        """Return the share of the first image, with tracing its light, in all rendering time."""
        first = self.light + self.images / 10.0
        return first / max(first + 0.9 * self.images, 1e-9)


@dataclass(frozen=True)
class UsualTrials:
    """Usual times of the scores of a search, in seconds.

    Attributes:
        score: the times of the parts of one score.
        first: total time of the first score.
        trial: time of the score of another design.
        fresh: time of the first score with a fresh seed.
        fresh_again: time of another design's score with the same fresh seed.
    """

    score: UsualScore
    first: float
    trial: float
    fresh: float
    fresh_again: float

    @staticmethod
    def of(usual: UsualScore, trial: float, fresh_again: float) -> UsualTrials:
        """Return the usual times of trials of a given time (s); only light depends on seeds."""
        first = usual.loading + usual.first
        if usual.light == 0.0:
            return UsualTrials(usual, first, trial, 0.0, 0.0)
        return UsualTrials(usual, first, trial, usual.whole, fresh_again)

    def slower(self, seconds: float) -> UsualTrials:
        """Return the same times with ``seconds`` added to every score."""
        return replace(
            self,
            first=self.first + seconds,
            trial=self.trial + seconds,
            fresh=self.fresh + seconds,
            fresh_again=self.fresh_again + seconds,
        )

    def done(self, rendered: float) -> float:
        """Return the finished share of the first score at the share ``rendered`` of its images."""
        done = self.score.loading + self.score.done(rendered, first=True)
        return min(1.0, done / max(self.first, 1e-9))


def usual_score(design: SensorDesign, names: Iterable[str], settings: Settings) -> UsualScore:
    """Return the usual times of a sensor's scores by the objectives, at this machine's load."""
    wanted = named_in(names)
    times = UsualTimes.here(design.sensing_area, len(design.lights))
    judging = sum(JUDGING.get(name, OWN_JUDGING) for name in wanted) * times.pace
    building = REBUILDING * times.thread_pace
    loading = 0.6 * LOADING * times.thread_pace
    if are_rays_only(wanted):
        starting = times.preparing() + building
        return UsualScore(starting, loading, building, 0.0, 0.0, judging * times.light)
    width, height = settings.resolution or design.camera.size_at(ACROSS)
    photons = photons_of(settings.photons or SCORE_PHOTONS)
    presses = USUAL_PLACES if settings.places is None else len(settings.places)
    images = 2 if settings.together else 1 + presses
    image = IMAGE + IMAGE_PIXELS * width * height / LARGE_IMAGE
    starting = times.preparing() + times.pilot() + times.compiling()
    return UsualScore(
        starting=starting + building,
        loading=loading,
        building=building,
        light=times.tracing(photons) + times.smoothing(),
        images=images * image * times.shading * times.pace,
        judging=judging,
        libraries=FIRST_JUDGING * times.pace,
    )
