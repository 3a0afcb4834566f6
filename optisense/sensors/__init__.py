"""Built-in sensors: functions that build a SensorDesign from a few dimensions."""

from optisense.sensors._digit import digit
from optisense.sensors._gelbelt import gelbelt
from optisense.sensors._gelsight360 import gelsight360
from optisense.sensors._gelsight_mini import (
    gelsight_mini,
    gelsight_mini_cylindrical,
    gelsight_mini_spherical,
)
from optisense.sensors._gelsight_mini_ideal import (
    gelsight_mini_ideal,
    gelsight_mini_ideal_cylindrical,
    gelsight_mini_ideal_spherical,
)
from optisense.sensors._gelsight_svelte import gelsight_svelte
from optisense.sensors.registry import SENSORS, build, check, load, save_design

__all__ = [
    "SENSORS",
    "build",
    "check",
    "digit",
    "gelbelt",
    "gelsight360",
    "gelsight_mini",
    "gelsight_mini_cylindrical",
    "gelsight_mini_ideal",
    "gelsight_mini_ideal_cylindrical",
    "gelsight_mini_ideal_spherical",
    "gelsight_mini_spherical",
    "gelsight_svelte",
    "load",
    "save_design",
]
