"""The card of a dataset: its description as README.md, for people and for dataset hubs."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

from optisense.errors import TaskError
from optisense.tasks._splits import SPLITS
from optisense.tasks.dataset import Dataset
from optisense.tasks.parquet import FOLDER, parquet_files
from optisense.text import markdown
from optisense.untrusted_files import MOST_TEXT, read_bytes
from optisense.writing import write_text

CARD = "README.md"

OURS = "<!-- Written by optisense dataset. Without this line the file is left as it is. -->"

LICENCE = re.compile(r"[A-Za-z0-9][A-Za-z0-9.+-]{0,63}")

SIZES = (("n<1K", 1_000), ("1K<n<10K", 10_000), ("10K<n<100K", 100_000), ("100K<n<1M", 1_000_000))
"""Size categories of dataset hubs, each with the number of samples below which it applies."""


def check_licence(licence: str | None) -> None:
    """Raise TaskError if a licence is not an identifier such as cc-by-4.0."""
    if licence is not None and not LICENCE.fullmatch(licence):
        raise TaskError(
            f"'{licence}' is no identifier of a licence",
            hint="Write it as SPDX does, such as cc-by-4.0, cc0-1.0 or mit",
        )


def write_card(dataset: Dataset, licence: str | None = None) -> Path | None:
    """Write the card into the dataset's folder.

    It names the splits of the Parquet files in the folder. After `generate` has added samples,
    `write_parquet` comes first, as files of fewer samples would be loaded as the whole dataset.

    Args:
        licence: an identifier such as cc-by-4.0. With None the licence of an existing card is kept,
            or the card states that none was chosen.

    Returns:
        The file; None if a README.md that is not a card exists, which is not overwritten.

    Raises:
        TaskError: the licence is not an identifier.
        OutputError: the card cannot be written.
    """
    check_licence(licence)
    path = dataset.folder / CARD
    if path.exists():
        before = read_bytes(path, MOST_TEXT, TaskError, "the card").decode("utf-8", "replace")
        if OURS not in before:
            return None
        known = re.search(rf"^license: ({LICENCE.pattern})$", before, re.MULTILINE)
        if licence is None and known is not None and known[1] != "unknown":
            licence = known[1]
    write_text(path, card_text(dataset, licence))
    return path


def card_text(dataset: Dataset, licence: str | None = None) -> str:
    """Return the card as Markdown, with a YAML header for dataset hubs."""
    info, settings = dataset.info, dataset.info["settings"]
    contacts = settings["contacts"]
    counts = Counter(row["split"] for row in dataset.labels)
    splits = [name for name in SPLITS if counts[name]]
    size = next((word for word, below in SIZES if len(dataset) < below), "n>1M")
    head = ["---", f"license: {licence or 'unknown'}", "tags:", "- tactile", "- synthetic"]
    head += ["size_categories:", f"- {size}"]
    of_files = {file.name.partition("-")[0] for file in parquet_files(dataset.folder)}
    if of_files:
        head += ["configs:", "- config_name: default", "  data_files:"]
        for name in sorted(of_files, key=SPLITS.index):
            head += [f"  - split: {name}", f"    path: {FOLDER}/{name}-*.parquet"]
    width, height = settings["resolution"]
    versions = ", ".join(
        f"{markdown(str(name))} {markdown(str(text))}" for name, text in info["made_with"].items()
    )
    indenters = ", ".join(markdown(str(text)) for text in contacts["indenters"])
    fitted = (info.get("camera") or {}).get("fitted")
    rows = [
        ("sensor", markdown(info["design_name"])),
        ("samples", f"{len(dataset):,}, and {len(dataset.failures):,} that could not be made"),
        ("splits", ", ".join(f"{name} {counts[name]:,}" for name in splits) or "none"),
        ("held out", ", ".join(map(markdown, settings.get("hold_out") or [])) or "no indenter"),
        ("pictures", f"{width} x {height} pixels, exposure {info['exposure']:.6g}"),
        ("indenters", indenters),
        ("depth", f"{contacts['depth'][0]:g} to {contacts['depth'][1]:g} mm"),
        ("rotation", f"{contacts['rotation'][0]:g} to {contacts['rotation'][1]:g} degrees"),
        ("tilt", f"{contacts['tilt']:g} degrees at most"),
        ("skin", markdown(str(settings.get("skin", "conforming")))),
        ("light", f"{settings['photons']:,} photons, {markdown(settings['estimator'])}"),
        ("noise of the camera", f"{settings['camera_noise']:g} of 255 levels, added"),
        ("seed", str(settings["seed"])),
        ("made with", versions),
        ("licence", licence or "not chosen: say under which one others may use it"),
    ]
    if fitted is not None:
        error = fitted["error"]
        rows.append(("pinhole in dataset.json", f"{error['rms_mm']:.3g} mm off (root mean square)"))
    table = "\n".join(f"| {name} | {text} |" for name, text in rows)
    return "\n".join([*head, "---", "", OURS, ""]) + (
        f"# Simulated touches of {markdown(info['design_name'])}\n\n"
        "Pictures of a camera-based tactile sensor into which things are pressed, with the ground "
        "truth of each: depth, normals, points, contact mask, forces and labels. All of it is "
        "simulated: light by photon mapping, the skin as an elastic layer where it says so.\n\n"
        f"| | |\n|---|---|\n{table}\n\n"
        "Lengths are in mm, angles in degrees, forces in N, pressures in MPa, in the frame of the "
        "design in `design/`. `camera.npz` has the ray of each pixel inside the gel.\n\n"
        "Not in it: slip, shear by tangential forces, wear, dust, and what makes one unit of a "
        "sensor differ from another.\n"
    )
