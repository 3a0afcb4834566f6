"""Make a case study of docs/case-studies.md with one command.

python 05_case_studies.py                  list the case studies
python 05_case_studies.py NAME [FOLDER]    make one, in FOLDER (its name if it is left out)

Each step is a command of OptiSense, which is printed before it runs. If the script is stopped, the
same command continues: finished steps are left out, and a search goes on with its next trial.
"""

from __future__ import annotations

import math
import shlex
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import optisense as ots
from optisense import sensors

PAD = Path(__file__).resolve().parent.parent / "docs" / "examples" / "pad-sensor" / "sensor.yaml"

DONE = "finished-steps.txt"
"""File of the steps that are finished, one a line."""


class CaseStudy(NamedTuple):
    """A case study.

    Attributes:
        about: what is searched.
        steps: commands of `optisense`, in their order, where {pad} stands for a file; "make NAME"
            calls one of `MAKERS`.
    """

    about: str
    steps: tuple[str, ...]


def ring(radius: float, count: int, first: float) -> list[list[float]]:
    """Places on a circle of the fingertip's skin, mm, `first` radians from its first axis."""
    angles = [first + 2.0 * math.pi * number / count for number in range(count)]
    return [[round(radius * f(angle), 1) for f in (math.cos, math.sin)] for angle in angles]


FINGERTIP_PLACES = [[0.0, 0.0], *ring(10.0, 5, 0.3), *ring(19.0, 6, 0.0), *ring(27.0, 8, 0.2)]
"""Twenty places on GelSight360: with the usual nine, the calibration has no press near most of
them."""

AT_PLACES = (
    "--objective reading.mean_of_places --set together=true "
    f"--set 'places={FINGERTIP_PLACES}' --set photons=500000 --no-verify"
)

COLOURINGS = f"--vary 'lights.*.colour=R,G,B' --method light-colours {AT_PLACES} --budget 200"
"""Up to 200 colourings: the search changes one group after another until no change helps."""

ROW_ACROSS, ROW_HEIGHT = 42.0, -24.0
"""Distance from the middle of GelBelt and height (z), mm, of its red and blue rows where they lie
outside of the belt, whose half width is 18 mm, and below the window."""

AIMED_BEYOND = 6.0
"""Distance from the middle line of the skin to the line at which these rows are aimed, on its far
side, mm, so that each row lights the skin more evenly."""

CASES = {
    "cylinder": CaseStudy(
        "cylindrical GelSight Mini: its rows of LEDs are raised out of the light guide",
        (
            "make tray",
            "verify gelsight-mini-ideal-cylindrical tray --quick --out proof",
        ),
    ),
    "svelte": CaseStudy(
        "GelSight Svelte: its mirror is bent for AOAP, then its LEDs are aimed",
        (
            "search gelsight-svelte --vary cages.M1.points.x=+-8 --vary cages.M1.points.y=+-1 "
            "--vary cages.M1.points.z=+-2 --objective aoap --require 'coverage>=0.56' "
            "--require 'distortion<=1.14' --method gradient --budget 60 --no-verify --out mirror",
            "apply mirror --trial best --out bent",
            "search bent --vary lights.red.aim.x=-75:75 --vary lights.green.aim.x=-75:75 "
            "--objective reading --coarse-first --budget 40 --no-verify --out lights",
            "apply lights --trial best --out better",
            "verify gelsight-svelte better --out proof",
        ),
    ),
    "pad": CaseStudy(
        "a sensor of your own, from CAD files: its LEDs, lens and coating are searched",
        (
            "new --from-meshes {pad} first-pad",
            "search first-pad --vary 'lights.*.shift.z=-1:4' --vary camera.fov=40:62.2 "
            "--vary coating.specularity=0:0.3 --objective reading.mean_of_places "
            "--require 'coverage>=0.98' --coarse-first --budget 48 --no-verify --out pad-study",
            "apply pad-study --trial best --out better-pad",
            "verify first-pad better-pad --quick --out proof",
        ),
    ),
    "gelbelt": CaseStudy(
        "GelBelt: a thicker gel, rows of LEDs below the belt, the coating and the green power",
        (
            "make matt",
            "make rows-below",
            "search rows-below "
            "--vary 'coating.reflectance=[[0.7,0.7,0.7],[0.5,0.5,0.5],[0.3,0.3,0.3]]' "
            "--vary lights.green.flux=0.7:2.1:3 --method grid --budget 9 "
            "--objective reading.mean_of_places --set depth=0.6 --set 'resolution=[320,240]' "
            "--set photons=1000000 --set together=true --no-verify --out belt",
            "apply belt --trial best --out better",
            "verify matt better --quick --out proof",
        ),
    ),
    "gelsight360": CaseStudy(
        "GelSight360: colours of its LEDs and the coating",
        (
            f"search gelsight360 {COLOURINGS} --out colours",
            "apply colours --trial best --out coloured",
            "search coloured --vary coating.specularity=0:0.8:9 --method grid --budget 9 "
            f"{AT_PLACES} --out coating",
            "apply coating --trial best --out coated",
            f"search coated {COLOURINGS} --out again",
            "apply again --trial best --out recoloured",
            "search recoloured --vary 'coating.reflectance=[[0.5,0.5,0.5],[0.3,0.3,0.3],"
            f"[0.15,0.15,0.15],[0.08,0.08,0.08]]' --method grid --budget 4 {AT_PLACES} "
            "--out darker",
            "apply darker --trial best --out better",
            "make best-of-paper",
            "verify best-of-paper better --presses 150 --places 2 --resolution 320x240 "
            "--photons 500000 --out proof",
        ),
    ),
}


def main() -> None:
    """List the case studies, or make the one that is named."""
    if len(sys.argv) < 2 or sys.argv[1] not in CASES:
        for name, case in CASES.items():
            print(f"{name:12} {case.about}")
        sys.exit(len(sys.argv) > 1)
    name = sys.argv[1]
    folder = Path(sys.argv[2] if len(sys.argv) > 2 else name)
    folder.mkdir(parents=True, exist_ok=True)
    done = folder / DONE
    finished = done.read_text(encoding="utf-8").splitlines() if done.exists() else []
    for step in CASES[name].steps:
        if step in finished:
            continue
        take(step, folder)
        with done.open("a", encoding="utf-8") as file:
            file.write(f"{step}\n")


def take(step: str, folder: Path) -> None:
    """Take one step; the script ends with the command's exit status if it fails."""
    if step.startswith("make "):
        name = step.removeprefix("make ")
        print(f"{name}: {MAKERS[name].__doc__}")
        ots.save_design(MAKERS[name](), folder / name)
        return
    words = shlex.split(step.replace("{pad}", shlex.quote(str(PAD))))
    if words[0] == "search" and (folder / words[-1]).exists():
        words = ["search", "--resume", "--no-verify", "--out", words[-1]]
    print("$ optisense", shlex.join(words), flush=True)
    process = subprocess.Popen([sys.executable, "-m", "optisense", *words], cwd=folder)
    while process.poll() is None:
        try:
            process.wait()
        except KeyboardInterrupt:
            continue  # the command has it as well, and ends with what it has finished
    if process.returncode:
        sys.exit(process.returncode)


def on_the_tray() -> ots.SensorDesign:
    """The cylindrical Mini with its LEDs 2 mm below the edge of the skin, above the tray's rim."""
    design = ots.load("gelsight-mini-ideal-cylindrical")
    for name, group in design.lights.items():
        for number, light in enumerate(group.lights):
            place = f"lights.{name}.lights[{number}].position"
            design = ots.set_value(design, place, (*light.position[:2], -2.0))
    return design.model_copy(update={"name": "lights-on-the-tray"})


def matt_belt() -> ots.SensorDesign:
    """GelBelt's light design 3 with a diffuse coating, the best of the paper's designs."""
    design = ots.set_value(ots.load("builtin:gelbelt"), "coating.specularity", 0.0)
    return design.model_copy(update={"name": "matt-belt"})


def rows_below() -> ots.SensorDesign:
    """GelBelt's light design 3, diffuse, with a gel of 4 mm, and with its red and blue rows 42 mm
    from the middle and 24 mm below the skin, aimed at points 6 mm beyond its middle line.
    """
    design = ots.set_value(sensors.gelbelt(gel_thickness=4.0), "coating.specularity", 0.0)
    for name, side in (("red", 1.0), ("blue", -1.0)):
        across, up = ROW_ACROSS + AIMED_BEYOND, -ROW_HEIGHT
        length = math.hypot(across, up)
        for number, light in enumerate(design.lights[name].lights):
            place = f"lights.{name}.lights[{number}]"
            x = light.position[0]
            position = (x, side * ROW_ACROSS, ROW_HEIGHT)
            direction = (0.0, -side * across / length, up / length)
            design = ots.set_value(design, f"{place}.position", position)
            design = ots.set_value(design, f"{place}.direction", direction)
    return design.model_copy(update={"name": "rows-below"})


def best_of_paper() -> ots.SensorDesign:
    """GelSight360 with GBBRRGGB, the best of the paper's five colourings by `reading`."""
    design = ots.load("builtin:gelsight360")
    colours = {"R": (1.0, 0.0, 0.0), "G": (0.0, 1.0, 0.0), "B": (0.0, 0.0, 1.0)}
    for number, letter in enumerate("GBBRRGGB", 1):
        design = ots.set_value(design, f"lights.lg{number}.colour", colours[letter])
    return design.model_copy(update={"name": "best-of-paper"})


MAKERS = {
    "tray": on_the_tray,
    "matt": matt_belt,
    "rows-below": rows_below,
    "best-of-paper": best_of_paper,
}
"""Designs that no search makes."""

if __name__ == "__main__":
    main()
