"""The limits at which the tracing of photons ends, and the passes in which photons are traced."""

from __future__ import annotations

import time
from dataclasses import dataclass

PASS_PHOTONS = 500_000
"""Number of photons of one pass. A pass of this size keeps the photon map near 30 MB; progress is
reported and Ctrl-C obeyed between passes."""
MAX_SINGLE_PASS = 2.5 * PASS_PHOTONS
"""Number of photons below which all are traced in one pass, as each pass has a fixed cost: fewer
than three passes save more by it than their photon map costs in memory (75 MB)."""
MAX_PHOTONS = 512_000_000
"""Number of photons at which tracing ends even if the wanted noise is not reached. The noise of the
light is then about 0.1 %, a thirtieth of that of a normal image."""
LARGEST_GUESS = 0.95
"""Largest completed fraction that is reported before a limit is reached, where it is estimated from
the noise or the time; the rest is for the noise, which decreases unevenly."""
TRACING_SHARE = 0.8
"""Share of a time limit for the tracing; the rest is for smoothing and shading."""


@dataclass(frozen=True)
class Passes:
    """The passes in which photons are traced.

    Attributes:
        per_light: number of photons of each light in a pass.
        photons: number of photons of a pass.
        most: number of passes at which tracing ends in any case.
    """

    per_light: int
    photons: int
    most: int


@dataclass(frozen=True)
class TracingLimits:
    """The limits of the tracing, which ends at the first that is reached.

    Attributes:
        photons: number of photons to emit; None for no such limit.
        noise: relative RMS noise to reach; None for no such limit.
        seconds: time (s) since ``began``; None for no such limit.
        most: number of photons at which tracing ends in any case.
        began: start of the render (`time.perf_counter`).
    """

    photons: int | None = None
    noise: float | None = None
    seconds: float | None = None
    most: int = MAX_PHOTONS
    began: float = 0.0

    @property
    def counts_only(self) -> bool:
        """Whether the number of photons is the one limit."""
        return self.photons is not None and self.noise is None and self.seconds is None

    def passes(self, lights: int) -> Passes:
        """Return the passes for a number of lights, all of which emit equally many photons."""
        few = self.photons is not None and self.photons < MAX_SINGLE_PASS
        size = self.photons if self.photons is not None and few else PASS_PHOTONS
        per_light = max(1, size // lights)
        photons = per_light * lights
        if self.photons is None:
            return Passes(per_light, photons, max(1, self.most // photons))
        return Passes(per_light, photons, max(1, round(self.photons / photons)))

    def fraction(self, done: float, noise: float | None) -> float:
        """Return the approximate completed fraction, 0 to 1.

        Args:
            done: traced fraction of the largest number of passes.
            noise: relative RMS noise reached; None if it is not known.
        """
        fraction = done if self.photons is not None else 0.0
        if self.noise is not None and noise:
            fraction = max(fraction, min(LARGEST_GUESS, (self.noise / noise) ** 2))
        if self.seconds is not None:
            passed = time.perf_counter() - self.began
            fraction = max(fraction, min(LARGEST_GUESS, passed / self.seconds))
        return fraction

    def ends_before(self, next_pass: float) -> bool:
        """Return whether the time limit ends the tracing before a pass that takes so long (s)."""
        if self.seconds is None:
            return False
        passed = time.perf_counter() - self.began
        return passed + next_pass > TRACING_SHARE * self.seconds
