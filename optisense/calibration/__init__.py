"""Comparison of a design with photographs of the real sensor, and fits of the design to them.

Names load on first use, so that the import of the package loads neither SciPy nor the renderer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from optisense.calibration._synthetic_photographs import photograph_model, save_photographs
    from optisense.calibration.calibrating import calibrate
    from optisense.calibration.comparing import Comparison, compare
    from optisense.calibration.layouts import read_photographs
    from optisense.calibration.photographs import PhotographedPress, Photographs
    from optisense.calibration.realism import Realism
    from optisense.calibration.result import Calibration
    from optisense.calibration.settings import CalibrationSettings

__all__ = [
    "Calibration",
    "CalibrationSettings",
    "Comparison",
    "PhotographedPress",
    "Photographs",
    "Realism",
    "calibrate",
    "compare",
    "photograph_model",
    "read_photographs",
    "save_photographs",
]

if not TYPE_CHECKING:  # type checkers would take any name for one of the package's
    __getattr__, __dir__ = load_on_first_use(__name__, __file__)
