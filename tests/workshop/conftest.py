"""Designs for the workshop: one that is flat, one that its cage has bent."""

from __future__ import annotations

import pytest

from optisense import sensors
from optisense.design import SensorDesign


@pytest.fixture(scope="module")
def flat() -> SensorDesign:
    return sensors.build("gelsight-mini-ideal")


@pytest.fixture(scope="module")
def dome() -> SensorDesign:
    return sensors.build("gelsight-mini-ideal-spherical")
