"""The tables and figures of the OptiSense paper, made again, each by one command.

An experiment asks units (single evaluations, each kept in a file of its own), makes numbers of what
they find, and holds these against the paper's statements. Settings are in a YAML file beside each.
"""

from optisense.experiments.bench import Bench
from optisense.experiments.claims import Claim, Table
from optisense.experiments.experiment import Experiment, Finding, prepare, run
from optisense.experiments.registry import EXPERIMENTS, find
from optisense.experiments.text import write_page
from optisense.experiments.unit import Found, Record, Unit

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
