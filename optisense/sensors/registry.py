"""Registry of the built-in sensors, and loading of a design by name or folder."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

from optisense import library
from optisense.design import Diagnostic, SensorDesign, check_design, load_design, storage
from optisense.design.problems import raise_problems
from optisense.design.sensor_design import refuse_no_design
from optisense.errors import DesignError
from optisense.near import suggestion
from optisense.registry import Registry, place_of_definition
from optisense.sensors.light_checks import light_problems
from optisense.text import brief
from optisense.untrusted_files import is_file, is_folder


def _check(name: str, builder: object) -> None:
    if not callable(builder):
        raise DesignError(
            f"the sensor '{name}' is no function",
            where=place_of_definition(builder),
            hint="Name a function that returns a SensorDesign",
        )


SENSORS: Registry[Callable[[], SensorDesign]] = Registry(
    "built-in sensor",
    "optisense.sensors",
    DesignError,
    {
        "digit": "optisense.sensors._digit:digit",
        "gelbelt": "optisense.sensors._gelbelt:gelbelt",
        "gelsight360": "optisense.sensors._gelsight360:gelsight360",
        "gelsight-mini": "optisense.sensors._gelsight_mini:gelsight_mini",
        "gelsight-mini-cylindrical": "optisense.sensors._gelsight_mini:gelsight_mini_cylindrical",
        "gelsight-mini-ideal": "optisense.sensors._gelsight_mini_ideal:gelsight_mini_ideal",
        "gelsight-mini-ideal-cylindrical": (
            "optisense.sensors._gelsight_mini_ideal:gelsight_mini_ideal_cylindrical"
        ),
        "gelsight-mini-ideal-spherical": (
            "optisense.sensors._gelsight_mini_ideal:gelsight_mini_ideal_spherical"
        ),
        "gelsight-mini-spherical": "optisense.sensors._gelsight_mini:gelsight_mini_spherical",
        "gelsight-svelte": "optisense.sensors._gelsight_svelte:gelsight_svelte",
    },
    _check,
)
"""Functions that build a sensor with its default dimensions; other packages add theirs under the
entry-point group `optisense.sensors`."""

BUILT_IN_PREFIX = "builtin:"


def build(name: str) -> SensorDesign:
    """Build a sensor with its default dimensions.

    Raises:
        DesignError: there is no such sensor, and the message suggests a similar name; or its
            function returns no design.
    """
    builder = SENSORS.find(name)
    if getattr(builder, "__module__", "").startswith("optisense.sensors."):
        return _built(builder).copy()
    design: object = builder()
    if not isinstance(design, SensorDesign):
        raise DesignError(
            f"the function of the sensor '{name}' returned {brief(repr(design))}, which is no "
            "SensorDesign",
            where=place_of_definition(builder),
            hint="Return the design",
        )
    return design


@cache
def _built(builder: Callable[[], SensorDesign]) -> SensorDesign:
    """Return a sensor of this package, always the same one, so that its copies share its meshes."""
    return builder()


def load(name_or_folder: str | Path) -> SensorDesign:
    """Load a built-in sensor by its name, or a design by its folder (or its design.yaml).

    `builtin:NAME` always means the built-in sensor and `./NAME` the folder; a plain name must not
    be both.

    Raises:
        OptiSenseError: there is neither, there are both, or the design can't be read.
    """
    text = str(name_or_folder)
    if text.startswith(BUILT_IN_PREFIX):
        return build(text.removeprefix(BUILT_IN_PREFIX))
    path = Path(name_or_folder)
    if isinstance(name_or_folder, str) and text in SENSORS:
        if is_folder(path):
            raise DesignError(
                f"'{text}' is a built-in sensor and also a folder here",
                hint=f"Write ./{text} for the folder, {BUILT_IN_PREFIX}{text} for the built-in "
                "sensor",
            )
        return build(text)
    if not (is_folder(path) or is_file(path)):
        hint = suggestion(text, SENSORS.names(), limit=20)
        if isinstance(name_or_folder, Path) and text in SENSORS:
            hint = "Give the name of a built-in sensor as text, not as a path"
        raise DesignError(f"there is no built-in sensor and no folder '{brief(text)}'", hint=hint)
    return load_design(path)


def save_design(
    design: SensorDesign, folder: str | Path, *, new: bool = False, digest: str | None = None
) -> None:
    """Write a design folder that opens on any machine; see `optisense.design.save_design`.

    Lights that are the user's own parts are described in the design itself, since other machines
    don't have them.

    Raises:
        OptiSenseError: the design can't be saved, or an own part can't be read.
    """
    refuse_no_design(design)
    storage.save_design(library.with_own_lights(design), folder, new=new, digest=digest)


def check(design: SensorDesign) -> list[Diagnostic]:
    """Check a design without rendering it, and whether the library knows its lights.

    Returns:
        Problems of severity "warning": unusual, but they can be simulated.

    Raises:
        DesignError: the design can't be simulated, or its simulation would be wrong.
    """
    refuse_no_design(design)
    found = find_problems(design)
    raise_problems(found, f"design '{design.name}'")
    return found


def find_problems(design: SensorDesign, known: list[Diagnostic] | None = None) -> list[Diagnostic]:
    """Return all problems of a design that can be found without rendering it: those of
    `optisense.design.check_design`, then those of its lights.

    Args:
        known: the former, if they are known.
    """
    found = check_design(design, light_names=library.names("light")) if known is None else known
    if any(each.severity == "error" for each in found):
        return found
    return [*found, *light_problems(design)]
