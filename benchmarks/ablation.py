"""Effect of each acceleration and refinement of the optics: each is switched off in turn.

``python -m benchmarks.ablation [--case WORD ...] [--only WORD ...] [--errors] [--dry]`` writes
ablation.json and ablation.md beside this file. Images with and without a feature are rendered in
turn, so that other work of the machine slows both; times are processor times, and are left out with
``--errors``, on a GPU. The errors are those against the references of `benchmarks.ablation_cases`.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from benchmarks.ablation_cases import (
    BOX,
    CASES,
    DEPTH,
    LOBE_PHOTONS,
    PHOTONS,
    RADIUS,
    REFERENCE_PHOTONS,
    RESOLUTION,
    Case,
    Truth,
    reference,
    smooth,
)
from benchmarks.ablation_features import Ablation, ablations
from benchmarks.patches import RING
from benchmarks.results import machine, measured_on, page_head, say_if_busy, store, stored
from optisense import OpticalModel
from optisense.mechanics import CONFORMING

SEEDS = (1, 2)
"""Seeds of the images of a feature of shading."""
LIGHT_SEEDS = (1, 2, 3)
"""Seeds of the images of a feature of the light, whose errors differ more between seeds."""
PAIRS = 2
"""Number of pairs of images from a kept radiance cache, for each of `SEEDS`; for each of
`LIGHT_SEEDS`, there is one."""
WARM_UP_PHOTONS = 20_000
"""Number of photons of the first image of a model, which compiles the kernels."""
LEAST_ERROR = 0.005
"""Smallest error that changes are relative to: smaller ones are less than the noise of a camera."""
SMALL = 0.1
"""Relative change below which a feature is not worth its code."""
CERTAINTY = 2.0
"""Number of standard errors within which it is uncertain whether a change is above `SMALL`."""

ERRORS = ("error_in_contact", "error_around", "error_elsewhere")
BIASES = ("bias_in_contact", "bias_around", "bias_elsewhere")
TIMES = ("new_light", "kept_light")
FloatArray = NDArray[np.floating]


@dataclass
class Measured:
    """Images of a case with every feature (first of each pair) and without one (second).

    Attributes:
        squares: squared errors of the images of each seed, one for each of `ERRORS`.
        biases: errors of their means.
        differences: squared differences of each pair, relative to the squared mean.
        seconds: processor seconds, of images with new light and with kept light.
    """

    squares: list[list[FloatArray]] = field(default_factory=list)
    biases: list[list[FloatArray]] = field(default_factory=list)
    differences: list[FloatArray] = field(default_factory=list)
    seconds: dict[str, list[list[float]]] = field(default_factory=lambda: {k: [] for k in TIMES})

    def add(self, truth: Truth, images: list[FloatArray]) -> None:
        """Add the radiance (h, w, 3) of a pair."""
        squares, biases = zip(*(truth.errors(image) for image in images), strict=True)
        self.squares.append(list(squares))
        self.biases.append(list(biases))
        one, other = (smooth(image) for image in images)
        self.differences.append(
            np.array([((one - other)[m] ** 2).mean() / one[m].mean() ** 2 for m in truth.masks])
        )

    def row(self) -> dict[str, Any]:
        """Return the results of the second image of the pairs, and their changes."""
        squares, biases = np.array(self.squares), np.array(self.biases)
        errors = np.sqrt(squares.mean(axis=0))
        row: dict[str, Any] = dict(zip(ERRORS, errors[1].tolist(), strict=True))
        row |= dict(zip(BIASES, biases.mean(axis=0)[1].tolist(), strict=True))
        row["difference"] = np.sqrt(np.mean(self.differences, axis=0)).tolist()
        row["changes"] = {key: _of_errors(squares[..., k]) for k, key in enumerate(ERRORS)}
        for key, pairs in self.seconds.items():
            if pairs:
                times = np.array(pairs)
                row[f"cpu_s_{key}"] = float(np.median(times[:, 1]))
                ratios = times[:, 1] / times[:, 0] - 1
                # The standard error of a median is 1.25 times that of a mean.
                scatter = 1.25 * ratios.std(ddof=1) / len(ratios) ** 0.5
                row["changes"][key] = [float(np.median(ratios)), float(scatter)]
        return rounded(row)


def _of_errors(squares: FloatArray) -> list[float]:
    """Return the change of an error, from squares (seeds, 2), and its jackknife standard error."""

    def change(some: FloatArray) -> float:
        with_it, without = np.sqrt(some.mean(axis=0))
        return float((without - with_it) / max(with_it, LEAST_ERROR))

    count = len(squares)
    parts = np.array([change(np.delete(squares, k, axis=0)) for k in range(count)])
    return [change(squares), float(np.sqrt((count - 1) * parts.var()))]


def rounded(value: Any) -> Any:
    """Return a tree of numbers, rounded to five digits after the point."""
    if isinstance(value, dict):
        return {key: rounded(each) for key, each in value.items()}
    if isinstance(value, list):
        return [rounded(each) for each in value]
    return round(value, 5) if isinstance(value, float) else value


def compared(
    case: Case, on: OpticalModel, ablation: Ablation | None, truth: Truth, times: bool
) -> Measured:
    """Return images with and without a feature; the feature None switches off nothing.

    Args:
        on: the model with every feature, whose kernels are compiled. Features of shading use its
            radiance caches.
    """
    off_is = nullcontext if ablation is None else ablation.applied
    new_light = ablation is None or ablation.light or case.draft
    contact = case.contact(on)
    off = on
    if new_light:
        with off_is():
            off = case.model()

    def image(which: int, seed: int, photons: int = case.photons) -> tuple[FloatArray, float]:
        with off_is() if which else nullcontext():
            began = time.process_time()
            seen = (on, off)[which].render(
                [contact], case.resolution, photons, seed=seed, skin=CONFORMING
            )
            return seen.radiance, time.process_time() - began

    def both(seed: int) -> list[tuple[FloatArray, float]]:
        # Each is the first of the two as often as the second.
        order = (0, 1) if seed % 2 else (1, 0)
        images = {which: image(which, seed) for which in order}
        return [images[0], images[1]]

    def forget() -> None:
        nonlocal on, off
        if case.draft:  # it would show the same image again
            on = case.model()
            with off_is():
                off = case.model()
        else:
            on.forget_light(guide=True)
            off.forget_light(guide=True)

    found = Measured()
    image(1, 0, WARM_UP_PHOTONS) if new_light else image(1, SEEDS[0])
    for seed in LIGHT_SEEDS if new_light else SEEDS:
        pictures: list[FloatArray] = []
        if new_light:
            forget()
            pair = both(seed)
            pictures = [picture for picture, _ in pair]
            if times:
                found.seconds["new_light"].append([seconds for _, seconds in pair])
        kept = 0 if case.draft else 1 if new_light else PAIRS
        for _ in range(kept if times else not new_light):
            pair = both(seed)
            pictures = pictures or [picture for picture, _ in pair]
            if times:
                found.seconds["kept_light"].append([seconds for _, seconds in pair])
        found.add(truth, pictures)
    if off is not on:
        off.forget_light(guide=True)
    return found


def measure(
    case: Case, only: Sequence[str], times: bool = True
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the results of the ablations of a case whose names contain a word, and of "nothing"."""
    truth = reference(case)
    model = case.model()
    contact = case.contact(model)
    for seed in SEEDS:
        model.render([contact], case.resolution, case.photons, seed=seed, skin=CONFORMING)
    for ablation in ablations():
        if ablation.lobes == case.lobes and any(word in ablation.name for word in only):
            yield ablation.name, compared(case, model, ablation, truth, times).row()
    yield "nothing", compared(case, model, None, truth, times).row()
    model.forget_light(guide=True)


def verdict(found: dict[str, Any], what: str) -> str:
    """Return whether an error or a time grows by more than a tenth in some case without a feature:
    "yes" or "no" if `CERTAINTY` standard errors do not change the answer, and "perhaps" otherwise.
    """
    changes = [
        (change, CERTAINTY * (scatter or 0.0))
        for case in found.values()
        if what in case["rows"]
        for change, scatter in case["rows"][what]["changes"].values()
    ]
    if any(change - scatter > SMALL for change, scatter in changes):
        return "yes"
    return "perhaps" if any(change + scatter > SMALL for change, scatter in changes) else "no"


def table(found: dict[str, Any]) -> str:
    """Return the results as Markdown."""
    lines = [
        *page_head("Ablation of the optics", "benchmarks.ablation"),
        "Each acceleration and refinement of the optics is switched off in turn. Images have "
        f"{RESOLUTION[0]}x{RESOLUTION[1]} pixels and {PHOTONS:,} photons, and a ball of radius "
        f"{RADIUS} mm is pressed in by {DEPTH} mm, unless the case says otherwise. The error is "
        "the RMS difference from progressive photon mapping with "
        f"{2 * REFERENCE_PHOTONS / 1e6:g} million photons, over squares of {BOX} pixels, relative "
        "to the mean; the noise of the reference is subtracted. The bias is the error of the mean. "
        f"*Around it* is within {RING} pixels of the contact, which *elsewhere* includes. "
        f"Images of mirroring coatings have {LOBE_PHOTONS:,} photons, and are compared with images "
        "that have all features and as many photons as the other references. "
        "Times are processor times of all threads: of an image with its pilot pass and photons "
        "(*new light*), and of a further image with the same radiance cache (*light kept*). Images "
        "with and without a feature are rendered in turn; the change of a time is the median over "
        f"{len(LIGHT_SEEDS)} or {PAIRS * len(SEEDS)} pairs (features of light or of shading). The "
        "± is the standard error: of that median, and of an error's change by the jackknife over "
        f"{len(SEEDS)} or {len(LIGHT_SEEDS)} seeds. Changes of errors below "
        f"{100 * LEAST_ERROR:g} % are relative to {100 * LEAST_ERROR:g} %. Some cases and "
        "features were measured without times, most of them on a GPU.", "",
        "## Largest effects", "",
        "Each cell is the largest increase of the error or the time without the feature among the "
        "cases, in brackets the case. The last column tells whether some increase exceeds "
        f"{100 * SMALL:g} %; *perhaps*, if that is within {CERTAINTY:g} standard errors. The row "
        "*nothing* compares two models with all features.", "",
        "| switched off | error in the contact | error around it | error elsewhere "
        f"| seconds, new light | seconds, light kept | above {100 * SMALL:g} % |",
        "|---" * 7 + "|",
    ]  # fmt: skip
    names = list(dict.fromkeys(what for case in found.values() for what in case["rows"]))
    for what in names:
        cells = []
        for key in (*ERRORS, *TIMES):
            known = [
                (*case["rows"][what]["changes"][key], name)
                for name, case in found.items()
                if key in case["rows"].get(what, {}).get("changes", {})
            ]
            change, scatter, name = max(known, key=itemgetter(0), default=(None, None, ""))
            cells.append("" if change is None else f"{_percent(change, scatter)} ({name})")
        cells.append(verdict(found, what))
        lines.append(f"| {what} | " + " | ".join(cells) + " |")
    for name, case in found.items():
        lines += ["", f"## {name}", "",
                  "| switched off | error in the contact | change | error around it | change "
                  "| error elsewhere | change | bias in the contact | bias around it "
                  "| bias elsewhere | seconds, new light | change | seconds, light kept | change |",
                  "|---" * 14 + "|"]  # fmt: skip
        for what, row in case["rows"].items():
            changes = {key: _percent(*value) for key, value in row["changes"].items()}
            cells = []
            for key in ERRORS:
                # Earlier measurements have no error around the contact.
                cells += [f"{100 * row[key]:.2f} %", changes[key]] if key in row else ["", ""]
            cells += [f"{100 * row[key]:+.2f} %" if key in row else "" for key in BIASES]
            for key in TIMES:
                seconds = row.get(f"cpu_s_{key}")
                cells += ["" if seconds is None else f"{seconds:.2f}", changes.get(key, "")]
            lines.append(f"| {what} | " + " | ".join(cells) + " |")
        lines += ["", measured_on(case["machine"])]
    return "\n".join(lines) + "\n"


def _percent(change: float, scatter: float | None) -> str:
    known = "" if scatter is None else f" ± {100 * scatter:.0f}"
    return f"{100 * change:+.0f}{known} %"


def main() -> None:
    """Run the benchmark, print its results and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--case", nargs="+", default=[""], help="measure only cases with such a word in their name"
    )
    parser.add_argument(
        "--only", nargs="+", default=[""], help="switch off only what has such a word in its name"
    )
    parser.add_argument("--errors", action="store_true", help="measure no times")
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    console = Console()
    about = machine()
    say_if_busy(console, about)
    for case in CASES:
        if not any(word in case.name for word in options.case):
            continue
        for what, row in measure(case, options.only, not options.errors):
            # Read anew: cases may be measured by processes of their own.
            found = stored("ablation")
            known = found.setdefault(case.name, {"machine": about, "rows": {}})
            known["machine"] = about
            known["rows"][what] = row
            console.print(f"{case.name}: {what} " + json.dumps(row), highlight=False)
            if not options.dry:
                store("ablation", found, table(found))


if __name__ == "__main__":
    main()
