"""What the OptiSense paper says of GelSight360, held against what was found."""

from __future__ import annotations

from optisense.experiments.claims import Claim
from optisense.experiments.experiment import Values
from optisense.experiments.mini_shapes import OBJECTIVES
from optisense.experiments.spread import best, is_larger, number, shown, spearman

PAPER = {
    "GRRGGRRG": {"normdiff": -37.745, "rgb2normal": 0.909},
    "GBBRRGGB": {"normdiff": -17.172, "rgb2normal": 0.893},
    "GRRBBGGR": {"normdiff": -26.769, "rgb2normal": 0.919},
    "GBRBRGBR": {"normdiff": -19.810, "rgb2normal": 0.901},
    "RGBRGBRG": {"normdiff": -14.696, "rgb2normal": 0.891},
}
"""The paper's table, the original first."""

PAPERS_TIP, PAPERS_TIP_SCORE = 6, 0.071
PAPERS_RESIN, PAPERS_RESIN_SCORE = 4, -8.81

MATCH = 0.7
"""A rank correlation from here on counts as the same order."""


def claims(numbers: Values) -> list[Claim]:
    """The paper's statements on colours, tips and resins."""
    colourings = numbers["colourings"]
    found = [_order(colourings, name, title) for name, title in OBJECTIVES.items()]
    column = {letters: each["normdiff"] for letters, each in colourings.items()}
    top, alike = best(column)
    found.append(
        Claim(
            "RGBRGBRG has the best NormDiff of the five.",
            "no scores"
            if top is None
            else f"{top} ({shown(column[top], 4)}); alike: {_all_but(alike, top)}",
            None
            if top is None
            else True
            if top == "RGBRGBRG"
            else None
            if "RGBRGBRG" in alike
            else False,
            WHY_NORMDIFF,
        )
    )
    found.append(_better_than_original(colourings))
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
    found.append(_tip(numbers["tips"]))
    found += [_resin(numbers["resins"][name], title) for name, title in OBJECTIVES.items()]
    return found


def _all_but(names: list[str], top: str) -> str:
    return ", ".join(name for name in names if name != top) or "none"


def _order(colourings: Values, name: str, title: str) -> Claim:
    pairs = [
        (PAPER[letters][name], each[name]["mean"])
        for letters, each in colourings.items()
        if each[name]["mean"] is not None
    ]
    reached, chance = spearman([p for p, _ in pairs], [m for _, m in pairs])
    told = None if reached != reached else reached >= MATCH
    return Claim(
        f"The five colourings in the paper's order by {title}.",
        f"rank correlation {reached:+.2f}; by chance as high in {100 * chance:.0f} % of orders"
        if told is not None
        else "no scores",
        told,
        WHY_NORMDIFF if name == "normdiff" else WHY_RGB,
    )


def _better_than_original(colourings: Values) -> Claim:
    original = colourings["GRRGGRRG"]["rgb2normal"]
    others = {k: v["rgb2normal"] for k, v in colourings.items() if k != "GRRGGRRG"}
    larger = [name for name, each in others.items() if is_larger(each, original)]
    return Claim(
        "All five score alike by RGB2Normal (0.891 to 0.919), the original no worse than others.",
        f"original {shown(original)}; better than it: {', '.join(larger) or 'none'}",
        None if original["mean"] is None else not larger,
        WHY_RGB,
    )


def _tip(tips: Values) -> Claim:
    top, _ = best(tips)
    near = {str(PAPERS_TIP + step) for step in (-1, 0, 1)}
    return Claim(
        f"Of the tips 0 (flat) to 10 (conical), {PAPERS_TIP} has the best 2to3PW "
        f"({PAPERS_TIP_SCORE:g}).",
        "no scores" if top is None else f"{top} ({number(tips[top]['mean'])})",
        None if top is None else top in near,
        "What lies between the ends of the family is our choice, and so are height and width of "
        "the tip. 2to3PW grows with the evenness of the whole picture, so the wall and the field "
        "of the camera count as much as the tip does. A neighbour of the paper's number counts as "
        "the same.",
    )


def _resin(column: Values, title: str) -> Claim:
    top, alike = best(column)
    told: bool | None = None
    if top is not None and len(alike) < len(column):
        told = str(PAPERS_RESIN) in alike
    return Claim(
        f"Of the resins 0 (even shell) to 10 (almost flat inside), {PAPERS_RESIN} is best "
        f"({title}).",
        "no scores"
        if top is None
        else f"{top} ({shown(column[top])}); alike: {_all_but(alike, top)}",
        told,
        "Gel and shell thickness, the places of the LEDs in the wall and the family between its "
        "ends are assumed. The resin bends the camera's view and the light at the tip only; most "
        "of the nine places are on the wall.",
    )


WHY_RGB = (
    "On our model the original, which has no blue among its eight groups, leaves more to the ring "
    "at the foot than other colourings do; that ring, its colour and its power are assumed."
)
WHY_NORMDIFF = (
    "See the table of what lowers NormDiff: with noise of 30 % of the colour, groups of lights on "
    "all sides give neighbouring tilts colours that are within that noise of each other, whatever "
    "their letters are. The paper does not give the weights of its two angles, nor at which "
    "colours the noise is taken."
)
