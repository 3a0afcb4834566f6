"""``python -m benchmarks [--only reference|speed|renderers]``."""

from __future__ import annotations

import argparse
import json

from rich.console import Console

from benchmarks import results
from benchmarks.reference import PHOTONS, SEEDS, make_reference
from benchmarks.renderers import BUDGET, compare_renderers
from benchmarks.speed import measure_speed, warm_images

PARTS = ("reference", "speed", "renderers")


def main() -> None:
    """Measure, print tables, and write results.json and results.md after each part."""
    from benchmarks.case import Case

    options = _options()
    console = Console()
    about = results.machine()
    results.say_if_busy(console, about)

    def tell(text: str) -> None:
        console.print(f"[dim]{text}")

    case = Case.load(options.variant)
    about["variant"] = case.model.variant
    reference = make_reference(case, options.seeds, round(options.photons * 1e6), tell)
    parts = {
        "photons": reference.photons,
        "seeds": reference.seeds,
        "noise": round(reference.noise, 5),
        "seconds": round(reference.seconds, 1),
        "pixels": int(case.mask.sum()),
    }
    measured = results.merged("reference", parts, about)
    wanted = PARTS if options.only is None else (options.only,)
    if not options.dry:
        results.write(measured)
    if "speed" in wanted:
        measured["speed"] = {"machine": about, **measure_speed(case, reference, tell)}
        if not options.dry:
            results.write(measured)
    if "renderers" in wanted:
        tell("our own warm image")
        image = warm_images(case, reference)
        compared = compare_renderers(
            case,
            reference,
            image["relative_rms_error"],
            image["wall_s"],
            options.budget,
            tell,
        )
        measured["renderers"] = {"machine": about, **compared}
        if not options.dry:
            results.write(measured)
    results.show(measured, console)
    if options.dry:
        console.print_json(json.dumps(measured))
    else:
        console.print(f"Written: {results.JSON} and {results.MARKDOWN}")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--only", choices=PARTS, help="measure one part only")
    parser.add_argument(
        "--photons", type=float, default=PHOTONS / 1e6, help="millions a seed of the reference"
    )
    parser.add_argument("--seeds", type=int, default=SEEDS, help="of the reference, 2 or more")
    parser.add_argument("--budget", type=float, default=BUDGET, help="seconds a renderer")
    parser.add_argument("--variant", choices=("auto", "llvm", "cuda"), default="auto")
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    if options.seeds < 2:
        parser.error("--seeds must be 2 or more: the scatter over seeds gives the noise")
    return options


if __name__ == "__main__":
    main()
