"""Tasks of a robot with a sensor: datasets, perception tasks, shape reconstruction.

Names load on first use, so that importing the package loads neither scikit-learn nor the renderer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from optisense.tasks.ball_force import BallForce
    from optisense.tasks.ball_shear import BallShear
    from optisense.tasks.calibration import CalibratedSensor, ReconstructionSettings
    from optisense.tasks.cylinder_radius import CylinderRadius
    from optisense.tasks.dataset import Dataset, Sample
    from optisense.tasks.dataset_settings import DatasetSettings
    from optisense.tasks.draws import ContactDraw
    from optisense.tasks.generation import generate
    from optisense.tasks.misalignment import Misalignment
    from optisense.tasks.perception import (
        PerceptionResult,
        PerceptionTask,
        SampleSettings,
        perceive,
    )
    from optisense.tasks.reconstruction import ReconstructionResult, reconstruct
    from optisense.tasks.snr import signal_to_noise
    from optisense.tasks.verification import Verification, VerificationSettings, verify

_HOMES = {
    "CalibratedSensor": ".calibration",
    "ContactDraw": ".draws",
    "BallForce": ".ball_force",
    "BallShear": ".ball_shear",
    "CylinderRadius": ".cylinder_radius",
    "Dataset": ".dataset",
    "DatasetSettings": ".dataset_settings",
    "Misalignment": ".misalignment",
    "PerceptionResult": ".perception",
    "PerceptionTask": ".perception",
    "ReconstructionResult": ".reconstruction",
    "ReconstructionSettings": ".calibration",
    "Sample": ".dataset",
    "SampleSettings": ".perception",
    "Verification": ".verification",
    "VerificationSettings": ".verification",
    "generate": ".generation",
    "perceive": ".perception",
    "reconstruct": ".reconstruction",
    "signal_to_noise": ".snr",
    "verify": ".verification",
}

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
    __getattr__, __dir__ = load_on_first_use(__name__, _HOMES)
