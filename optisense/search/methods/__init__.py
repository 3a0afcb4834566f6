"""Search methods by name: each proposes points and receives their scores."""

from optisense.search.methods.base import Method, Problem, values_to_maximise
from optisense.search.methods.registry import find, make, names, register

__all__ = ["Method", "Problem", "find", "make", "names", "register", "values_to_maximise"]
