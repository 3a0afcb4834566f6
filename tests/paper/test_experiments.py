"""Each experiment's numbers, verdicts, tables, picture and text, from answers of known truth."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from optisense.json_values import json_ready
from paper import EXPERIMENTS, Experiment, Finding, Record, find, write_page
from paper.experiment import gaps, write
from paper.robustness import AS_ASSUMED, with_verdicts
from paper.robustness_questions import CONCLUSIONS
from paper.spread import spread
from paper.text import PICTURE, RESULT, TEXT
from paper.unit import ExperimentError

Answered = Callable[..., tuple[Finding, list[Record]]]
"""See conftest.py."""

EVERY = pytest.mark.parametrize("experiment", EXPERIMENTS.values(), ids=list(EXPERIMENTS))


def result_of(experiment: Experiment, numbers: dict[str, Any], quick: bool) -> dict[str, Any]:
    plain: dict[str, Any] = json_ready(
        {
            "experiment": experiment.name,
            "title": experiment.title,
            "quick": quick,
            "settings": experiment.settings(quick),
            "versions": {},
            "seconds": {"units": 1.0, "processor": 2.0, "this_run": 1.0},
            "units": 2,
            "spent": {
                "shared by two": [60.0, 55.0, False],
                f"of {experiment.name}": [30.0, 59.0, True],
            },
            "numbers": numbers,
            "claims": [claim.to_plain() for claim in experiment.claims(numbers)],
            "gaps": [],
        }
    )
    return plain


def verdicts(name: str, score: Any, answered: Answered) -> dict[str, str]:
    """By the beginning of the statements."""
    experiment = EXPERIMENTS[name]
    finding, _ = answered(experiment, experiment.settings(), score)
    return {claim.says: claim.verdict for claim in experiment.claims(finding.numbers)}


@EVERY
def test_answers_become_a_folder(
    experiment: Experiment, answered: Answered, tmp_path: Path
) -> None:
    finding, _ = answered(experiment, experiment.settings())
    result = result_of(experiment, finding.numbers, False)
    folder = tmp_path / experiment.name
    write(experiment, result, finding.pictures, folder)
    assert json.loads((folder / RESULT).read_text()) == result
    assert (folder / PICTURE).read_bytes().startswith(b"\x89PNG")
    text = (folder / TEXT).read_text()
    assert text.startswith(f"## {experiment.title}\n")
    assert "nan" not in re.sub(r"[a-z]*nan[a-z]+", "", text)
    for claim in result["claims"]:
        assert f"| {claim['says']} | {claim['here']} | **{claim['verdict']}** |" in text


@EVERY
def test_where_everything_fails_nothing_is_claimed(
    experiment: Experiment, answered: Answered, tmp_path: Path
) -> None:
    finding, records = answered(experiment, experiment.settings(True), failure="all is dark")
    found = [claim.verdict for claim in experiment.claims(finding.numbers)]
    assert set(found) <= {"inconclusive"}
    assert {gap["reason"] for gap in gaps(records)} == {"all is dark"}
    result = result_of(experiment, finding.numbers, True)
    write(experiment, result, finding.pictures, tmp_path / "failed")


@EVERY
def test_units_of_other_seeds_are_other_questions(experiment: Experiment) -> None:
    first = next(experiment.steps(experiment.settings(seeds=1)))
    more = next(experiment.steps(experiment.settings(seeds=3)))
    assert {unit.key for unit in first} <= {unit.key for unit in more} or experiment.name == "speed"
    assert len(first) <= len(more)


def peak_at(best: float) -> Any:
    def score(objective: str, design: dict[str, Any], seed: int) -> float:
        value = design["change"].get("coating.specularity", 0.0)
        return -((value - best) ** 2) + 0.001 * seed

    return score


def test_mini_shapes_agrees_where_the_best_coating_is_the_papers(answered: Answered) -> None:
    found = verdicts("mini-shapes", peak_at(0.2), answered)
    chosen = {says: verdict for says, verdict in found.items() if "specularity" in says}
    assert set(chosen.values()) == {"agrees"} and len(chosen) == 4


def test_mini_shapes_disagrees_where_it_is_not(answered: Answered) -> None:
    found = verdicts("mini-shapes", peak_at(0.8), answered)
    assert {v for says, v in found.items() if "specularity" in says} == {"disagrees"}


@pytest.mark.parametrize("name", ["mini-shapes", "gelbelt-lights", "gelsight360"])
def test_nothing_is_best_where_all_are_alike(name: str, answered: Answered) -> None:
    found = verdicts(name, lambda objective, design, seed: 0.01 * seed, answered)
    assert {v for says, v in found.items() if "best (" in says or "has the best" in says} == {
        "inconclusive"
    }


@pytest.mark.parametrize(
    ("third_seed", "verdict"), [("01234", "agrees"), ("32104", "inconclusive")]
)
def test_objectives_follow_the_tasks_beyond_the_scatter_of_seeds(
    third_seed: str, verdict: str, answered: Answered
) -> None:
    """The mean of the seeds' rank correlations is above 0.5 in both cases."""

    def metallic(objective: str, design: dict[str, Any], seed: int) -> float:
        return float(design["change"]["coating.specularity"])

    experiment = EXPERIMENTS["tasks"]
    numbers = answered(experiment, experiment.settings(), metallic)[0].numbers
    for tasks in numbers["tasks"].values():
        for columns in tasks.values():
            for key, sign in (("error", -1.0), ("snr", 1.0)):
                for place, (x, third) in enumerate(zip(columns[key], third_seed, strict=True)):
                    columns[key][x] = spread([sign * place, sign * place, sign * float(third)])
    claims = {claim.says: claim for claim in experiment.claims(numbers)}
    assert claims["RGB2Normal shows the trends of the tasks."].verdict == verdict
    for column in numbers["tasks"]["cylinder"]["misalignment"].values():
        column["0.6"] = column["0.8"]
    trend = next(c for c in experiment.claims(numbers) if "less well" in c.says)
    assert trend.here.endswith(" at 0.8, 1 and 0.6")


@pytest.mark.parametrize(("winner", "verdict"), [(3, "agrees"), (2, "disagrees")])
def test_gelbelts_lights(winner: int, verdict: str, answered: Answered) -> None:
    def score(objective: str, design: dict[str, Any], seed: int) -> float:
        return float(design["dimensions"]["light_design"] == winner) + 0.001 * seed

    found = verdicts("gelbelt-lights", score, answered)
    assert {v for says, v in found.items() if says.startswith("Design 3")} == {verdict}
    assert found["Light from the sides of the acrylic (design 1) hardly reaches the belt."] == (
        "disagrees"  # the made-up pictures are equally bright
    )


def test_gelsight360_in_the_papers_order_and_in_the_opposite_one(answered: Answered) -> None:
    from paper.gelsight360_claims import PAPER

    def papers(sign: float) -> Any:
        def score(objective: str, design: dict[str, Any], seed: int) -> float:
            if objective == "2to3pw":
                return -sign * abs(design["dimensions"]["tip_design"] - 6)
            row = PAPER.get(design.get("colouring", ""), {"rgb2normal": 0.9, "normdiff": -20.0})
            return sign * row[objective] + 1e-4 * seed

        return score

    same = verdicts("gelsight360", papers(1.0), answered)
    other = verdicts("gelsight360", papers(-1.0), answered)
    for says in same:
        if "order" in says or "RGBRGBRG" in says or says.startswith("Of the tips"):
            assert (same[says], other[says]) == ("agrees", "disagrees"), says


def test_svelte_is_held_against_the_papers_two_numbers(answered: Answered) -> None:
    def first_mirror(objective: str, design: dict[str, Any], seed: int) -> float:
        return 0.63 if design["change"] else 0.24

    found = list(verdicts("svelte-mirror", first_mirror, answered).values())
    assert found == ["agrees", "agrees", "agrees"]
    found = list(verdicts("svelte-mirror", lambda *_: 0.4, answered).values())
    assert found[:2] == ["disagrees", "disagrees"]
    found = list(verdicts("svelte-mirror", lambda *_: 0.75, answered).values())
    assert found[:2] == ["disagrees", "agrees"]  # a better mirror than the paper's


def test_robustness_counts_geometries(answered: Answered) -> None:
    def hangs_on_the_guide(objective: str, design: dict[str, Any], seed: int) -> float:
        shiny = design["change"].get("coating.specularity", 0.0) > 0.5
        thick = design["dimensions"].get("guide_thickness", 4.0) > 5.0
        return float(shiny == thick) + 0.001 * seed

    experiment = EXPERIMENTS["robustness"]
    settings = {**experiment.settings(), "draws": 0}
    finding, _ = answered(experiment, settings, hangs_on_the_guide)
    claim = next(c for c in experiment.claims(finding.numbers) if "cylindrical" in c.says)
    assert claim.verdict == "inconclusive"
    assert claim.here == "holds in 8 of 9 geometries; does not hold for: guide_thickness 6"
    titles = [table.title for table in experiment.tables(finding.numbers)]
    assert "Margins, tip of GelSight360" in titles and len({*titles}) == len(titles)


def test_margins_are_held_against_the_noise_of_single_seeds() -> None:
    """With three seeds, a margin is decided from 2.92 times the noise on."""
    rows = {AS_ASSUMED: [1.0, 2.0, 3.0], "a": [2.9], "b": [2.93], "c": [-2.93], "d": [None]}
    found = with_verdicts(rows)["geometries"]
    assert {name: each["holds"] for name, each in found.items()} == {
        AS_ASSUMED: True,
        "a": None,
        "b": True,
        "c": False,
        "d": None,
    }


@pytest.mark.parametrize(
    ("margins", "verdict", "why"),
    [
        ([1.0, 2.0], "agrees", ""),
        ([-1.0, -2.0], "disagrees", "for none"),
        ([-1.0, None], "inconclusive", "In 1 of 2 geometries, .* In the others, .* fails"),
        ([None, None], "inconclusive", "In all 2 geometries, .*no score.$"),
        ([1.0, -1.0], "inconclusive", "depends on assumed dimensions"),
    ],
)
def test_conclusions_are_decided_by_all_geometries(
    margins: list[float | None], verdict: str, why: str
) -> None:
    found = with_verdicts(dict(zip((AS_ASSUMED, "a"), ([each] for each in margins), strict=True)))
    numbers = {"margins": {next(iter(CONCLUSIONS)): found}}
    (claim,) = EXPERIMENTS["robustness"].claims(numbers)
    assert claim.verdict == verdict
    assert re.search(why, claim.to_plain()["why"])


def test_readings_tell_what_decides(answered: Answered) -> None:
    """Where only bare metal is best at 0.2, the law decides about the cylinder's coating, and
    nothing else does."""

    def by_law(objective: str, design: dict[str, Any], seed: int) -> float:
        change = design["change"]
        best = 0.2 if change.get("coating.scattering") == "conductor" else 0.6
        return 1.0 - abs(change.get("coating.specularity", 0.0) - best)

    experiment = EXPERIMENTS["readings"]
    finding, _ = answered(experiment, experiment.settings(True), by_law)
    claim = next(c for c in experiment.claims(finding.numbers) if "about 0.2" in c.says)
    assert claim.verdict == "inconclusive"
    assert claim.here.startswith(
        "holds under 100 of 300 interpretations; under the default it does not hold"
    )
    row = next(r for r in experiment.tables(finding.numbers)[2].rows if "about 0.2" in r[0])
    assert row[1:] == ["0 / 0 / 100", "33 / 33", "33 / 33", *[" / ".join(["33"] * 5)] * 2]
    mirror = next(r for r in experiment.tables(finding.numbers)[3].rows if "0.635" in r[0])
    assert "the gradient method" in mirror[0]
    assert mirror[1:] == ["100 / 100", "100 / 100"]


def test_slow_images_on_a_busy_machine_and_scattered_times_tell_nothing(answered: Answered) -> None:
    experiment = EXPERIMENTS["speed"]
    finding, _ = answered(experiment, experiment.settings())
    numbers = finding.numbers
    numbers["machine"]["processors"] = 2

    def verdict(seconds: float, processor: float, scatter: float = 0.1) -> str:
        for sizes in numbers["times"].values():
            for row in sizes.values():
                row["new_light"] = spread([seconds - scatter, seconds, seconds + scatter])
                row["new_light_processor"]["mean"] = processor
        (said,) = {claim.verdict for claim in experiment.claims(numbers)}
        return said

    assert verdict(2.0, 3.9) == "agrees"
    assert verdict(20.0, 39.0) == "disagrees"
    assert verdict(20.0, 4.0) == "inconclusive"
    assert verdict(7.4, 14.5, scatter=5.0) == "inconclusive"


def test_the_page_collects_results_beside_it(answered: Answered, tmp_path: Path) -> None:
    first, second = list(EXPERIMENTS.values())[:2]
    several = [first, replace(second, repeats_claims=True)]
    for each in several:
        finding, _ = answered(each, each.settings(True))
        result = result_of(each, finding.numbers, True)
        write(each, result, finding.pictures, tmp_path / "out" / each.name)
    page = tmp_path / "docs" / "experiments.md"
    page.parent.mkdir()
    write_page(page, tmp_path / "out", several)
    text = page.read_text()
    assert f"In total (without *{second.title}*, which repeats statements): " in text
    assert "The 3 evaluations take 3 processor minutes. " in text  # 55 s + 2 x 59 s
    assert f"*{first.title}* and *{second.title}* are quick runs.\n" in text
    for target in re.findall(r"!\[[^]]*\]\(([^)]+)\)", text):
        assert (page.parent / target).is_file()
    assert sorted(p.name for p in (page.parent / "experiments").iterdir()) == sorted(
        f"{each.name}.{kind}" for each in several for kind in ("json", "png")
    )
    with pytest.raises(ExperimentError, match="can't be read"):
        write_page(page, tmp_path / "nothing", several)


def test_names_and_near_names() -> None:
    assert find("all") == list(EXPERIMENTS.values())
    assert find("speed") == [EXPERIMENTS["speed"]]
    with pytest.raises(ExperimentError, match="no experiment 'mini-shape'") as error:
        find("mini-shape")
    assert "mini-shapes" in str(error.value.hint)
    with pytest.raises(ExperimentError, match="number of seeds is 0"):
        EXPERIMENTS["speed"].settings(seeds=0)
