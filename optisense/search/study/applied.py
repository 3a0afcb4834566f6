"""Design of a trial with the provenance of its new numbers."""

from __future__ import annotations

from optisense.design import Provenance, SensorDesign, Status
from optisense.design.addressing import changed_paths, found_at
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial


def design_of(study: Study, trial: Trial) -> SensorDesign:
    """Return the design of a trial; values that differ from the study's design are marked as found
    by the study.
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
    sources = {**before.provenance, **design.provenance}
    changed = changed_paths(before, design, [*sources, *sorted(varied - sources.keys())])
    marked = sources | dict.fromkeys((path for path in changed if found_at(design, path)), found)
    kept = {path: each for path, each in marked.items() if each is found or path not in changed}
    return design.model_copy(update={"provenance": kept})
