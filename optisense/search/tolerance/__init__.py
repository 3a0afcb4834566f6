"""How the score of a design spreads when sensors are made with errors, and which error matters."""

from optisense.search.tolerance.analysis import Tolerance, tolerance

__all__ = ["Tolerance", "tolerance"]
