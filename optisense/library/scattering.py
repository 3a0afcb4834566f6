"""From the one number of a coating, its specularity, to a scattering law."""

from __future__ import annotations

SMALLEST_ROUGHNESS = 0.05
"""GGX alpha of a coating of specularity 1."""


def specularity_to_roughness(specularity: float) -> float:
    """GGX alpha of the metal-flake lobe of a coating with this specularity (0..1).

    An assumption: the OptiSense paper varies one specularity of a rough conductor from 0 to 1
    but does not say how it maps to a roughness. Here alpha = max(0.05, 1 - s), and the coating is
    a blend: weight (1 - s) of a diffuse lobe with the coating's reflectance, plus weight s of a
    rough conductor (GGX, this alpha, the coating's eta and k). So 0 is plain diffuse paint and 1
    is nearly a mirror, and energy is conserved in between.

    Raises:
        ValueError: specularity is not within 0..1.
    """
    if not 0.0 <= specularity <= 1.0:
        raise ValueError(f"specularity is {specularity}, it must be within 0..1")
    return max(SMALLEST_ROUGHNESS, 1.0 - specularity)
