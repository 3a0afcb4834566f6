"""Score two coatings of a GelSight Mini by the four objectives."""

import optisense as ots

for specularity in (0.2, 0.6):
    sensor = ots.set_value(ots.load("gelsight-mini"), "coating.specularity", specularity)
    scores = ots.evaluate(
        sensor,
        ["rgb2normal", "normdiff", "aoap", "2to3pw"],
        resolution=(160, 120),
        photons="draft",  # "normal" and "fine" take longer and are less noisy
    )
    print(f"specularity {specularity}:")
    for name, score in scores.items():
        print(f"  {name:<11} {score.value:.4g}")
