"""Design of a trial with the provenance of its new numbers."""

from __future__ import annotations

from typing import Any

from optisense.design import Part, Provenance, SensorDesign, Status, get_value
from optisense.errors import DesignError
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial


def design_of(study: Study, trial: Trial) -> SensorDesign:
    """Return the design of a trial; values that differ from the study's design are marked as found
    by the study.

    Raises:
        OptiSenseError: the values do not fit together.
    """
    design = trial.design
    settings = study.settings
    if trial.is_start:
        return design
    found = Provenance(
        status=Status.DERIVED,
        source=f"trial {trial.number} of a {settings.method} search for {settings.names[0]}, "
        f"which scores {trial.unbiased_score:.4g}",
    )
    before = study.space.design
    # A cage is marked as a whole, and so are moved lights; other numbers are marked one by one.
    varied = {
        p.asked if p.name.startswith("cages.") else target.path
        for p in study.space.parameters
        for target in p.targets
    }
    varied |= {path for p in study.space.parameters if p.variable for path in p.variable.values}
    varied |= {f"lights.{group}.model" for group in design.lights}  # lights.model varies them all
    known = {path: each for path, each in design.provenance.items() if _value(design, path)}
    for path in {**known, **dict.fromkeys(sorted(varied))}:
        now, then = _value(design, path), _value(before, path)
        if now and now != then:
            known[path] = found
    return design.model_copy(update={"provenance": known})


def _value(design: SensorDesign, path: str) -> tuple[Any, ...]:
    """Return the value at a path, and the vertices of a part, or an empty tuple if the path names
    nothing.
    """
    try:
        value = get_value(design, path)
    except DesignError:
        return ()
    if isinstance(value, Part):
        return value, design.meshes[path.removeprefix("parts.")].vertices.tobytes()
    return (value,)
