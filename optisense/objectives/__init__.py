"""Objectives that rate a sensor: the four built-in ones, and a user's own."""

from optisense.objectives.evaluation import Evaluation
from optisense.objectives.press import Press
from optisense.objectives.registry import BUILT_IN, Objective, find, names, objective
from optisense.objectives.run import evaluate
from optisense.objectives.score import Score
from optisense.objectives.settings import Settings

__all__ = [
    "BUILT_IN",
    "Evaluation",
    "Objective",
    "Press",
    "Score",
    "Settings",
    "evaluate",
    "find",
    "names",
    "objective",
]
