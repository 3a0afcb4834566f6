"""Options of searches, and the plan of a study that they make."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from annotated_types import Ge, Le
from pydantic import Field

from optisense.commands.options import (
    MOST_ITEMS,
    NamedValues,
    OptionNotation,
    Photons,
    Resolution,
    Seed,
)
from optisense.commands.scoring import ScoreOptions
from optisense.quality import LEVELS

if TYPE_CHECKING:
    from optisense.search import Plan

TrialPhotons = Annotated[
    Photons, OptionNotation(f"N|{LEVELS}", usual="normal, 1 million", is_text=True)
]


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
        """Return the plan of a new study.

        Raises:
            SearchError: an option can't be read, or a rule can't be loaded.
        """
        from optisense.search import Plan, SearchSpace
        from optisense.search.space.constraints import UserRule
        from optisense.search.space.text import parse_errors, parse_space

        rules = [UserRule(text) for text in self.rules]
        for rule in rules:
            rule.loaded  # noqa: B018  a missing file is an error now, and not in trials
        space = SearchSpace(parse_space(self.vary), rules)
        errors = parse_errors(self.errors) if self.errors else None
        names = ("method", "options", "budget", "seed", "samples")
        given = {name: getattr(self, name) for name in names}
        given["settings"] = self.for_objectives()
        return Plan(
            space=space,
            goals=self.objectives,
            apart=not self.may_cross,
            coarse_first=self.coarse_first,
            errors=errors,
            requirements=self.require,
            **{name: value for name, value in given.items() if value not in (None, {})},
        )

    def as_stored(self) -> dict[str, Any]:
        """Return the given options in the form in which a study stores them.

        Raises:
            SearchError: an option can't be read.
        """
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
        }
        for name in ("method", "options", "seed", "samples"):
            found[name] = getattr(self, name)
        found["settings"] = self.for_objectives()
        return {name: value for name, value in found.items() if value not in (None, {}, [])}
