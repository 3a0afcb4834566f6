"""Reports: one self-contained HTML page a render, to look at, keep and send.

Names load on first use: the page of a render does not wait for what that of scores needs.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optisense.report.page import write_report
    from optisense.report.scores import write_score_report

_HOMES = {"write_report": "page", "write_score_report": "scores"}

__all__ = ["write_report", "write_score_report"]


def __getattr__(name: str) -> object:
    """Import a public name (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'optisense.report' has no attribute {name!r}")
    value: object = getattr(import_module(f"optisense.report.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
