"""A sensor without contacts, ready for photon tracing."""

from __future__ import annotations

from dataclasses import dataclass

from optisense.optics.scene.emitters import EmitterTable
from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.sensor_scenes import SensorScenes

TRACED_ROUGHNESS = 0.15
"""GGX alpha of metallic lobes below which their peaks are traced. At 0.2, beams of two discs leave
an error of 1.3 % in a contact of GelSight Mini, and a million photons give its pixels a noise of 5
%; with traced peaks, the noise is 36 % at 0.05."""
TAIL_ROUGHNESS = 0.3
"""GGX alpha of the lobe whose direction bins serve the tails of lobes with traced peaks, and the
skin on which rays end. With the coarser bins of 0.4, the error of the skin in the corner of
GelSight Mini's view is 4.7 instead of 3.4 % at a specularity of 1, in 0.87 times the time."""


@dataclass(frozen=True)
class LitScene:
    """A sensor without contacts, ready for photon tracing.

    Attributes:
        scene: its surfaces.
        opaque: its opaque pieces.
        table: its lights.
        coloured: whether surfaces are coloured.
        roughness: GGX alpha of the sharpest metallic lobe that reads the cache; None without metal.
        traced_lobes: whether the peaks of metallic lobes are traced, and only their tails read the
            cache.
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
    traced_lobes: bool = False
    pilot: RayScene | None = None
    pilot_coloured: bool = False

    @classmethod
    def of(cls, scenes: SensorScenes, may_trace_lobes: bool = True) -> LitScene:
        """Return the sensor of these scenes.

        Args:
            may_trace_lobes: whether the peaks of lobes narrower than `TRACED_ROUGHNESS` are traced,
                if all lights have windows, which rays can meet.
        """
        roughness = scenes.roughness
        traced = (
            may_trace_lobes
            and roughness is not None
            and roughness < TRACED_ROUGHNESS
            and all(emitter.area > 0 for emitter in scenes.assembly.emitters)
        )
        return cls(
            scenes.full,
            scenes.opaque,
            scenes.emitter_table,
            scenes.coloured,
            TAIL_ROUGHNESS if traced else roughness,
            traced,
            scenes.pilot,
            scenes.pilot_coloured,
        )
