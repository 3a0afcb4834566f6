"""Optical models that are kept between trials, one per process, and changed as little as possible.

The image of a design does not depend on the designs that a model had before, so a study gives the
same scores when it is resumed or shared among workers.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from optisense.design import SensorDesign
from optisense.search.space.pickling import PickledWithoutCaches

if TYPE_CHECKING:
    from optisense.optics import OpticalModel


class ModelCache(PickledWithoutCaches):
    """Cache of one optical model, for designs that are variations of one design."""

    def __init__(self, variant: str = "auto", *, coarse: bool = False) -> None:
        """Store the variant, and whether images are coarse; the model is built on first use."""
        self.variant = variant
        self.coarse = coarse

    def model(self, design: SensorDesign) -> OpticalModel:
        """Return the model of a design. It replaces the model returned before, which must no longer
        be used.

        Raises:
            OptiSenseError: the design can't be built.
        """
        if self._model is None:
            from optisense.optics import CoarseModel, OpticalModel

            kind = CoarseModel if self.coarse else OpticalModel
            self._model = kind(design, variant=self.variant)
        else:
            self._model.set_design(design)
        return self._model

    @cached_property
    def _model(self) -> OpticalModel | None:
        """Model that was built last; None before the first one."""
        return None
