"""Usual durations of pieces of work, which give the time left before any is measured.

They are processor seconds on GelSight Mini, with kernels in the renderer's cache, and are converted
to seconds by the number of processors, the load of the machine, and the size of the sensor. Later
measurements correct them (`optisense.time_left`).
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

LOADING = 1.0
"""Time to load the program and a design, s."""

BUILDING = 0.3
"""Time to build the scene of a design, s."""

PREPARING = 0.15
"""Processor time to place contacts and trace chief rays for the first image, with compiling, s."""

PILOT = 0.25
"""Processor time to trace the pilot photons, with compiling, s."""

MILLION_PHOTONS = 0.62
"""Processor time to trace a million photons, without compiling, s."""

SMOOTHING = 0.25
"""Processor time to smooth the radiance cache, s."""

COMPILING = 0.5
"""Processor time to compile the kernels of the first image, or to find them in the cache, s."""

PICTURE, PICTURE_PIXELS = 0.2, 0.15
"""Processor time to shade a picture, s: a constant part, and a part for each `USUAL_PIXELS`."""

USUAL_PIXELS = 320 * 240
"""Number of pixels of an image for which durations are given."""

USUAL_AREA = 524.0
"""Area of the sensing surface of GelSight Mini, for which durations are given, mm2."""

LARGEST_FACTOR = 3.0
"""Largest factor on the duration of the light for larger surfaces: GelSight Svelte (1,478 mm2),
GelSight360 (2,989 mm2) and GelBelt (3,581 mm2) take 2.9 to 3.3 times as long as GelSight Mini.
"""

USUAL_GROUPS = 3
"""Number of light groups of GelSight Mini; more lengthen the time to shade a picture."""

MOST_THREADS = 8
"""Largest number of processors that shorten the work; more are idle between short kernels."""

SHARED_POWER = 1.4
"""Exponent of the slowdown by other processes: if work of one thread takes k times as long, that of
all threads takes about k to this power, since it waits for its slowest thread.
"""

_BEGAN = time.monotonic(), time.process_time()


def crowding() -> float:
    """Return the factor by which other processes slow down work of one thread.

    It is wall time divided by processor time since this module was loaded, as far as the load of
    the machine explains it; waiting for a disk or a person does not count.
    """
    wall, busy = time.monotonic() - _BEGAN[0], time.process_time() - _BEGAN[1]
    try:
        load = os.getloadavg()[0]
    except (AttributeError, OSError):  # Windows
        return 1.0
    explained = (load + 1.0) / processors()
    return max(1.0, min(wall / max(busy, 1e-3), explained))


def processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class UsualTimes:
    """Usual durations of a sensor's light and pictures, s.

    Attributes:
        pace: seconds per processor second of work that all processors share.
        thread_pace: seconds per processor second of work of one thread.
        light: duration of the light relative to GelSight Mini.
        shading: duration of pictures relative to GelSight Mini.
    """

    pace: float = 0.5
    thread_pace: float = 1.0
    light: float = 1.0
    shading: float = 1.0

    @staticmethod
    def here(area: float = USUAL_AREA, groups: int = USUAL_GROUPS) -> UsualTimes:
        """Return the usual durations on this machine at its present load.

        Args:
            area: area of the sensing surfaces, mm2.
            groups: number of light groups.
        """
        crowded = crowding()
        return UsualTimes(
            pace=crowded**SHARED_POWER / min(processors(), MOST_THREADS),
            thread_pace=crowded,
            light=min(max(area / USUAL_AREA, 0.5), LARGEST_FACTOR),
            shading=max(1.0, groups / USUAL_GROUPS),
        )

    def preparing(self) -> float:
        """Return the time to prepare the first image, s."""
        return self.pace * PREPARING

    def pilot(self) -> float:
        """Return the time to trace the pilot photons, s."""
        return self.pace * PILOT

    def tracing(self, photons: float) -> float:
        """Return the time to trace a number of photons, s."""
        return self.pace * self.light * MILLION_PHOTONS * photons / 1e6

    def smoothing(self) -> float:
        """Return the time to smooth the radiance cache, s."""
        return self.pace * self.light * SMOOTHING

    def compiling(self) -> float:
        """Return the time that the first image takes longer than the next, s."""
        return self.pace * COMPILING

    def picture(self, pixels: float) -> float:
        """Return the time to shade a picture with a number of pixels, s."""
        return self.pace * self.shading * (PICTURE + PICTURE_PIXELS * pixels / USUAL_PIXELS)

    def first_light(self, photons: float) -> float:
        """Return the time of all work before the first picture is shaded, without compiling, s."""
        return self.preparing() + self.pilot() + self.tracing(photons) + self.smoothing()
