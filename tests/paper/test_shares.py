"""Units that can share a scene or its light come one after the other."""

from __future__ import annotations

import itertools
from typing import Any

from paper import EXPERIMENTS, Unit
from paper.bench import LEAST_UNITS, shares
from paper.evaluations import perception, picture, scores, searched, sensor


def score(name: str, seed: int, change: dict[str, Any] | None = None, **dimensions: float) -> Unit:
    settings = {"photons": 1000, "seed": seed}
    design = sensor(name, change, **dimensions)
    inputs = {"design": design, "objectives": ["normdiff"], "settings": settings}
    return Unit(scores, inputs, f"score {name} {seed} {change} {dimensions}")


def see(name: str, seed: int, photons: int = 1000) -> Unit:
    inputs = {"design": sensor(name), "contacts": [], "photons": photons, "seed": seed}
    return Unit(picture, inputs, f"picture {name} {seed} {photons}")


def test_the_same_light_comes_together_then_the_same_sensor() -> None:
    first, second = score("gelbelt", 0), score("gelbelt", 1)
    shiny = score("gelbelt", 0, {"coating.specularity": 0.5})
    thick = score("gelbelt", 0, None, gel_thickness=4.0)
    seen, other_photons = see("gelbelt", 0), see("gelbelt", 0, 2000)
    mini = score("gelsight-mini-ideal", 0)
    found = shares([first, mini, second, shiny, thick, seen, other_photons])
    assert found == [[first, seen, second, shiny, other_photons], [mini], [thick]]


def test_a_sensor_of_many_units_is_shared_by_processes_but_never_one_light() -> None:
    many = [each for seed in range(20) for each in (score("gelbelt", seed), see("gelbelt", seed))]
    found = shares(many)
    assert [unit for share in found for unit in share] == many
    assert len(found) > 3 and min(map(len, found[:-1])) >= LEAST_UNITS
    for share in found:
        assert len(share) % 2 == 0


def test_a_search_has_a_process_for_itself_and_no_unit_is_lost() -> None:
    search = Unit(searched, {"design": sensor("gelbelt"), "method": "grid"}, "a search")
    assert shares([score("gelbelt", 0), search]) == [[score("gelbelt", 0)], [search]]
    for experiment in EXPERIMENTS.values():
        units = next(experiment.steps(experiment.settings()))
        found = [unit.key for share in shares(units) for unit in share]
        assert sorted(found) == sorted(unit.key for unit in units)


def test_tasks_find_the_light_of_mini_shapes() -> None:
    units = [
        unit
        for name in ("mini-shapes", "tasks")
        for unit in next(EXPERIMENTS[name].steps(EXPERIMENTS[name].settings()))
    ]
    once = list({unit.key: unit for unit in units}.values())
    flat = [unit for share in shares(once) for unit in share]
    for before, unit in itertools.pairwise(flat):
        if unit.work is perception:
            light = {**before.inputs, **before.inputs.get("settings", {})}
            for name in ("design", "photons", "seed"):
                assert light[name] == unit.inputs[name]
