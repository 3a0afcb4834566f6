"""The case in LuxCore, in a process of its own (``python -m benchmarks.luxcore FILE``)."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.case import FloatArray
from benchmarks.snapshots import Snapshot, due_times

THREADS = 2
"""Number of threads of LuxCore, that of the machine of the published measurements."""
DISC_CORNERS = 16
"""Number of corners of the polygon, of equal area, that replaces a round light."""
SCALE = 1000.0
"""Factor on radiances for LuxCore: some thousandths of a mW / (mm^2 sr) would be near its
thresholds."""

PATH = {
    "path.pathdepth.total": 32,
    "path.pathdepth.diffuse": 8,
    "path.pathdepth.glossy": 8,
    "path.pathdepth.specular": 32,
    "path.russianroulette.depth": 8,
    "sampler.type": "SOBOL",
}
"""Settings of LuxCore's path tracer: the largest numbers of surfaces of a path, 32 in all as for
Mitsuba, and a low-discrepancy sampler."""
ENGINES: dict[str, dict[str, Any]] = {
    "LuxCore PATHCPU": {"renderengine.type": "PATHCPU", **PATH},
    "LuxCore BIDIRVMCPU": {
        "renderengine.type": "BIDIRVMCPU",
        "sampler.type": "SOBOL",
        "path.maxdepth": 24,
        "light.maxdepth": 24,
        "bidirvm.lightpath.count": 16 * 1024,
        "bidirvm.startradius.scale": 0.02,
    },
    "LuxCore PATHCPU + PhotonGI": {
        "renderengine.type": "PATHCPU",
        **PATH,
        "path.photongi.sampler.type": "METROPOLIS",
        "path.photongi.photon.maxcount": 1_000_000,
        "path.photongi.photon.maxdepth": 16,
        "path.photongi.caustic.enabled": True,
        "path.photongi.caustic.maxsize": 300_000,
        "path.photongi.caustic.lookup.radius": 0.15,
        "path.photongi.caustic.lookup.normalangle": 25.0,
        "path.photongi.caustic.updatespp": 4,
        "path.photongi.indirect.enabled": False,
    },
}
"""Settings of LuxCore's engines, by their names in the table. Paths have up to 24 surfaces with
bidirectional tracing; PhotonGI gathers its caustics within 0.15 mm, two to three pixels, since
nearly all light passes through the gel.
"""


def render_luxcore(scene: dict[str, Any], engine: str, budget: float) -> list[Snapshot]:
    """Return images of a `plain_scene` after the whole budget (s) and after halves of it.

    LuxCore's photon caches count, its scene set-up does not.

    Raises:
        RuntimeError: LuxCore is not installed, or failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "job.pickle"
        path.write_bytes(pickle.dumps({**scene, "engine": engine, "budget": budget}))
        done = subprocess.run(
            [sys.executable, "-m", "benchmarks.luxcore", str(path)],
            capture_output=True,
            text=True,
            timeout=4 * budget + 240,
            cwd=Path(__file__).parent.parent,
        )
        result = path.with_suffix(".npz")
        if done.returncode != 0 or not result.is_file():
            raise RuntimeError(f"{engine} failed: {(done.stderr or done.stdout)[-800:]}")
        with np.load(result) as kept:
            return [
                Snapshot(float(s), float(c), image, float(n))
                for s, c, image, n in zip(
                    kept["seconds"], kept["cpu"], kept["images"], kept["samples"], strict=True
                )
            ]


def plain_scene(pieces: Any, emitters: Any, camera: Any, flux: Any) -> dict[str, Any]:
    """Return pieces, lights and camera as plain arrays and numbers, for another process."""
    meshes = []
    for piece in pieces:
        kind = piece.surface.kind.name
        if kind == "LIGHT":
            continue
        material: dict[str, Any]
        if kind == "OPAQUE":
            material = {"type": "matte", "kd": list(piece.surface.reflectance)}
        elif kind == "DIELECTRIC":
            # Only the ratio of the indices counts.
            material = {
                "type": "glass",
                "kr": [1.0] * 3,
                "kt": [1.0] * 3,
                "interiorior": float(piece.surface.eta),
                "exteriorior": 1.0,
            }
        else:
            material = {"type": "matte", "kd": [0.0] * 3}
        meshes.append(
            (np.asarray(piece.vertices), np.asarray(piece.faces), piece.normals, material)
        )
    turn = np.arange(DISC_CORNERS) * 2 * np.pi / DISC_CORNERS
    # A polygon of the disc's area.
    reach = np.sqrt(2 * np.pi / (DISC_CORNERS * np.sin(2 * np.pi / DISC_CORNERS)))
    for emitter in emitters:
        s, t, _ = emitter.frame
        half = np.array(emitter.size) / 2
        outline = np.stack([np.cos(turn), np.sin(turn)], axis=1) * half * reach
        points = np.asarray(emitter.position) + outline[:, :1] * s + outline[:, 1:] * t
        faces = np.array([[0, k, k + 1] for k in range(1, DISC_CORNERS - 1)])
        radiance = np.asarray(flux[emitter.group], float) / (np.pi**2 * half[0] * half[1])
        material = {"type": "matte", "kd": [0.0] * 3, "emission": (SCALE * radiance).tolist()}
        meshes.append((points, faces, None, material))
    return {"meshes": meshes, "camera": camera.__dict__}


def _properties(values: dict[str, Any]) -> Any:
    import pyluxcore

    out = pyluxcore.Properties()
    for name, value in values.items():
        out.Set(pyluxcore.Property(name, value if isinstance(value, list) else [value]))
    return out


def _scene(job: dict[str, Any]) -> Any:
    import pyluxcore

    scene = pyluxcore.Scene()
    camera = job["camera"]
    position = np.asarray(camera["position"], float)
    target = position + 10 * np.asarray(camera["direction"], float)
    share = camera["height"] / camera["width"]
    scene.Parse(
        _properties(
            {
                "scene.camera.type": "perspective",
                "scene.camera.lookat.orig": position.tolist(),
                "scene.camera.lookat.target": target.tolist(),
                "scene.camera.up": [float(v) for v in camera["up"]],
                "scene.camera.fieldofview": float(camera["fov"]),
                "scene.camera.screenwindow": [-1.0, 1.0, -share, share],
                "scene.camera.cliphither": 1e-3,
                "scene.camera.clipyon": 1e4,
            }
        )
    )
    for number, (vertices, faces, normals, material) in enumerate(job["meshes"]):
        points = [tuple(map(float, p)) for p in vertices]
        triangles = [tuple(map(int, f)) for f in faces]
        corners = None if normals is None else [tuple(map(float, n)) for n in normals]
        scene.DefineMesh(f"mesh{number}", points, triangles, corners, None, None, None)
        scene.Parse(_properties({f"scene.materials.m{number}.{k}": v for k, v in material.items()}))
        scene.Parse(
            _properties(
                {
                    f"scene.objects.o{number}.shape": f"mesh{number}",
                    f"scene.objects.o{number}.material": f"m{number}",
                }
            )
        )
    return scene


def _film(session: Any, width: int, height: int) -> FloatArray:
    import pyluxcore

    values = np.zeros(width * height * 3, dtype=np.float32)
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, values, 0, False)
    # LuxCore's first row is the bottom one.
    return np.ascontiguousarray(values.reshape(height, width, 3)[::-1]) / np.float32(SCALE)


def main(path: Path) -> None:
    """Render a job file and write its snapshots beside it."""
    import pyluxcore

    job = pickle.loads(path.read_bytes())
    pyluxcore.Init()
    pyluxcore.SetLogHandler(lambda text: None)
    width, height = job["camera"]["width"], job["camera"]["height"]
    config = {
        "film.width": width,
        "film.height": height,
        "film.filter.type": "NONE",
        "film.outputs.0.type": "RGB",
        "film.outputs.0.filename": "unused.exr",
        "native.threads.count": THREADS,
        **ENGINES[job["engine"]],
    }
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(_properties(config), _scene(job)))
    due, out = due_times(job["budget"]), []
    began, cpu = time.perf_counter(), time.process_time()
    session.Start()
    while due:
        time.sleep(max(0.0, due[0] - (time.perf_counter() - began)))
        session.UpdateStats()
        stats = session.GetStats()
        elapsed, spent = time.perf_counter() - began, time.process_time() - cpu
        image = _film(session, width, height)
        out.append(Snapshot(elapsed, spent, image, stats.Get("stats.renderengine.pass").GetFloat()))
        due = [at for at in due if at > elapsed]
    session.Stop()
    np.savez(
        path.with_suffix(".npz"),
        seconds=[s.seconds for s in out],
        cpu=[s.cpu for s in out],
        images=np.stack([s.image for s in out]),
        samples=[s.samples for s in out],
    )
    sys.stdout.flush()
    os._exit(0)  # LuxCore's threads sometimes outlive a session


if __name__ == "__main__":
    main(Path(sys.argv[1]))
