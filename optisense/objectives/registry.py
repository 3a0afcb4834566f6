"""The registry of objectives: those of this package, of other packages, and a user's own."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.errors import ObjectiveError
from optisense.near import suggestion
from optisense.objectives.score import Drawing
from optisense.registry import Registry, place_of_definition

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation, Reads
    from optisense.objectives.press import Press

BUILT_IN = ("rgb2normal", "normdiff", "aoap", "2to3pw")
"""The four objectives of the OptiSense paper."""

CONDITIONS, WATCHED = "conditions", "watched"
"""Names under which the store of a study keeps the conditions of its trials and other watched
scores, in addition to the parts of each objective; they are reserved and cannot name an
objective."""

UNBOUNDED = (-math.inf, math.inf)

Range = tuple[float, float] | Callable[..., tuple[float, float]]

_F = TypeVar("_F", bound="Callable[..., Any]")


@dataclass(frozen=True)
class Objective:
    """A function that scores a sensor, with its metadata.

    Attributes:
        name: name on the command line and in files, in lower case.
        function: function of an `Evaluation`, or of the design (see `takes_design`), and its own
            settings (keyword arguments) that returns a number, or a number and its parts, or a
            `Score`.
        title: display name.
        draw: function that draws the figure of a score, or None.
        beside: names of the parts that are shown beside the value.
        reads: function of an unexposed `Press` and the settings (keyword arguments) that returns
            the pixels (h, w) that are read: True or 1 for pixels that are read one by one, less
            where a share of the camera samples suffices. If None, all pixels of the contact are
            read.
        range: the lowest and the highest value that it can return, or a function of the settings
            (keyword arguments) that returns both; a value outside counts as a failure.
        unit: unit of the value, such as "mm"; empty for a plain number.
        lower_is_better: whether a lower value is better, as for an error. A search maximises the
            negative value of such an objective.
        rays_only: whether it traces chief rays only, or none, and needs no light.
        usual: the values of the poorest and of the best built-in sensor, for comparison; None if
            they are not known.
        numbers: names of all its parts that are numbers, which an expression can use, such as
            "coverage" in ``aoap.coverage``; None if they are known only after a sensor was scored.
    """

    name: str
    function: Callable[..., Any]
    title: str
    draw: Drawing | None = None
    beside: tuple[str, ...] = ()
    reads: Callable[..., Any] | None = None
    range: Range = UNBOUNDED
    unit: str = ""
    lower_is_better: bool = False
    rays_only: bool = False
    usual: tuple[float, float] | None = None
    numbers: tuple[str, ...] | None = None

    def __call__(self, evaluation: Evaluation, **settings: Any) -> Any:
        """Call the function itself, without any checks of its result."""
        # A user's function gets a copy, as it may edit it; other objectives share the design.
        given = evaluation.design.copy() if takes_design(self.function) else evaluation
        return self.function(given, **settings)

    @property
    def settings(self) -> dict[str, Any]:
        """The objective's own settings and their defaults: its keyword arguments."""
        parameters = list(inspect.signature(self.function).parameters.values())
        return {
            parameter.name: parameter.default
            for parameter in parameters[1:]
            if parameter.default is not parameter.empty
        }

    def bounds(self, settings: Mapping[str, Any] | None = None) -> tuple[float, float]:
        """Return the lowest and the highest value with the given settings and the defaults of the
        others.

        Raises:
            ObjectiveError: the range is not two numbers in their order.
        """
        found = self.range
        if callable(found):
            found = found(**{**self.settings, **(settings or {})})
        try:
            low, high = (float(bound) for bound in found)
            if low < high:
                return low, high
        except (TypeError, ValueError):
            pass
        raise ObjectiveError(
            f"the range of {self.name} is {found!r}", hint="Give (lowest, highest)"
        )

    @property
    def summary(self) -> str:
        """The first sentence of the function's description."""
        text = inspect.getdoc(self.function) or ""
        return " ".join(text.split("\n\n")[0].split()).rstrip(".")


def takes_design(function: Callable[..., Any]) -> bool:
    """Return whether an objective is a function of the design, which needs neither light nor rays.

    Its first parameter is annotated as a `SensorDesign`, or has no annotation and the name
    ``design``.
    """
    try:
        first = next(iter(inspect.signature(function).parameters.values()), None)
    except (TypeError, ValueError):
        return False
    if first is None:
        return False
    if first.annotation is first.empty:
        return first.name == "design"
    if isinstance(first.annotation, str):  # as of `from __future__ import annotations`
        return first.annotation.rpartition(".")[2] == SensorDesign.__name__
    return first.annotation is SensorDesign


def _check(name: str, given: Objective) -> None:
    if name in (CONDITIONS, WATCHED) or any(sign in name for sign in "'\""):
        raise ObjectiveError(
            f"'{name}' can't be the name of an objective",
            hint="Use lower case, without quotes, and not 'conditions' or 'watched'",
        )
    try:
        parameters = list(inspect.signature(given.function).parameters.values())
    except (TypeError, ValueError):
        parameters = []
    required = [each for each in parameters[1:] if each.default is each.empty]
    if not parameters or any(
        each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL) for each in required
    ):
        raise ObjectiveError(
            f"the objective '{name}' must take an evaluation, and settings with defaults",
            where=place_of_definition(given),
            hint="Write: def score(evaluation): ...",
        )


def _from_package(name: str, loaded: Any) -> Objective:
    if not callable(loaded):
        raise ObjectiveError(f"the objective '{name}' is not a function")
    return _of_function(name, loaded, name)


def _of_function(name: str, function: Callable[..., Any], title: str) -> Objective:
    """Return the objective of a function that is given without further metadata."""
    no_light = takes_design(function)
    reads = no_pixels if no_light else None
    return Objective(name, function, title, reads=reads, rays_only=no_light)


OBJECTIVES: Registry[Objective] = Registry(
    "objective",
    "optisense.objectives",
    ObjectiveError,
    {
        "rgb2normal": "optisense.objectives.rgb2normal:rgb2normal",
        "normdiff": "optisense.objectives.normdiff:normdiff",
        "aoap": "optisense.objectives._aoap:aoap",
        "2to3pw": "optisense.objectives._projection_warping:projection_warping",
        "coverage": "optisense.objectives._aoap:coverage",
        "distortion": "optisense.objectives._footprints:distortion",
        "bend_radius": "optisense.objectives._bent_parts:bend_radius",
        "reading": "optisense.objectives._reading:reading",
        "depth": "optisense.objectives._reading:depth",
        "sharpness": "optisense.objectives._footprints:sharpness",
        "uniformity": "optisense.objectives._lighting:uniformity",
        "shadow": "optisense.objectives._lighting:shadow",
        "power": "optisense.objectives._lighting:power",
        "draft": "optisense.objectives._bent_parts:draft",
        "clearance": "optisense.objectives._clearance:clearance",
        "cage_roughness": "optisense.objectives._bent_parts:cage_roughness",
    },
    _check,
    _from_package,
)
"""Registry of the objectives: the paper's, further ones of this package, then others; packages add
functions under the entry-point group `optisense.objectives`."""

names, forgetting = OBJECTIVES.names, OBJECTIVES.forgetting


def objective(
    name: str,
    *,
    title: str | None = None,
    draw: Drawing | None = None,
    beside: tuple[str, ...] = (),
    reads: Callable[..., Any] | None = None,
    range: Range = UNBOUNDED,
    unit: str = "",
    lower_is_better: bool = False,
    rays_only: bool = False,
    usual: tuple[float, float] | None = None,
    numbers: tuple[str, ...] | None = None,
) -> Callable[[_F], _F]:
    """Register a function of an `Evaluation`, or of the design, as an objective.

    Args:
        name: unused name in lower case.
        title: display name; ``name`` by default.
        draw, beside, reads, range, unit, lower_is_better, usual: see `Objective`.
        rays_only: see `Objective`; true of every function of the design.
        numbers: see `Objective`; an expression with any other name is refused before a sensor is
            scored.

    Raises:
        ObjectiveError: the name is taken or malformed, or the function takes no evaluation.
    """

    def register(function: _F) -> _F:
        no_light = rays_only or takes_design(function)
        given = Objective(
            name,
            function,
            title or name,
            draw,
            beside,
            no_pixels if no_light and reads is None else reads,
            range,
            unit,
            lower_is_better,
            no_light,
            usual,
            numbers,
        )
        OBJECTIVES.register(name, given)
        return function

    return register


def pixels_read(
    objectives: Iterable[Objective], settings: Mapping[str, Mapping[str, Any]]
) -> Reads | None:
    """Return the function that gives the pixels of a press that any of the objectives read.

    Args:
        objectives: the objectives that will share an evaluation.
        settings: the settings of each objective, by its name.

    Returns:
        The function; None if all pixels are read one by one.
    """
    found = []
    for each in objectives:
        if each.reads is None:
            return None
        found.append(partial(each.reads, **{**each.settings, **settings.get(each.name, {})}))

    def reads(press: Press) -> NDArray[np.float64]:
        return np.maximum.reduce([np.asarray(read(press), dtype=np.float64) for read in found])

    return reads


def no_pixels(press: Press, **settings: Any) -> NDArray[np.bool_]:
    """Return an empty mask (h, w), for objectives that use rays only."""
    return np.zeros_like(press.mask)


def find(name: str) -> Objective:
    """Return an objective by its name, or by ``file.py:function``.

    Raises:
        ObjectiveError: no such objective (the message names a near match), or it can't be loaded.
    """
    file, separator, function = name.rpartition(":")
    if separator and file.endswith(".py"):
        return from_file(Path(file), function)
    if name.endswith(".py"):
        return from_file(Path(name))
    return OBJECTIVES.find(name)


def from_file(path: Path, function: str | None = None) -> Objective:
    """Load a user's objective from a Python file, which is run.

    Args:
        function: name of the function in the file; optional if it registers one objective.

    Raises:
        ObjectiveError: the file is missing, fails, or has no such function.
    """
    from optisense.objectives.files import run_file

    before = OBJECTIVES.registered()
    content = run_file(path)
    after = OBJECTIVES.registered()
    added = [each for key, each in after.items() if before.get(key) is not each]
    if function is None:
        if len(added) != 1:
            found = ", ".join(each.function.__name__ for each in added) or "none"
            raise ObjectiveError(
                f"the file registers {len(added)} objectives ({found})",
                where=str(path),
                hint="Decorate one function with @optisense.objective(name), or name it: "
                f"{path.name}:FUNCTION",
            )
        return added[0]
    chosen = content.get(function)
    for each in added:
        if each.function is chosen:
            return each
    if not callable(chosen):
        known = [name for name, each in content.items() if inspect.isfunction(each)]
        raise ObjectiveError(
            f"the file has no function '{function}'",
            where=str(path),
            hint=suggestion(function, known),
        )
    key = function.lower()
    return OBJECTIVES.register(key, _of_function(key, chosen, function))
