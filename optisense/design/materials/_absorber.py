"""A black surface."""

from __future__ import annotations

from typing import ClassVar, Literal

from optisense.design.materials.base import Material
from optisense.design.parts import Role


class Absorber(Material):
    """An opaque surface that absorbs all light."""

    title: ClassVar[str] = "Absorber"
    roles: ClassVar[tuple[Role, ...]] = (Role.BLOCKER, Role.INDENTER)

    kind: Literal["absorber"] = "absorber"

    def in_words(self) -> str:
        """Return the text that the material is black."""
        return "reflects nothing"
