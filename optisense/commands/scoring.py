"""Options of scores, tolerances and searches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from annotated_types import Ge, Le
from pydantic import AfterValidator, Field

from optisense.commands.options import (
    MOST_ITEMS,
    CommandOptions,
    NamedValues,
    OptionNotation,
    Photons,
    Resolution,
    Seed,
    read_resolution,
)
from optisense.quality import LEVELS, photons_of

if TYPE_CHECKING:
    from optisense.search import Plan

ScorePhotons = Annotated[
    Photons, OptionNotation(f"N|{LEVELS}", usual="fine, 5 million", is_text=True)
]

TrialPhotons = Annotated[
    Photons, OptionNotation(f"N|{LEVELS}", usual="normal, 1 million", is_text=True)
]


def _read(settings: dict[str, Any]) -> dict[str, Any]:
    """Return the settings with photons as a number, and resolutions as width and height."""
    found = dict(settings)
    if found.get("photons") is not None:
        found["photons"] = photons_of(found["photons"])
    for name in ("resolution", "ray_resolution"):
        if isinstance(found.get(name), str):
            found[name] = list(read_resolution(found[name]))
    return found


ObjectiveSettings = Annotated[
    NamedValues, AfterValidator(_read), OptionNotation("NAME=VALUE", ("--set",))
]


class ScoreOptions(CommandOptions):
    """Options of the images and rays of objectives."""

    settings: ObjectiveSettings = Field(
        {},
        description="A setting of the objectives, such as depth=0.5, noise=0.2 or photons=1000000. "
        "May be given several times.",
    )
    resolution: Resolution | None = Field(
        None,
        description="Width and height of the grid of pixels and rays; if left out, 640 wide, in "
        "the camera's aspect ratio.",
    )
    photons: ScorePhotons | None = Field(None, description="Photons to trace.")

    def for_objectives(self) -> dict[str, Any]:
        """Return all options as settings of objectives."""
        found = dict(self.settings)
        if self.photons is not None:
            found["photons"] = self.photons
        if self.resolution is not None:
            found["resolution"] = found["ray_resolution"] = list(self.resolution)
        return found


class EvaluateOptions(ScoreOptions):
    """Options of the scores of a design."""

    objectives: Annotated[list[str], OptionNotation("NAME", ("--objective", "-b"), "all four")] = (
        Field(
            [],
            description="rgb2normal, normdiff, aoap, 2to3pw, another one (--objectives lists all; "
            "docs/objectives.md describes them), or your own as FILE.py:FUNCTION. May be given "
            "several times.",
        )
    )
    seed: Seed = Field(0, description="The same seed gives the same scores.")
    seeds: Annotated[int, Ge(1), Le(MOST_ITEMS), OptionNotation("N")] = Field(
        1, description="Number of seeds to score with; from 2 on the standard deviation is printed."
    )


class ToleranceOptions(ScoreOptions):
    """Options of the scores of a design with manufacturing errors."""

    objectives: Annotated[list[str], OptionNotation("NAME", ("--objective", "-b"))] = Field(
        ["rgb2normal"],
        description="rgb2normal, normdiff, aoap, 2to3pw, or your own as FILE.py:FUNCTION. May be "
        "given several times.",
    )
    errors: Annotated[list[str], OptionNotation("PATH=SIZE", ("--error",), "usual ones")] = Field(
        [],
        description="A value with a manufacturing error, and the error's standard deviation (mm, "
        "degrees, or the value's own unit), or PATH=+-LIMIT for an error uniformly "
        "distributed up to a limit. lights.position and lights.angle mean each light "
        "by itself. May be given several times.",
    )
    sensors: Annotated[int, Ge(8), Le(MOST_ITEMS), OptionNotation("N")] = Field(
        120, description="Approximate number of manufactured sensors to simulate."
    )
    seed: Seed = Field(0, description="The same seed gives the same sensors.")


class SearchOptions(ScoreOptions):
    """Options of a search: parameters, objectives, method. None is the default of a new study."""

    vary: Annotated[list[str], OptionNotation("PATH=LO:HI[:N]")] = Field(
        [],
        description="A value that may change, between two bounds (N values for a grid); "
        "PATH=+-REACH varies it around its present value, and PATH=NAME,NAME chooses "
        "one of several. May be given several times.",
    )
    objectives: Annotated[list[str], OptionNotation("NAME", ("--objective", "-b"))] = Field(
        [],
        description="What to maximise: rgb2normal, normdiff, aoap, 2to3pw, another objective, "
        "your own as FILE.py:FUNCTION, or arithmetic such as 'aoap + 0.5*coverage'. "
        "If it is given several times, the first is maximised and the others are only "
        "reported; --method pareto optimises all of them.",
    )
    require: Annotated[list[str], OptionNotation("CONDITION", ("--require",))] = Field(
        [],
        description="A condition that the best design must meet, such as 'coverage>=0.55' or "
        "'distortion<=1.5': any objective, or one of its parts, such as "
        "'aoap.coverage_by_area>=0.5'. May be given several times.",
    )
    method: Annotated[str, OptionNotation("NAME", usual="cma-es")] | None = Field(
        None, description="The search method; --methods lists all."
    )
    budget: Annotated[int, Ge(1), Le(MOST_ITEMS), OptionNotation("N")] | None = Field(
        None,
        description="Total number of trials, including the finished ones with --resume; if left "
        "out, the method chooses it.",
    )
    seed: Annotated[Seed, OptionNotation("N", usual="0")] | None = Field(
        None, description="The same seed gives the same search."
    )
    options: Annotated[NamedValues, OptionNotation("NAME=VALUE", ("--option",))] = Field(
        {},
        description="An option of the method, such as sigma=0.1 or population=20. May be given "
        "several times.",
    )
    rules: Annotated[list[str], OptionNotation("FILE.py:FUNCTION", ("--rule",))] = Field(
        [],
        description="A function of a design that returns False, or the reason as text, if the "
        "design is not allowed. May be given several times.",
    )
    coarse_first: bool = Field(
        False,
        description="Score trials by fewer photons and pixels, and in full only those that may be "
        "the best. It saves most of the time of a search by pictures.",
    )
    may_cross: bool = Field(
        False,
        description="Allow parts that cut through one another, lose contact with the parts on "
        "which they rest, or make the sensor much larger.",
    )
    errors: Annotated[list[str], OptionNotation("PATH=SIZE", ("--error",))] = Field(
        [],
        description="A manufacturing error, as in `optisense tolerance`: a value and the standard "
        "deviation of its error. The search then maximises the score that nine of ten "
        "manufactured sensors reach. May be given several times.",
    )
    samples: Annotated[int, Ge(2), Le(MOST_ITEMS), OptionNotation("N", usual="8")] | None = Field(
        None, description="With --error: number of manufactured sensors simulated for each trial."
    )
    resolution: Resolution | None = Field(
        None,
        description="Width and height of the grid of pixels and rays; if left out, pictures are "
        "640 wide and rays 320 across, in the camera's aspect ratio.",
    )
    photons: TrialPhotons | None = Field(
        None,
        description="Photons to trace for a trial; --method light-colours, which renders once, "
        "takes fine if left out.",
    )

    def plan(self) -> Plan:
        """Return the plan of a new study; SearchError if an option can't be read or a rule be
        loaded.
        """
        from optisense.search import Plan, SearchSpace
        from optisense.search.space.constraints import UserRule
        from optisense.search.space.text import parse_errors, parse_space

        rules = [UserRule(text) for text in self.rules]
        for rule in rules:
            rule.loaded  # noqa: B018  a missing file is an error now, and not in trials
        names = ("method", "options", "budget", "seed", "samples")
        given = {name: getattr(self, name) for name in names}
        return Plan(
            space=SearchSpace(parse_space(self.vary), rules),
            goals=self.objectives,
            apart=not self.may_cross,
            coarse_first=self.coarse_first,
            errors=parse_errors(self.errors) if self.errors else None,
            requirements=self.require,
            settings=self.for_objectives(),
            **{name: value for name, value in given.items() if value is not None},
        )

    def as_stored(self) -> dict[str, Any]:
        """Return the given options in the form in which a study stores them."""
        from optisense.search import SearchSpace
        from optisense.search.evaluation.requirements import requirements_of
        from optisense.search.space.constraints import UserRule
        from optisense.search.space.text import parse_errors, parse_space
        from optisense.search.study.plan import reference, rule_reference

        found: dict[str, Any] = {
            "space": SearchSpace(parse_space(self.vary)).to_plain() if self.vary else None,
            "objectives": [reference(goal) for goal in self.objectives],
            "rules": [rule_reference(UserRule(text)) for text in self.rules],
            "errors": parse_errors(self.errors).to_plain() if self.errors else None,
            "apart": False if self.may_cross else None,
            "coarse_first": True if self.coarse_first else None,
            "requirements": [str(each) for each in requirements_of(self.require)],
            "settings": self.for_objectives(),
        }
        for name in ("method", "options", "seed", "samples"):
            found[name] = getattr(self, name)
        return {name: value for name, value in found.items() if value not in (None, {}, [])}
