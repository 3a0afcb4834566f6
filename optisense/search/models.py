"""One optical model a process, changed from trial to trial as cheaply as can be.

The image of a design must not depend on which designs came before it, or a study would give other
scores when it is resumed or shared among workers. What is kept between designs is only what comes
out the same: the scene of a design whose surfaces have not changed, and the photon guide that was
learned from the first design.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.design import SensorDesign

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

RAYS_ONLY = frozenset({"aoap", "2to3pw"})
"""Objectives that trace chief rays and need no light."""


class ModelKeeper:
    """Models of designs that differ from one design in a few values."""

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
        from optisense.optics import OpticalModel

        if not self._cheap(design):
            self._model = None  # its memory is free before the next one needs some
            return OpticalModel(design, variant=self.variant)
        if self._model is None:
            self._model = OpticalModel(self.first, variant=self.variant)
            if self.lit:
                self._model.guide()  # always learned from the first design
        model = self._model
        now = model.design
        if design.coating != now.coating:
            model.update("coating", design.coating)
        for name, group in design.lights.items():
            if group.colour != now.lights[name].colour:
                model.update(f"lights.{name}.colour", group.colour)
            if group.flux != now.lights[name].flux:
                model.update(f"lights.{name}.flux", group.flux)
        if design.camera != now.camera:
            model.update("camera", design.camera)
        return model

    def _cheap(self, design: SensorDesign) -> bool:
        """Whether a design differs from the first only in what a model can change at once."""
        first = self.first
        if design is first:
            return True
        if design.camera != first.camera and self.lit:
            return False  # the guide is learned from what the camera sees
        if (design.parts, design.materials) != (first.parts, first.materials):
            return False
        if list(design.lights) != list(first.lights) or design.cages != first.cages:
            return False
        if any(design.meshes[name] is not mesh for name, mesh in first.meshes.items()):
            return False
        return all(
            (group.model, group.emitter, group.lights)
            == (first.lights[name].model, first.lights[name].emitter, first.lights[name].lights)
            for name, group in design.lights.items()
        )

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_model": None}
