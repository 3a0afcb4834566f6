"""Time that a user of the studio waits: first picture, drafts, relighting, cages.

    .venv-blender/bin/python benchmarks/studio.py [--drafts 20]

Everything goes through the extension, as by hand, with Blender as a Python module; only drawing the
window is left out. Wall time is what a user waits; processor time is that of Blender and the engine
together, which another load on the machine changes less. The last column is the rate on a machine
whose ray tracer alone traces `SLOW` rays a second, if all work there takes longer by this ratio.
"""

from __future__ import annotations

import argparse
import atexit
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np

ROOT = Path(__file__).parents[1]
SLOW = 11e6
"""Rays per second of the ray tracer alone on the slow machine for which the targets hold."""

SIDE = 101
"""Number of vertices along a side of the mesh in a cage, which has 10,201, as a finely tessellated
part."""

RATE = SLOW
"""Rays per second of the ray tracer alone on this machine, which is measured when the benchmark
begins."""


def processor_seconds(pid: int) -> float:
    """Return the processor time (s) of this process and the engine; NaN where it is unknown."""
    stat = Path(f"/proc/{pid}/stat")
    if not stat.exists():
        return float("nan")
    user, system = stat.read_text().rsplit(")", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK") + time.process_time()


def rays_per_second() -> float:
    """Return the rays per second of the ray tracer alone."""
    command = [str(ROOT / ".venv" / "bin" / "python"), "-m", "benchmarks.rays"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


def measured(what: str, times: int, target: str, work: Callable[[int], None], pid: int) -> None:
    """Do something several times and print a row of the table."""
    used, began = processor_seconds(pid), time.perf_counter()
    for step in range(times):
        work(step)
    wall = (time.perf_counter() - began) / times
    used = (processor_seconds(pid) - used) / times
    rate, slow = (f"{each / wall:6.1f} /s" for each in (1.0, SLOW / max(RATE, SLOW)))
    print(
        f"{what:44s} {wall:7.3f} s {used:7.3f} s {rate:>10s}   {target:5s} {slow:>10s}", flush=True
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--drafts", type=int, default=20)
    given = parser.parse_args()
    sys.path.insert(0, str(ROOT))
    os.environ.setdefault(
        "OPTISENSE_ENGINE",
        shlex.join([str(ROOT / ".venv" / "bin" / "python"), "-m", "optisense.cli", "engine"]),
    )
    import studio
    from studio.engine import session
    from studio.scene import cages
    from studio.scene.collections import objects_of
    from studio.sensor import opening
    from studio.sensor.warming import warm_up
    from studio.simulate import drafts, relight, stored_drafts

    studio.register()
    atexit.register(studio.unregister)
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    pid = session.engine().pid

    def answered(request: Any) -> None:
        """Read the engine's answers, as Blender's timer does in a window."""
        while True:
            pause = session._tick() or 0.0
            if request is not None and request.done:
                return
            time.sleep(pause)

    global RATE
    RATE = rays_per_second()
    print(f"the ray tracer alone: {RATE / 1e6:.1f} million rays a second")
    slow = f"at {SLOW / 1e6:.0f} M/s"
    print(f"{'':44s} {'wall':>9s} {'processor':>9s} {'':10s}   target {slow:>10s}")
    opened = "Mini opened and the engine warm"
    bpy.ops.optisense.new(sensor="gelsight-mini-ideal")
    measured(opened, 1, "", lambda _: answered(warm_up(scene)), pid)
    bpy.ops.optisense.add_contact()
    measured("click to first picture", 1, "3 s", lambda _: bpy.ops.optisense.simulate(), pid)

    def relit(step: int) -> None:
        scene.optisense.light_groups[0].flux = 1.0 + 0.1 * (step % 10)
        answered(relight._open)

    relit(0)
    measured("relighting, 320 x 240", 60, "30 /s", relit, pid)
    scene.optisense_simulation.draft = True
    shown = 0
    take = drafts._take

    def taken(result: Any) -> None:
        nonlocal shown
        shown += 1
        take(result)

    drafts._take = taken

    def dragged(what: str, move: Callable[[int], None], target: str) -> None:
        """Move the mouse and call Blender's timer until a number of drafts has arrived."""
        step = 0

        def another(_: int) -> None:
            nonlocal step
            before = shown
            while shown == before:
                step += 1
                move(step)
                bpy.context.view_layer.update()
                drafts.wanted()
                drafts._ask()
                time.sleep(session._tick() or 0.0)

        for first in range(3):
            another(first)
        measured(f"draft, {what} dragged, 160 x 120", given.drafts, target, another, pid)
        scene.optisense_simulation.draft = False  # a draft that still waits
        while session.engine().waiting:
            time.sleep(session._tick() or 0.0)
        scene.optisense_simulation.draft = True

    light, contact, skin = (objects_of(scene, kind)[0] for kind in ("LIGHT", "CONTACT", "CAGE"))

    def light_moved(_: int) -> None:
        light.location.x += 0.005

    def point_moved(_: int) -> None:
        skin.data.vertices[14].co.z += 0.002
        skin.data.update()

    def contact_moved(_: int) -> None:
        contact.location.x += 0.005

    dragged("a light", light_moved, "8 /s")
    dragged("a cage point", point_moved, "4 /s")
    dragged("a contact", contact_moved, "5 /s")
    scene.optisense_simulation.draft = False

    def first_draft(_: int) -> None:
        """Wait for the first draft of the opened sensor, as in a window."""
        drafts._opened = True
        before = shown
        while shown == before or session.engine().waiting:
            drafts._ask()
            time.sleep(session._tick() or 0.0)

    def stored_draft(_: int) -> None:
        scene = bpy.context.scene
        if not stored_drafts.show_kept(scene):
            assert stored_drafts.show_built_in(scene, opening.draft)

    place = Path(tempfile.mkdtemp())
    stored_drafts.folder = lambda: place
    sensors = ("gelsight-svelte", "digit", "gelsight-mini-ideal")
    for name in sensors:
        bpy.ops.optisense.new(sensor=name)
        measured(f"stored draft of {name}, opened", 1, "0.5 s", stored_draft, pid)
        measured(f"first draft of {name}, opened", 1, "", first_draft, pid)
    for name in sensors:
        bpy.ops.optisense.new(sensor=name)
        measured(f"stored draft of {name}, opened again", 1, "0.5 s", stored_draft, pid)
    shutil.rmtree(place)
    scene = bpy.context.scene
    cage = _caged_sheet(scene)

    def bent(step: int) -> None:
        cage.data.vertices[13].co.z = 0.1 * (step % 10)
        cage.data.update()
        bpy.context.view_layer.update()  # the handler lets the sheet follow

    bent(0)
    sheet = scene.objects["sheet"].data
    before = cages.shown_vertices(sheet).copy()
    measured("cage edit, 10,201 vertices", 100, "30 /s", bent, pid)
    assert not np.array_equal(cages.shown_vertices(sheet), before)
    session.stop()


def _caged_sheet(scene: Any) -> Any:
    """Return a cage of 27 points around a mirror of many vertices."""
    from studio.core.mesh_file import Mesh
    from studio.scene.build import add_part

    side = np.linspace(-5.0, 5.0, SIDE)
    x, y = (each.ravel() for each in np.meshgrid(side, side, indexing="ij"))
    index = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate(
        [np.stack([p.ravel() for p in three], axis=1) for three in ((a, b, c), (a, c, d))]
    )
    mesh = Mesh(np.stack([x, y, np.zeros_like(x)], axis=1), faces.astype(np.int32))
    sheet = add_part(scene, "sheet", {"role": "mirror", "mesh": "meshes/sheet.obj"}, mesh)
    for each in scene.objects:
        each.select_set(False)
    sheet.select_set(True)
    bpy.context.view_layer.objects.active = sheet
    bpy.ops.optisense.new_cage(resolution=(3, 3, 3))
    return bpy.context.active_object


if __name__ == "__main__":
    main()
