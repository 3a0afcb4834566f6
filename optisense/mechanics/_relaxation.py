"""Relaxation of iterations that repeat one function until its result is its argument."""

from __future__ import annotations

from optisense.array_types import FloatArray

LEAST, MOST = 0.2, 1.5
"""Smallest and largest share of a change that is taken, so that no single iteration throws the next
one far off: Aitken's estimate is unreliable where two changes are nearly equal."""


class Relaxation:
    """Aitken's relaxation of an iteration.

    Iterations over a pressure and the effect of a gel's shape alternate around their limit where a
    gel is softer than the flat layer to which it is compared. The share of a change that is taken
    follows from the last two changes (Irons and Tuck, "A version of the Aitken accelerator for
    computer iteration", Int. J. Numer. Methods Eng. 1, 1969).
    """

    def __init__(self, start: FloatArray) -> None:
        """Begin an iteration at values (...); its first result is taken whole."""
        self._values = start
        self._change: FloatArray | None = None
        self._share = 1.0

    def next(self, found: FloatArray) -> FloatArray:
        """Return the next argument (...), from the result (...) of the last one."""
        change = found - self._values
        if self._change is not None:
            turn = change - self._change
            square = float((turn**2).sum())
            if square > 0.0:
                share = -self._share * float((self._change * turn).sum()) / square
                self._share = min(max(share, LEAST), MOST)
        self._change = change
        self._values = self._values + self._share * change
        return self._values
