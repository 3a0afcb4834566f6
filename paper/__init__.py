"""Experiments that reproduce the tables and figures of the OptiSense paper, each by one command.

An experiment consists of units (single evaluations, each kept in a file of its own). It computes
numbers from their results and compares them with the paper's statements. The settings of each
experiment are in a YAML file beside its module.
"""

from paper.bench import Bench
from paper.claims import Claim, Table
from paper.experiment import Experiment, Finding, prepare, run
from paper.registry import EXPERIMENTS, find
from paper.text import write_page
from paper.unit import Found, Record, Unit

__all__ = [
    "EXPERIMENTS",
    "Bench",
    "Claim",
    "Experiment",
    "Finding",
    "Found",
    "Record",
    "Table",
    "Unit",
    "find",
    "prepare",
    "run",
    "write_page",
]
