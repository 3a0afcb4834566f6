"""Images of a progressive renderer at several times."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.case import FloatArray


@dataclass(frozen=True)
class Snapshot:
    """image (h, w, 3) linear radiance after ``seconds`` of wall time.

    cpu: seconds of all threads. samples: per pixel, where the renderer tells.
    """

    seconds: float
    cpu: float
    image: FloatArray
    samples: float


def due_times(budget: float, count: int = 4) -> list[float]:
    """Seconds at which to take snapshots: each twice the one before, the last at the end."""
    return [budget / 2 ** (count - 1 - k) for k in range(count)]
