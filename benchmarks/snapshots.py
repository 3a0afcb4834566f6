"""Images of a progressive renderer at several times."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.case import FloatArray


@dataclass(frozen=True)
class Snapshot:
    """Image of a progressive renderer at one time.

    Attributes:
        seconds: wall time since the start, s.
        cpu: processor time of all threads, s.
        image: linear radiance (h, w, 3).
        samples: samples per pixel, as the renderer reports them.
    """

    seconds: float
    cpu: float
    image: FloatArray
    samples: float


def due_times(budget: float, count: int = 4) -> list[float]:
    """Return the times (s) of snapshots: each is twice the previous one, the last is the budget."""
    return [budget / 2 ** (count - 1 - k) for k in range(count)]
