"""Pictures with little noise for the comparison by patches, made on a GPU.

``python -m benchmarks.fine_references [--minutes 10] [--variant cuda]`` fills benchmarks/.cache
with pictures of 4 (`path`) or 16 times (light tracing) the usual effort, in rounds over all cases,
until the time is over.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console

from benchmarks.patch_references import FINE, MOST_FINE, save_picture
from benchmarks.patches import CASES, PatchCase
from optisense import OpticalModel


def render_missing(case: PatchCase, variant: str) -> Iterator[Path]:
    """Render the pictures of a case that are not in the cache, and yield the file of each."""
    region = case.reference(OpticalModel(case.design(), variant=variant))
    render = None
    for batch, path in enumerate(region.paths(FINE, MOST_FINE)):
        if not path.is_file():
            render = render or region.renderer(FINE)
            save_picture(path, render(batch))
            yield path


def main() -> None:
    """Render one picture of each case after another until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="time after which to end")
    parser.add_argument("--variant", choices=("auto", "llvm", "cuda"), default="auto")
    options = parser.parse_args()
    console = Console()
    began = time.monotonic()
    works = {case.name: render_missing(case, options.variant) for case in CASES}
    while works:
        for name, work in list(works.items()):
            start = time.monotonic()
            if start - began > 60 * options.minutes:
                return
            path = next(work, None)
            if path is None:
                del works[name]
            else:
                console.print(f"{name}: {path.name}, {time.monotonic() - start:.1f} s")


if __name__ == "__main__":
    main()
