"""Colours and opacities of parts in drawings of a design."""

from __future__ import annotations

ROLE_LOOKS: dict[str, tuple[str, float]] = {
    "sensing_surface": ("#8d99a6", 0.55),
    "elastomer": ("#f2a65a", 0.28),
    "support": ("#6fb7e9", 0.24),
    "mirror": ("#cfd8e3", 0.75),
    "blocker": ("#3b3f46", 1.0),
    "interface": ("#b7a6f2", 0.3),
    "indenter": ("#b9a44c", 1.0),
}
"""Colour and opacity (0 to 1) of each role: transparent parts show what is behind them."""
