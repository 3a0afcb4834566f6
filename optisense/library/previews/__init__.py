"""Preview pictures: the ball of a material, the polar plot of a light, the field of a camera."""

from optisense.library.previews._ball import picture_of_ball
from optisense.library.previews._draw import draw, save

__all__ = ["draw", "picture_of_ball", "save"]
