"""Bounds in per cent as text."""

from __future__ import annotations

from decimal import ROUND_CEILING, Context

BOUND_DIGITS = 2
"""Number of significant digits of a bound, which is noise that is itself estimated."""

KNOWN_DIGITS = 12
"""Number of significant digits of a percentage that are known; those after them come from
floating-point arithmetic, which would round 7.000000000000001 up to 7.1.
"""


def bound_percent(share: float) -> str:
    """Return an upper bound as text, such as ``9.3 %``, without an exponent and rounded up.

    Args:
        share: the bound as a share; 1 is 100 %.
    """
    context = Context(prec=BOUND_DIGITS, rounding=ROUND_CEILING)
    return f"{context.create_decimal(f'{100.0 * share:.{KNOWN_DIGITS}g}'):f} %"
