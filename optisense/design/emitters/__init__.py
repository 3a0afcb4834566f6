"""Kinds of lamps, one file for each; `LightModel` stands for any of them."""

from optisense.design.emitters._area import AreaEmitter
from optisense.design.emitters._ies import IesEmitter
from optisense.design.emitters._intensity import Intensity
from optisense.design.emitters._spot import SpotEmitter
from optisense.design.emitters.base import LightModel, Window

__all__ = ["AreaEmitter", "IesEmitter", "Intensity", "LightModel", "SpotEmitter", "Window"]
