"""The tables and figures of the OptiSense paper, made again, each by one command.

An experiment asks units (single evaluations, each kept in a file of its own), makes numbers of what
they find, and holds these against the paper's statements. Settings are in a YAML file beside each.
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
