"""Response of a camera to light: `PictureChain` and its components.

`CameraResponse` has a file for each kind, `tone_curve` the tone curves, `electronics` noise, black
level and colours; the effects of the lens are in `design/lenses`.
"""

from optisense.design.responses._tone_curve import ToneCurve
from optisense.design.responses.base import CameraResponse
from optisense.design.responses.chain import USUAL_RESPONSE, PictureChain
from optisense.design.responses.electronics import BlackLevel, SensorNoise
from optisense.design.responses.full_well import FullWellResponse

__all__ = [
    "USUAL_RESPONSE",
    "BlackLevel",
    "CameraResponse",
    "FullWellResponse",
    "PictureChain",
    "SensorNoise",
    "ToneCurve",
]
