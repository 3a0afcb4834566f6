"""One optical model a process, changed from trial to trial as cheaply as can be.

The image of a design does not depend on which designs a model had before, so a study gives the same
scores when it is resumed or shared among workers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.design import SensorDesign

if TYPE_CHECKING:
    from optisense.optics import OpticalModel


class ModelKeeper:
    """Models of designs that are variations of one design."""

    def __init__(self, variant: str = "auto") -> None:
        """Nothing is built yet.

        Args:
            variant: of the renderer.
        """
        self.variant = variant
        self._model: OpticalModel | None = None

    def model(self, design: SensorDesign) -> OpticalModel:
        """The model of a design; the one given before must not be used any more.

        Raises:
            OptiSenseError: the design can't be built.
        """
        if self._model is None:
            from optisense.optics import OpticalModel

            self._model = OpticalModel(design, variant=self.variant)
        else:
            self._model.set_design(design)
        return self._model

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_model": None}
