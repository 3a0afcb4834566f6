"""Search methods by name: each proposes points and receives their scores."""

from optisense.search.methods._registry import METHODS, find, make, names, register
from optisense.search.methods.base import Method, Problem, values_to_maximise

__all__ = [
    "METHODS",
    "Method",
    "Problem",
    "find",
    "make",
    "names",
    "register",
    "values_to_maximise",
]
