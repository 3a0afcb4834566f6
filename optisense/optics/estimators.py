"""The names of the two estimators that render an image; see docs/simulation.md."""

RADIANCE_CACHE = "radiance-cache"
"""Shade camera samples from the radiance cache, which is kept between images: fast, the default."""

SPPM = "sppm"
"""Stochastic progressive photon mapping: slow, and right where contacts cover most of the gel."""

ESTIMATORS = (RADIANCE_CACHE, SPPM)

OLD_NAMES = {"field": RADIANCE_CACHE}
"""Names in files of release 0.1."""


def current_name(name: object) -> object:
    """The name that a kept setting has today."""
    return OLD_NAMES.get(name, name) if isinstance(name, str) else name
