"""Tasks of a robot with a sensor: datasets, perception tasks, shape reconstruction.

Names load on first use, so that importing the package loads neither scikit-learn nor the renderer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from optisense.tasks._calibration import CalibratedSensor, ReconstructionSettings
    from optisense.tasks._draws import ContactDraw
    from optisense.tasks._generation import generate
    from optisense.tasks._misalignment import Misalignment
    from optisense.tasks._perception import (
        PerceptionResult,
        PerceptionTask,
        SampleSettings,
        perceive,
    )
    from optisense.tasks._press_tasks import BallForce, BallShear, CylinderRadius
    from optisense.tasks._reconstruction import ReconstructionResult, reconstruct
    from optisense.tasks._sample_settings import DatasetSettings
    from optisense.tasks._snr import signal_to_noise
    from optisense.tasks.dataset import Dataset, Sample
    from optisense.tasks.verification import Verification, VerificationSettings, verify

__all__ = [
    "BallForce",
    "BallShear",
    "CalibratedSensor",
    "ContactDraw",
    "CylinderRadius",
    "Dataset",
    "DatasetSettings",
    "Misalignment",
    "PerceptionResult",
    "PerceptionTask",
    "ReconstructionResult",
    "ReconstructionSettings",
    "Sample",
    "SampleSettings",
    "Verification",
    "VerificationSettings",
    "generate",
    "perceive",
    "reconstruct",
    "signal_to_noise",
    "verify",
]

if not TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__, __dir__ = load_on_first_use(__name__, __file__)
