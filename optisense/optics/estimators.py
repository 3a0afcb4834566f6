"""The names of the two estimators that render an image; see docs/simulation.md."""

RADIANCE_CACHE = "radiance-cache"
"""The estimator that shades camera samples from the radiance cache, which is kept between images:
fast, the default."""

SPPM = "sppm"
"""The estimator by stochastic progressive photon mapping: slow, and also accurate if contacts cover
most of the gel."""

ESTIMATORS = (RADIANCE_CACHE, SPPM)

OLD_NAMES = {"field": RADIANCE_CACHE}
"""Names of estimators in files of release 0.1, and their current names."""


def current_name(name: object) -> object:
    """Return the current name of a stored setting."""
    return OLD_NAMES.get(name, name) if isinstance(name, str) else name
