"""How a camera turns light into a picture: a file for each kind, `CameraResponse` for any."""

from optisense.design.responses.base import CameraResponse
from optisense.design.responses.full_well import FullWellResponse

USUAL_RESPONSE = FullWellResponse()
"""The response of a camera whose design names none."""

__all__ = ["USUAL_RESPONSE", "CameraResponse", "FullWellResponse"]
