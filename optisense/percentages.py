"""Percentages as text: upper bounds, and two that differ."""

from __future__ import annotations

from decimal import ROUND_CEILING, Context

BOUND_DIGITS = 2
"""Number of significant digits of a bound, which is noise that is itself estimated."""

LEAST_DIGITS = 3
"""Smallest number of significant digits of two percentages that are compared."""

KNOWN_DIGITS = 12
"""Number of significant digits of a percentage that are known; those after them come from
floating-point arithmetic, which would round 7.000000000000001 up to 7.1.
"""


def bound_percent(share: float) -> str:
    """Return an upper bound as text, such as ``9.3 %``, without an exponent and rounded up.

    Args:
        share: the bound as a share; 1 is 100 %.
    """
    return _percent(share, Context(prec=BOUND_DIGITS, rounding=ROUND_CEILING))


def told_apart(share: float, least: float) -> tuple[str, str]:
    """Return two different shares as text, such as ``28.17 %`` and ``28.19 %``, with as few digits
    as tell them apart, but at least `LEAST_DIGITS`.

    Args:
        share, least: the shares; 1 is 100 %.
    """
    for digits in range(LEAST_DIGITS, KNOWN_DIGITS):
        one, other = (_percent(each, Context(prec=digits)) for each in (share, least))
        if one != other:
            break
    return one, other


def _percent(share: float, context: Context) -> str:
    rounded = context.create_decimal(f"{100.0 * share:.{KNOWN_DIGITS}g}")
    return f"{rounded.normalize():f} %"
