"""What the OptiSense paper says of GelSight360, held against what was found."""

from __future__ import annotations

import math

from paper.claims import Claim
from paper.experiment import Values
from paper.mini_shapes import OBJECTIVES
from paper.spread import best, best_satisfies, by_seed, exceeds, number, shown, spearman, spread

PAPER = {
    "GRRGGRRG": {"normdiff": -37.745, "rgb2normal": 0.909},
    "GBBRRGGB": {"normdiff": -17.172, "rgb2normal": 0.893},
    "GRRBBGGR": {"normdiff": -26.769, "rgb2normal": 0.919},
    "GBRBRGBR": {"normdiff": -19.810, "rgb2normal": 0.901},
    "RGBRGBRG": {"normdiff": -14.696, "rgb2normal": 0.891},
}
"""Scores of the five colourings in the table of the OptiSense paper, the original first."""

PAPERS_TIP, PAPERS_TIP_SCORE = 6, 0.071
"""Best tip in the paper, from 0 (flat) to 10 (conical), and its 2to3PW."""
PAPERS_RESIN, PAPERS_RESIN_SCORE = 4, -8.81
"""Best resin in the paper, from 0 (even shell) to 10 (almost flat inside), and its NormDiff."""

LITTLE_NOISE = "noise of 3 %"
"""Name of the setting of NormDiff with the noise of a camera rather than the paper's 30 %."""

MATCH = 0.7
"""Rank correlation above which two orders count as the same."""

WIDER = 2.0
"""Largest ratio of the range of the five scores to the paper's at which the two count as alike."""


def claims(numbers: Values) -> list[Claim]:
    """Return the paper's statements on colours, tips and resins, with verdicts."""
    return [
        *colour_claims(numbers["colourings"]),
        *_tips(numbers["tips"], numbers["tips_with_leaps"]),
        *(_resin(numbers["resins"][name], title) for name, title in OBJECTIVES.items()),
    ]


def colour_claims(colourings: Values) -> list[Claim]:
    """Return the paper's statements on the five colourings, with verdicts."""
    found = [_order(colourings, name, title) for name, title in OBJECTIVES.items()]
    column = {letters: each["normdiff"] for letters, each in colourings.items()}
    top, alike = best(column)
    little = best({letters: each["ways"][LITTLE_NOISE] for letters, each in colourings.items()})[0]
    found.append(
        Claim(
            "RGBRGBRG has the best NormDiff of the five.",
            _best_text(column, digits=4) + (f"; with {LITTLE_NOISE}: {little}" if top else ""),
            best_satisfies(alike, lambda letters: letters == "RGBRGBRG"),
            WHY_NORMDIFF,
        )
    )
    found.append(_alike(colourings))
    values = [each["mean"] for each in column.values() if each["mean"] is not None]
    if values:
        low, high = min(values), max(values)
        paper = [each["normdiff"] for each in PAPER.values()]
        found.append(
            Claim(
                f"NormDiff of the five lies between {min(paper):.0f} and {max(paper):.0f}.",
                f"between {low:.0f} and {high:.0f}",
                bool(low >= min(paper) * 1.25 and high <= max(paper) * 0.75),
                WHY_NORMDIFF,
            )
        )
    return found


def _best_text(column: Values, what: str = "", digits: int = 3) -> str:
    """Return the best with its score, and what does not differ from it significantly."""
    top, alike = best(column)
    if top is None:
        return "no scores"
    others = ", ".join(name for name in alike if name != top) or "none"
    return f"{what}{top} ({shown(column[top], digits)}); not significantly different: {others}"


def _order(colourings: Values, name: str, title: str) -> Claim:
    column = {letters: each[name] for letters, each in colourings.items()}
    reached, chance = papers_order(column, name)
    seeds = spread([papers_order(each, name)[0] for each in by_seed(column)])
    return Claim(
        f"The five colourings have the paper's order by {title}.",
        f"rank correlation {reached:+.2f}; {100 * chance:.0f} % of random orders reach it; "
        f"single seeds: {shown(seeds, 2)}"
        if math.isfinite(reached)
        else "no scores",
        exceeds(seeds, MATCH),
        WHY_NORMDIFF if name == "normdiff" else WHY_RGB,
    )


def papers_order(column: Values, name: str) -> tuple[float, float]:
    """Return the rank correlation of scores of colourings with the paper's, and its p-value."""
    there = {letters: each["mean"] for letters, each in column.items() if each["mean"] is not None}
    return spearman([PAPER[letters][name] for letters in there], list(there.values()))


def _alike(colourings: Values) -> Claim:
    means = [each["rgb2normal"]["mean"] for each in colourings.values()]
    there = [mean for mean in means if mean is not None]
    paper = [each["rgb2normal"] for each in PAPER.values()]
    return Claim(
        f"The five have similar scores by RGB2Normal ({min(paper):g} to {max(paper):g}).",
        f"{number(min(there))} to {number(max(there))}" if there else "no scores",
        max(there) - min(there) <= WIDER * (max(paper) - min(paper)) if there else None,
        WHY_RGB,
    )


def _tips(tips: Values, with_leaps: Values) -> list[Claim]:
    top, alike = best(tips)
    score = None if top is None else float(tips[top]["mean"])
    return [
        Claim(
            f"Of the tips 0 (flat) to 10 (conical), {PAPERS_TIP} (or a neighbour) has the best "
            "2to3PW.",
            _best_text(tips, "tip "),
            best_satisfies(alike, lambda tip: abs(float(tip) - PAPERS_TIP) <= 1.0),
            "The shapes between the ends of the family are assumed, and so are the height and the "
            "width of the tip. 2to3PW depends on the uniformity over the whole image, so that the "
            "wall and the field of view of the camera matter as much as the tip. A neighbour of "
            "the paper's tip counts as agreement.",
        ),
        Claim(
            f"Its 2to3PW is {PAPERS_TIP_SCORE:g}.",
            "no scores"
            if top is None
            else f"{shown(tips[top])}; {shown(with_leaps[top])} with triangles across a fold or "
            "a gap",
            None if score is None else abs(score - PAPERS_TIP_SCORE) <= 0.5 * PAPERS_TIP_SCORE,
            "A ratio as small as the paper's means that the standard deviation of the areas is "
            "many times their mean. This happens if some triangles are very large: at grazing "
            "rays, and where neighbouring pixels see different sides of an edge. The field of view "
            "and the lens of the camera are assumed.",
        ),
    ]


def _resin(column: Values, title: str) -> Claim:
    return Claim(
        f"Of the resins 0 (even shell) to 10 (almost flat inside), {PAPERS_RESIN} is best "
        f"({title}).",
        _best_text(column),
        best_satisfies(best(column)[1], lambda resin: float(resin) == PAPERS_RESIN),
        "The thicknesses of gel and shell, the positions of the LEDs in the wall and the shapes "
        "between the ends of the family are assumed. The resin refracts the camera's view and the "
        "light only at the tip, and most of the nine places are on the wall.",
    )


WHY_RGB = (
    "The original colouring has no blue group among its eight groups, so that all blue light comes "
    "from the ring at the foot. This ring, its colour and its power are assumed. The paper's five "
    "scores differ by at most 0.03."
)
WHY_NORMDIFF = (
    "The paper adds the ranges of two angles with weights that it does not give, and uses a noise "
    "of 30 % without saying whether this is the half-width or the width of the range. Here, both "
    "angles have the same weight as degrees on the sphere, and 30 % is the half-width. The tables "
    "below show the colourings with other definitions, and NormDiff with other lights, fewer "
    "pixels and fewer photons. The shape of the body and the power of the lights are assumed."
)
