"""Usual durations of scores, which estimate the time left before one is measured."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from optisense.design import SensorDesign
from optisense.objectives.named import are_rays_only, named_in
from optisense.objectives.settings import Settings, size_for
from optisense.quality import SCORE_PHOTONS, photons_of
from optisense.usual_times import LOADING, UsualTimes

USUAL_PLACES = 9
"""Number of presses of a score whose settings name no places, as the OptiSense paper has it."""

IMAGE, IMAGE_PIXELS = 0.1, 0.14
"""Processor seconds of a press, or of the untouched sensor: in any case, and for each 640 x 480
pixels. Less than a whole picture's, because only contacts are lit."""

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
"""Processor seconds of the built-in objectives beside rendering."""

OWN_JUDGING = 0.2
"""Processor seconds that a user's objective is expected to take beside rendering."""

REBUILDING = 0.02
"""Seconds to make the scene of a design that differs from the last one: GelSight Svelte, another
mirror."""

FIRST_JUDGING = 0.4
"""Processor seconds that the first score takes longer, for libraries that it loads."""


STARTED = 0.03
"""The share of the images at which photons are traced, so that most is compiled."""


@dataclass(frozen=True)
class UsualScore:
    """Seconds that scores of a sensor usually take.

    Attributes:
        starting: the first one takes longer than the next, without loading the renderer.
        loading: the renderer takes to be loaded.
        building: the scene takes.
        light: tracing and smoothing take, with each seed or changed shape.
        images: the presses and the untouched sensor take.
        judging: the objectives take beside that.
        libraries: the objectives take longer in the first score.
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
        """The first score, where the renderer is loaded."""
        return self.starting + self.whole + self.libraries

    @property
    def whole(self) -> float:
        """A score with light of its own."""
        return self.light + self.images + self.judging

    @property
    def relit(self) -> float:
        """A score with light that is there."""
        return self.images + self.judging

    def done(self, rendered: float, *, first: bool) -> float:
        """Usual seconds of what is done of a score, but for judging.

        Args:
            rendered: the share of the images that is rendered.
            first: whether it is the first score, which compiles before it traces photons.
        """
        starting = self.starting * min(1.0, rendered / STARTED) if first else 0.0
        return starting + rendered * (self.light + self.images)

    @property
    def share_of_first_image(self) -> float:
        """The share of the first image, with the light that is traced for it, in all rendering."""
        first = self.light + self.images / 10.0
        return first / max(first + 0.9 * self.images, 1e-9)


@dataclass(frozen=True)
class UsualTrials:
    """Seconds that the scores of a search usually take.

    Attributes:
        score: the parts of one score.
        first: the first one takes in all.
        trial: another design takes.
        fresh: the first score with a fresh seed takes.
        fresh_again: another design's score with the same fresh seed takes.
    """

    score: UsualScore
    first: float
    trial: float
    fresh: float
    fresh_again: float

    @staticmethod
    def of(usual: UsualScore, trial: float, fresh_again: float) -> UsualTrials:
        """The usual score of trials that take so many seconds. Without light no score depends on a
        seed.
        """
        first = usual.loading + usual.first
        if usual.light == 0.0:
            return UsualTrials(usual, first, trial, 0.0, 0.0)
        return UsualTrials(usual, first, trial, usual.whole, fresh_again)

    def slower(self, seconds: float) -> UsualTrials:
        """The same where every score takes so much longer."""
        return replace(
            self,
            first=self.first + seconds,
            trial=self.trial + seconds,
            fresh=self.fresh + seconds,
            fresh_again=self.fresh_again + seconds,
        )

    def done(self, rendered: float) -> float:
        """The share of the first score that is done when this share of its images is rendered."""
        done = self.score.loading + self.score.done(rendered, first=True)
        return min(1.0, done / max(self.first, 1e-9))


def usual_score(design: SensorDesign, names: Iterable[str], settings: Settings) -> UsualScore:
    """The usual duration of a sensor's scores by the named objectives, on this machine now."""
    wanted = named_in(names)
    times = UsualTimes.here(design.sensing_area, len(design.lights))
    judging = sum(JUDGING.get(name, OWN_JUDGING) for name in wanted) * times.pace
    building = REBUILDING * times.thread_pace
    loading = 0.6 * LOADING * times.thread_pace
    if are_rays_only(wanted):
        starting = times.preparing() + building
        return UsualScore(starting, loading, building, 0.0, 0.0, judging * times.light)
    width, height = settings.resolution or size_for(design.camera.resolution)
    photons = photons_of(settings.photons or SCORE_PHOTONS)
    presses = USUAL_PLACES if settings.places is None else len(settings.places)
    image = IMAGE + IMAGE_PIXELS * width * height / LARGE_IMAGE
    starting = times.preparing() + times.pilot() + times.compiling()
    return UsualScore(
        starting=starting + building,
        loading=loading,
        building=building,
        light=times.tracing(photons) + times.smoothing(),
        images=(1 + presses) * image * times.shading * times.pace,
        judging=judging,
        libraries=FIRST_JUDGING * times.pace,
    )
