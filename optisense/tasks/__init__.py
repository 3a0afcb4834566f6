"""What a robot would read from a sensor: datasets, perception tasks, shape reconstruction.

Names load on first use, so that importing the package loads neither scikit-learn nor the renderer.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optisense.tasks.calibration import CalibratedSensor, ReconstructionSettings
    from optisense.tasks.cylinder_radius import CylinderRadius
    from optisense.tasks.dataset import Dataset, Sample
    from optisense.tasks.draws import ContactDraw
    from optisense.tasks.generation import DatasetSettings, generate
    from optisense.tasks.misalignment import Misalignment
    from optisense.tasks.perception import (
        PerceptionResult,
        PerceptionTask,
        SampleSettings,
        perceive,
    )
    from optisense.tasks.reconstruction import ReconstructionResult, reconstruct
    from optisense.tasks.snr import signal_to_noise

_HOMES = {
    "CalibratedSensor": "calibration",
    "ContactDraw": "draws",
    "CylinderRadius": "cylinder_radius",
    "Dataset": "dataset",
    "DatasetSettings": "generation",
    "Misalignment": "misalignment",
    "PerceptionResult": "perception",
    "PerceptionTask": "perception",
    "ReconstructionResult": "reconstruction",
    "ReconstructionSettings": "calibration",
    "Sample": "dataset",
    "SampleSettings": "perception",
    "generate": "generation",
    "perceive": "perception",
    "reconstruct": "reconstruction",
    "signal_to_noise": "snr",
}

__all__ = [
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
    "generate",
    "perceive",
    "reconstruct",
    "signal_to_noise",
]


def __getattr__(name: str) -> object:
    """Import a public name on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'optisense.tasks' has no attribute {name!r}")
    value: object = getattr(import_module(f"optisense.tasks.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
