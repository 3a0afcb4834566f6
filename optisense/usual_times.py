"""Usual durations of pieces of work, which give the time left before any is measured.

Times are stated in processor seconds on GelSight Mini, with kernels in the renderer's cache. They
become seconds by the number of processors, by how many other processes want these, and by the size
of the sensor. What is measured later corrects them (`optisense.time_left`).
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

LOADING = 1.0
"""Seconds that loading the program and a design takes."""

BUILDING = 0.3
"""Seconds that building the scene of a design takes."""

PREPARING = 0.15
"""Processor seconds to place contacts and trace chief rays for the first image, compiling too."""

PILOT = 0.25
"""Processor seconds to trace the pilot photons, compiling too."""

MILLION_PHOTONS = 0.62
"""Processor seconds that tracing a million photons takes, compiled already."""

SMOOTHING = 0.25
"""Processor seconds to smooth the radiance cache."""

COMPILING = 0.5
"""Processor seconds that compiling, or finding kernels in the cache, takes in the first image."""

PICTURE, PICTURE_PIXELS = 0.2, 0.15
"""Processor seconds to shade a picture: in any case, and for each `USUAL_PIXELS`."""

USUAL_PIXELS = 320 * 240
"""Number of pixels of an image for which times are stated."""

USUAL_AREA = 524.0
"""Area in mm2 of the sensing surface of GelSight Mini, for which times are stated."""

LARGEST_FACTOR = 3.0
"""Larger surfaces take longer to light, up to so much: GelSight Svelte (1,478 mm2), GelSight360
(2,989 mm2) and GelBelt (3,581 mm2) take 2.9 to 3.3 times as long as GelSight Mini."""

USUAL_GROUPS = 3
"""Light groups of GelSight Mini; the time to shade a picture grows as their number beyond that."""

MOST_THREADS = 8
"""Processors that shorten the work in proportion; more are idle between short kernels."""

SHARED_POWER = 1.4
"""The exponent of slowdown by other processes: where work of one thread takes k times as
long, that of all threads takes about k to this power, since it waits for its slowest thread."""

_BEGAN = time.monotonic(), time.process_time()


def crowding() -> float:
    """How many times as long work of one thread takes since other processes want the processors.

    This is wall time over processor time since this module was loaded, as far as the load of the
    machine explains it; waiting for a disk or a person does not count.
    """
    wall, busy = time.monotonic() - _BEGAN[0], time.process_time() - _BEGAN[1]
    try:
        load = os.getloadavg()[0]
    except (AttributeError, OSError):  # Windows
        return 1.0
    explained = (load + 1.0) / processors()
    return max(1.0, min(wall / max(busy, 1e-3), explained))


def processors() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class UsualTimes:
    """Usual times (seconds) of a sensor's light and pictures.

    Attributes:
        pace: seconds for each processor second of work that all processors share.
        thread_pace: seconds for each processor second of work of one thread.
        light: how many times as long the light takes as on GelSight Mini.
        shading: how many times as long pictures take as on GelSight Mini.
    """

    pace: float = 0.5
    thread_pace: float = 1.0
    light: float = 1.0
    shading: float = 1.0

    @staticmethod
    def here(area: float = USUAL_AREA, groups: int = USUAL_GROUPS) -> UsualTimes:
        """The usual times of this machine, as busy as it is now.

        Args:
            area: of the sensing surfaces, mm2.
            groups: of lights.
        """
        crowded = crowding()
        return UsualTimes(
            pace=crowded**SHARED_POWER / min(processors(), MOST_THREADS),
            thread_pace=crowded,
            light=min(max(area / USUAL_AREA, 0.5), LARGEST_FACTOR),
            shading=max(1.0, groups / USUAL_GROUPS),
        )

    def preparing(self) -> float:
        """Getting ready for the first image."""
        return self.pace * PREPARING

    def pilot(self) -> float:
        """The pilot photons."""
        return self.pace * PILOT

    def tracing(self, photons: float) -> float:
        """Seconds to trace so many photons."""
        return self.pace * self.light * MILLION_PHOTONS * photons / 1e6

    def smoothing(self) -> float:
        """Smoothing the radiance cache."""
        return self.pace * self.light * SMOOTHING

    def compiling(self) -> float:
        """What the first image takes longer than the next."""
        return self.pace * COMPILING

    def picture(self, pixels: float) -> float:
        """Shading a picture of so many pixels."""
        return self.pace * self.shading * (PICTURE + PICTURE_PIXELS * pixels / USUAL_PIXELS)

    def first_light(self, photons: float) -> float:
        """All that comes before the first picture is shaded, but for compiling."""
        return self.preparing() + self.pilot() + self.tracing(photons) + self.smoothing()
