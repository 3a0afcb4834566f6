"""Time of a picture with the elastic skin, compared with the conforming skin.

``python -m benchmarks.skins [DESIGN]`` prints a table. Pictures of the two skins alternate, and the
depth of the contacts changes from picture to picture, so that no deformation is reused. Kernels are
compiled before. Processor time is that of all threads.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import optisense as ots
from benchmarks.case import PHOTONS, RESOLUTION
from benchmarks.timing import Time, medians, timed
from optisense.geometry import Contact
from optisense.geometry.contact_text import parse_contact
from optisense.mechanics import CONFORMING, ELASTIC, SKINS

RUNS = 5
"""Number of timed pictures of each skin, whose median is reported."""
SHALLOWER = 0.01
"""Share of the depth by which the contacts of the next picture are shallower, so that no
deformation is reused."""
MORE = ("sphere:0.5@1,1:0.3", "object:screw-thread@0,0:0.5", "object:coin@0,0:0.4")
"""Contacts beside the balls of radius 1.5 mm at the nine places."""


def cases(model: ots.OpticalModel) -> dict[str, list[Contact]]:
    """Return lists of contacts, by their names in the table."""
    nine = model.nine_contacts()
    return {
        "ball in the middle": [nine[4]],
        "ball in a corner": [nine[0]],
        **{text: [parse_contact(text)] for text in MORE},
        "nine balls": nine,
    }


def times(model: ots.OpticalModel, contacts: list[Contact], kept: bool) -> dict[str, Time]:
    """Return the median time of a picture of each skin, with ``kept`` photons or new ones."""
    found: dict[str, list[Time]] = {skin: [] for skin in SKINS}
    seed = 0
    for run in range(-1, RUNS):  # the first compiles kernels and does not count
        pressed = [
            replace(each, depth=each.depth * (1.0 - SHALLOWER * (run + 1))) for each in contacts
        ]
        for skin, those in found.items():
            seed += 0 if kept else 1
            taken = timed(
                lambda skin=skin, seed=seed, pressed=pressed: model.render(
                    pressed, RESOLUTION, photons=PHOTONS, seed=seed, skin=skin
                )
            )
            if run >= 0:
                those.append(taken)
    return {skin: medians(those) for skin, those in found.items()}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("design", nargs="?", default="gelsight-mini-ideal")
    model = ots.OpticalModel(ots.load(parser.parse_args().design))
    print("| contacts | photons | elastic (CPU s) | conforming (CPU s) | ratio | ratio of wall |")
    print("|---|---|---|---|---|---|")
    for name, contacts in cases(model).items():
        for kept in (False, True):
            found = times(model, contacts, kept)
            elastic, conforming = found[ELASTIC], found[CONFORMING]
            print(
                f"| {name} | {'kept' if kept else 'new'} | {elastic.cpu:.2f} | "
                f"{conforming.cpu:.2f} | {elastic.cpu / conforming.cpu:.2f} | "
                f"{elastic.wall / conforming.wall:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
