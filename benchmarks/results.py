"""Results as JSON files, and as tables in Markdown and on the terminal."""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from optisense.version import version_of

FOLDER = Path(__file__).parent
JSON = FOLDER / "results.json"
MARKDOWN = FOLDER / "results.md"
BUSY = 0.4
"""Load average at the start above which timings are marked as those of a busy machine."""

TARGETS = {
    "image_320x240": "1.0 s or less at 3 % error or less",
    "image_640x480": "2.5 s or less",
    "new_process": "5 s or less, under 2 GB",
    "other_contact_new_light": "1.1 times the first or less",
}
NAMES = {
    "image_320x240": "Image 320x240, warm, new photons",
    "image_320x240_many": "The same with 5 million photons",
    "image_640x480": "Image 640x480, warm, new photons",
    "model_set_up": "Model set-up (scene, photon guide)",
    "other_contact_new_light": "Other contact, new photons",
    "other_contact_kept_light": "Other contact, radiance cache kept",
    "after_flux_change": "After a change of flux",
    "after_first_specularity": "After the first specularity above 0",
    "after_specularity_change": "After a change of specularity",
    "new_process": "New process, command to files",
}


def measure_parts(
    name: str,
    about: str | None,
    measures: Mapping[str, Callable[[], Mapping[str, Any]]],
    table: Callable[[dict[str, Any]], str],
) -> None:
    """Run the command line of a benchmark of several parts: measure, print and write NAME.json, and
    NAME.md by ``table``.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--only", choices=measures, help="measure one part only")
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    console = Console()
    here = machine()
    say_if_busy(console, here)
    for part in (options.only,) if options.only else measures:
        console.print(f"[dim]{part}")
        row = {"machine": here, **measures[part]()}
        console.print_json(json.dumps(row))
        # Read now, since another process may have measured another part meanwhile.
        found = stored(name) | {part: row}
        if not options.dry:
            store(name, found, table(found))


def stored(name: str) -> dict[str, Any]:
    """Return the results in NAME.json; empty if there are none."""
    path = FOLDER / f"{name}.json"
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else {}


def store(name: str, found: dict[str, Any], page: str) -> None:
    """Write results to NAME.json and their page to NAME.md."""
    text = json.dumps(found, indent=1) + "\n"
    (FOLDER / f"{name}.json").write_text(text, encoding="utf-8")
    (FOLDER / f"{name}.md").write_text(page, encoding="utf-8")


def page_head(title: str, command: str) -> list[str]:
    """Return the first lines of a page that ``python -m COMMAND`` writes."""
    about = f"The command `python -m {command}` writes this page; do not edit it."
    return [f"# {title}", "", about, ""]


def measured_on(about: Mapping[str, Any]) -> str:
    """Return the date and the machine of a measurement in words."""
    return f"{about['date']}, {about['processor']}, {about['cores']} cores{busy_note(about)}"


def busy_note(about: Mapping[str, Any]) -> str:
    """Return words that a machine, as of `machine`, was busy; none if it was not."""
    return f"; the machine was busy (load {about['load_at_start']})" if about["busy"] else ""


def say_if_busy(console: Console, about: Mapping[str, Any]) -> None:
    """Warn where the machine, as of `machine`, has other work."""
    if about["busy"]:
        console.print(f"[yellow]The load is {about['load_at_start']}: timings will be noisy.")


def machine() -> dict[str, Any]:
    """Return processor, system, versions and load, without names of hosts or people."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [x.split(":", 1)[1] for x in info.read_text().splitlines() if "model name" in x]
        model = names[0].strip() if names else model
    packages = ("mitsuba", "drjit", "numpy", "pyluxcore")
    versions = {name: version_of(name, "not installed") for name in packages}
    load = os.getloadavg()[0]
    return {
        "date": datetime.date.today().isoformat(),
        "processor": model,
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": versions,
        "load_at_start": round(load, 2),
        "busy": load > BUSY,
    }


def merged(part: str, values: dict[str, Any], about: dict[str, Any]) -> dict[str, Any]:
    """Return the results so far with one part replaced, and the machine of that part."""
    kept = json.loads(JSON.read_text()) if JSON.is_file() else {}
    kept[part] = {"machine": about, **values}
    return kept


def write(results: dict[str, Any]) -> None:
    """Write results.json and results.md."""
    for path, text in (
        (JSON, json.dumps(results, indent=2) + "\n"),
        (MARKDOWN, _markdown(results)),
    ):
        temporary = path.with_name(f".{path.name}")
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)


def show(results: dict[str, Any], console: Console) -> None:
    """Print the tables."""
    for title, heads, rows in _tables(results):
        table = Table(*heads, title=title)
        for row in rows:
            table.add_row(*row)
        console.print(table)


_TableData = tuple[str, Sequence[str], list[list[str]]]


def _tables(results: dict[str, Any]) -> list[_TableData]:
    out: list[_TableData] = []
    if "speed" in results:
        out += [_speed_table(results["speed"]), _breakdown_table(results["speed"])]
    if "renderers" in results:
        out.append(_renderer_table(results["renderers"]))
    return out


def _speed_table(speed: dict[str, Any]) -> _TableData:
    rows = []
    for key, name in NAMES.items():
        values = speed.get(key)
        if not values:
            continue
        more = []
        if "relative_rms_error" in values:
            more.append(f"error in the contact {100 * values['relative_rms_error']:.2f} %")
        if "ratio_to_first" in values:
            more.append(f"{values['ratio_to_first']:.2f} times the first image")
        if "peak_memory_gb" in values:
            more.append(f"peak memory {values['peak_memory_gb']:.2f} GB")
        time, cpu = f"{values['wall_s']:.2f}", f"{values['cpu_s']:.2f}"
        rows.append([name, time, cpu, ", ".join(more), TARGETS.get(key, "")])
    return "Speed", ["measurement", "seconds", "CPU seconds", "further results", "target"], rows


def _breakdown_table(speed: dict[str, Any]) -> _TableData:
    image, rays = speed["image_320x240"], speed["rays"]
    parts = image["breakdown_s"]
    rows = [[f"{name} (s)", f"{parts[name]:.3f}"] for name in parts]
    rows += [
        ["photons of an image", f"{image['photons']:,}"],
        ["photons per second, radiance cache included", f"{image['photons_per_s_with_field']:,}"],
        ["photons per second, tracing only", f"{rays['photons_per_s']:,}"],
        ["rays per photon", f"{rays['rays_per_photon']:.2f}"],
        ["rays per second in the photon pass", f"{rays['rays_per_s']:,}"],
        ["rays per second, ray tracer only", f"{rays['pure_rays_per_s']:,}"],
        ["share of the ray tracer's rate", f"{100 * rays['share_of_pure_rate']:.0f} %"],
    ]
    return "Times of the steps, 320x240", ["step", "value"], rows


def _renderer_table(comparison: dict[str, Any]) -> _TableData:
    rows = []
    for row in comparison["rows"]:
        if "failed" in row:
            rows.append([row["renderer"], "failed: " + row["failed"][:60], "", "", "", ""])
            continue
        last = row["steps"][-1]
        rows.append(
            [
                row["renderer"],
                f"{last['wall_s']:.0f}",
                f"{100 * last['relative_rms_error']:.1f} %",
                f"{last['scale_to_reference']:.3f}",
                f"{row['seconds_to_target']:,.0f}" + (" *" if row["extrapolated"] else ""),
                f"{row['time_ratio']:,.0f}",
            ]
        )
    error, ours = comparison["target_error"], comparison["our_seconds"]
    title = f"Times to the error of OptiSense's warm image ({100 * error:.2f} %, {ours:.2f} s)"
    heads = [
        "renderer",
        "seconds rendered",
        "error",
        "scale",
        "seconds to this error",
        "relative to OptiSense",
    ]
    return title, heads, rows


def _markdown(results: dict[str, Any]) -> str:
    lines = [
        *page_head("Speed and accuracy", "benchmarks"),
    ]
    for part in ("reference", "speed", "renderers"):
        if part in results:
            lines += [f"- {part}: {_about(results[part]['machine'])}"]
    if "reference" in results:
        ref = results["reference"]
        lines += [
            "",
            f"The reference has {ref['photons']:,} photons of {ref['seeds']} seeds and a noise of "
            f"{100 * ref['noise']:.2f} % inside the contact, which is subtracted in quadrature. It "
            f"took {ref['seconds']:.0f} s.",
        ]
    for title, heads, rows in _tables(results):
        lines += ["", f"## {title}", "", "| " + " | ".join(heads) + " |"]
        lines += ["|" + "---|" * len(heads)]
        lines += ["| " + " | ".join(row) + " |" for row in rows]
    if "renderers" in results:
        lines += [
            "",
            "\\* This time is extrapolated from the last image, under the assumption that the "
            "error falls as 1/sqrt(time). The scale is the factor by which the renderer's image is "
            "multiplied so that its mean inside the contact equals that of the reference.",
        ]
    return "\n".join(lines) + "\n"


def _about(machine: dict[str, Any]) -> str:
    versions = ", ".join(f"{name} {value}" for name, value in machine["versions"].items())
    return (
        f"{machine['date']}, {machine['processor']}, {machine['cores']} cores, "
        f"{machine['system']}, Python {machine['python']}, {versions}{busy_note(machine)}"
    )
