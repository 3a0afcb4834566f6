"""Reports: one self-contained HTML page a render, to look at, keep and send."""

from optisense.report.page import write_report
from optisense.report.scores import write_score_report

__all__ = ["write_report", "write_score_report"]
