"""Score a sensor by a function of your own: how evenly the gel is lit."""

import numpy as np

import optisense as ots


@ots.objective("evenness", range=(0.0, 1.0))
def evenness(evaluation):
    """The 5th percentile of the untouched gel's radiance over its 95th; 1 is even."""
    radiance = evaluation.untouched.radiance
    lit = radiance[radiance.max(axis=2) > 0]
    low, high = np.percentile(lit, [5.0, 95.0], axis=0)
    return float((low / high).min())


for name in ("gelsight-mini", "gelsight-mini-ideal"):
    score = ots.evaluate(ots.load(name), "evenness", resolution=(80, 60), photons="draft")
    print(f"{name:<14} {score.value:.3f}")
