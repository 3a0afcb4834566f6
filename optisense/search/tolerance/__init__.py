"""Tolerance analysis: the distribution of a score under manufacturing errors, and its causes."""

from optisense.search.tolerance.analysis import Tolerance, tolerance

__all__ = ["Tolerance", "tolerance"]
