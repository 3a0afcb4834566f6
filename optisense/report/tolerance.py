"""Page of a tolerance analysis: the distribution of scores, and each error's share in it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.figures import AMBER, BLUE, GREY, RED, new_figure
from optisense.report._files import page
from optisense.report._pictures import figure_uri, legend_above
from optisense.search.space.manufacturing import unit_of
from optisense.search.tolerance.analysis import ScoreDistribution, Tolerance
from optisense.search.tolerance.sensitivity import Estimate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PERCENTILE_LINES = {"p10": (RED, "-"), "p50": (AMBER, "-"), "p90": (AMBER, "-.")}
"""Colour and dashes of the line of each percentile."""

P10_INTERVAL = "90 % interval of P10"


def render_tolerance(tolerance: Tolerance) -> str:
    """Return a tolerance analysis as one self-contained HTML page."""
    design = tolerance.design
    return page(
        "tolerance",
        title=design.name,
        description=design.description,
        headline=[
            ("sensors tried", f"{tolerance.sensors:,}"),
            ("failed", f"{sum(tolerance.failures.values()):,}"),
            ("seed", str(tolerance.seed)),
            ("time", f"{tolerance.seconds:,.0f} s"),
        ],
        interrupted=tolerance.interrupted,
        objectives=[_objective(name, each) for name, each in tolerance.results.items()],
        errors=[
            (path, shown_size(path, spread.size), _kind(spread.kind))
            for path, spread in tolerance.errors.distributions.items()
        ],
        failures=sorted(tolerance.failures.items(), key=lambda item: -item[1]),
        settings=[(key, str(value)) for key, value in tolerance.settings.items()],
    )


def spread_figure(name: str, found: ScoreDistribution) -> Figure:
    """Draw the scores of all sensors with their percentiles, and the share of each error."""
    shares = {source: share for source, share in found.shares.items() if share is not None}
    figure = new_figure(11.0, max(3.2, 1.4 + 0.42 * len(shares)))
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    scores = found.scores[np.isfinite(found.scores)]
    if len(scores):
        left.hist(scores, bins=min(40, max(8, len(scores) // 6)), color=BLUE, alpha=0.55)
    left.axvline(found.nominal, color=GREY, lw=1.4, ls="--", label=f"nominal {found.nominal:.4g}")
    edge = left.get_xlim()[0]
    for key, each in found.percentiles.items():
        colour, style = PERCENTILE_LINES[key]
        if math.isfinite(each.value):
            label = f"{key.upper()} {each.value:.4g}"
            left.axvline(each.value, color=colour, ls=style, lw=1.5, label=label)
        if key == "p10" and math.isfinite(each.high):
            low = each.low if math.isfinite(each.low) else edge  # a failed sensor
            left.axvspan(low, each.high, color=colour, alpha=0.12, lw=0, label=P10_INTERVAL)
    left.set_xlim(left=edge)
    left.set_xlabel(name)
    left.set_ylabel("sensors")
    legend_above(left)
    names = list(shares)
    values = np.array([share.value for share in shares.values()])
    ends = np.array([[each.value - each.low, each.high - each.value] for each in shares.values()])
    if names:
        right.barh(names, values, color=BLUE, alpha=0.7)
        reach = np.maximum(np.nan_to_num(ends), 0.0).T
        right.errorbar(values, names, xerr=reach, fmt="none", ecolor="#333", capsize=3, lw=1)
    if found.noise_share > 0.0:
        right.axvline(
            found.noise_share, color=GREY, ls=":", lw=1.4, label="noise of the image alone"
        )
        legend_above(right)
    right.invert_yaxis()
    right.set_xlim(left=0.0)
    right.set_xlabel("share of the variance (total effect)")
    right.tick_params(axis="y", labelsize=9)
    return figure


def shown_size(path: str, size: float) -> str:
    """Return the size of an error with its unit, such as ``0.1 mm``."""
    unit = unit_of(path)
    return f"{size:g}{unit}" if unit == "°" else f"{size:g} {unit}".rstrip()


def _objective(name: str, found: ScoreDistribution) -> dict[str, Any]:
    return {
        "name": name,
        "nominal": f"{found.nominal:.4g}",
        "noise": f"{found.noise:.2g}" if found.noise > 0.0 else "",
        "deviation": f"{found.deviation:.3g}",
        "figure": figure_uri(spread_figure(name, found)),
        "percentiles": [
            (key.upper(), _shown(each.value, ".4g"), _interval(each))
            for key, each in found.percentiles.items()
        ],
        "shares": [(source, *_share(each)) for source, each in found.shares.items()],
        "noise_share": f"{found.noise_share:.2f}" if found.noise_share > 0.0 else "",
        "caveat": found.caveat,
    }


def _share(each: Estimate | None) -> tuple[str, str, str]:
    """Return share, standard error and interval."""
    if each is None:
        return "unknown", "", ""
    error = f"{each.error:.2f}" if math.isfinite(each.error) else ""
    return f"{each.value:.2f}", error, _interval(each, ".2f")


def _interval(each: Estimate, shape: str = ".4g") -> str:
    """Return both ends of an interval; an empty text if both are failed sensors."""
    if not math.isfinite(each.high):
        return ""
    return f"{_shown(each.low, shape)} to {_shown(each.high, shape)}"


def _shown(value: float, shape: str) -> str:
    return f"{value:{shape}}" if math.isfinite(value) else "fails"


def _kind(kind: str) -> str:
    return "standard deviation" if kind == "normal" else "limit of a uniform distribution"
