"""Error of the experiments that a user can cause."""

from __future__ import annotations

from optisense.errors import OptiSenseError


class ExperimentError(OptiSenseError):
    """An experiment that is unknown, or whose results can't be read."""
