"""Reports: self-contained HTML pages of renders, scores and studies.

Names load on first use: the page of a render does not wait for the imports of that of scores.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from optisense.report._page import write_report
    from optisense.report.scores import write_score_report

__all__ = ["write_report", "write_score_report"]

if not TYPE_CHECKING:  # type checkers would take any name for one of the package's
    __getattr__, __dir__ = load_on_first_use(__name__, __file__)
