"""A sensor without contacts, ready for photon tracing."""

from __future__ import annotations

from dataclasses import dataclass

from optisense.optics.scene.emitters import EmitterTable
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.sensor_scenes import SensorScenes


@dataclass(frozen=True)
class LitScene:
    """A sensor without contacts, ready for photon tracing.

    Attributes:
        scene: its surfaces.
        opaque: its opaque pieces.
        table: its lights.
        coloured: whether surfaces are coloured.
        roughness: GGX alpha of the sharpest metallic lobe of a coating; None without metal.
        pilot: the scene that pilot photons are traced in; ``scene`` if None. The first landings of
            photons do not depend on the coating. With the same coating in every pilot pass, images
            do not depend on the coating that the sensor had when its guide was learned.
        pilot_coloured: whether the surfaces of ``pilot`` are coloured.
    """

    scene: RayScene
    opaque: list[Piece]
    table: EmitterTable
    coloured: bool
    roughness: float | None = None
    pilot: RayScene | None = None
    pilot_coloured: bool = False

    @classmethod
    def of(cls, scenes: SensorScenes) -> LitScene:
        """Return the sensor of these scenes."""
        return cls(
            scenes.full,
            scenes.opaque,
            scenes.emitter_table,
            scenes.coloured,
            scenes.roughness,
            scenes.pilot,
            scenes.pilot_coloured,
        )
