"""One optical model a process, changed from trial to trial as cheaply as can be.

The image of a design must not depend on which designs came before it, or a study would give other
scores when it is resumed or shared among workers. A model keeps its photon guide when only the
coating changes, and so the guide is always learned under the coating of the first design.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.design import SensorDesign

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

RAYS_ONLY = frozenset({"aoap", "2to3pw"})
"""Objectives that trace chief rays and need no light."""


class ModelKeeper:
    """Models of designs that are variations of one design."""

    def __init__(self, first: SensorDesign, *, lit: bool, variant: str = "auto") -> None:
        """Nothing is built yet.

        Args:
            first: the design that others differ from.
            lit: whether light is needed, and not only chief rays.
            variant: of the renderer.
        """
        self.first = first
        self.lit = lit
        self.variant = variant
        self._model: OpticalModel | None = None

    def model(self, design: SensorDesign) -> OpticalModel:
        """The model of a design; the one given before must not be used any more.

        Raises:
            OptiSenseError: the design can't be built.
        """
        if not self.lit or design.coating == self.first.coating:
            return self._becoming(design)
        model = self._becoming(design.model_copy(update={"coating": self.first.coating}))
        model.guide()  # elsewhere it is learned when the first image is rendered
        model.set_design(design)
        return model

    def ray_model(self, design: SensorDesign) -> OpticalModel:
        """The model of a design, but for its coating, which chief rays don't depend on.

        Raises:
            OptiSenseError: the design can't be built.
        """
        return self._becoming(design.model_copy(update={"coating": self.first.coating}))

    def _becoming(self, design: SensorDesign) -> OpticalModel:
        if self._model is None:
            from optisense.optics import OpticalModel

            self._model = OpticalModel(design, variant=self.variant)
        else:
            self._model.set_design(design)
        return self._model

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_model": None}
