"""Malformed requests to a real engine, each of which must be answered in words and in time."""

from __future__ import annotations

import json
import os
import resource
import selectors
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml
from hypothesis import strategies as st

from optisense.engine import requests

from .cases import Case
from .kinds import ASSETS, DESIGN, RefusedError, kind
from .strategies import from_schema, spoilt, spoilt_bytes

ANSWER_TIME = 60.0
"""Longest time (s) of an answer on an idle machine; the slowest request compiles kernels."""


def busy() -> float:
    """How many times longer a thing takes than where nothing else runs, by the machine's load."""
    return 1.0 + os.getloadavg()[0] / (os.cpu_count() or 1)


LEFT_OUT = ("search", "resume", "watch")
"""Requests that begin processes of their own; their fields are those of other requests."""

HERE = "@HERE"
"""Stands for the engine's folder in requests; the design and the study of the assets are in it."""

WRITTEN = {"to": "out", "file": f"{HERE}/out.html", "folder": HERE}
"""Fields that name what a request writes, and what stands there instead of other absolute paths."""

DATA = {"data": yaml.safe_load(DESIGN["design.yaml"]), "folder": "design"}
SMALL = {"design": DATA, "resolution": [16, 12], "photons": 20000}

USUAL: dict[str, dict[str, Any]] = {
    "open": {"design": DATA},
    "check": {"design": DATA},
    "simulate": {**SMALL, "contacts": ["sphere:1@0,0:0.3", {"indenter": {"kind": "plane"}}]},
    "chief_rays": {"design": DATA, "resolution": [4, 3]},
    "place": {"design": DATA, "contacts": ["sphere:1@0,0:0.3"]},
    "nine_places": {"design": DATA, "indenter": {"kind": "sphere", "radius": 1.0}},
    "relight": {"image": "1", "lights": {"red": {"flux": 1.0, "colour": [1, 0, 0]}}},
    "report": {"image": "1", "file": f"{HERE}/out.html"},
    "save": {"design": DATA, "to": "saved"},
    "export": {"design": DATA, "to": "exported", "formats": ["stl"]},
    "export_robot": {"design": DATA, "to": "exported", "formats": ["urdf"], "mass": 20.0},
    "mesh": {"file": "design/meshes/gel.obj", "role": "elastomer", "scale": 1.0},
    "cage": {"design": DATA, "action": "add", "cage": "c", "parts": ["gel"]},
    "cage_weights": {"design": DATA, "cage": "bend"},
    "space": {"design": DATA, "vary": ["coating.specularity=0:1"]},
    "lamp": {"value": {"kind": "area", "shape": "disc", "size": [2, 2]}},
    "preview": {"kind": "light", "value": {"kind": "area", "shape": "disc", "size": [2, 2]}},
    "entry": {"kind": "light", "entry": "smd-3528"},
    "library": {"kind": "light"},
    "library_add": {"kind": "material", "entry": "smd-3528", "description": "x",
                    "value": {"kind": "dielectric", "ior": 1.4, "roughness": 0.1}},
    "evaluate": {"design": DATA, "objectives": ["aoap"], "settings": {"ray_resolution": [16, 12]}},
    "study": {"study": f"{HERE}/study"},
    "warm": {"design": DATA},
    "hello": {"protocol": 1, "client": "fuzz", "folder": HERE},
    "cancel": {"of": 7},
}  # fmt: skip


@st.composite
def _requests(draw: st.DrawFn) -> Case:
    """A line: a usual request with values changed, or made anew by its schema."""
    do = draw(st.sampled_from(sorted(USUAL)))
    fields = USUAL[do]
    known = [name for name in requests.names() if name not in LEFT_OUT]
    schema = requests.find(do).fields.model_json_schema() if do in known else None
    way = draw(st.integers(0, 9))
    if way == 0:
        do = draw(st.sampled_from(known))
        fields = draw(from_schema(requests.find(do).fields.model_json_schema()))
    else:
        fields = draw(spoilt(fields, schema))
    row = {"id": 1, "do": do, **(fields if isinstance(fields, dict) else {"design": fields})}
    for name, harmless in WRITTEN.items():
        if isinstance(row.get(name), str) and row[name].startswith(("/", "..", "~")):
            row[name] = harmless
    line = json.dumps({key: row[key] for key in row if isinstance(key, str)}).encode()
    if draw(st.booleans()):  # JSON has no infinity, but numbers that are read as one
        line = line.replace(b"Infinity", b"1e999").replace(b"NaN", b"1e999")
    if way == 1:
        line = draw(spoilt_bytes(line)).replace(b"\n", b" ")
    return {"request": line}


class FuzzedEngine:
    """An engine that handles one request after another, and is restarted when it has ended."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._folder = Path(tempfile.mkdtemp(prefix="optisense-fuzz-"), "here")
        self._said = b""

    def ask(self, line: bytes) -> dict[str, Any] | None:
        """The answer to a line; None to an empty one.

        Raises:
            TimeoutError: there is none in time.
            EOFError: the engine has ended.
        """
        if self._process is None:
            self._begin()
        assert self._process is not None and self._process.stdin is not None
        line = line.replace(HERE.encode(), str(self._folder).encode())
        self._process.stdin.write(line + b"\n")
        self._process.stdin.flush()
        return self._answer() if line.strip() else None

    def end(self) -> None:
        """End it."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _begin(self) -> None:
        if not self._folder.exists():
            shutil.copytree(ASSETS / "design-v1", self._folder / "design")
            shutil.copytree(ASSETS / "study-v1", self._folder / "study")
        self._said = b""
        with (self._folder.parent / "log.txt").open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "optisense.cli", "engine"], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=log, cwd=self._folder,
                env={**os.environ, "OPTISENSE_LIBRARY": str(self._folder.parent / "library")},
                preexec_fn=_unlimited,
            )  # fmt: skip
        hello = {"id": "hello", "do": "hello", "protocol": 1, "client": "fuzz"}
        self.ask(json.dumps({**hello, "folder": HERE, "variant": "llvm"}).encode())

    def _answer(self) -> dict[str, Any]:
        assert self._process is not None and self._process.stdout is not None
        limit = ANSWER_TIME * busy()
        until = time.monotonic() + limit
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while True:
                while b"\n" not in self._said:
                    if not selector.select(max(until - time.monotonic(), 0.0)):
                        self.end()
                        raise TimeoutError(f"no answer in {limit:.0f} s")
                    read = os.read(self._process.stdout.fileno(), 1 << 20)
                    if not read:
                        code = self._process.wait()
                        self.end()
                        raise EOFError(f"the engine has ended with {code}")
                    self._said += read
                line, _, self._said = self._said.partition(b"\n")
                message: dict[str, Any] = json.loads(line)
                if "ok" in message:
                    return message


def _unlimited() -> None:
    """Lift the limit of the processor's time for one case, which an engine would inherit."""
    resource.setrlimit(resource.RLIMIT_CPU, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


ENGINE = FuzzedEngine()


@kind("engine", _requests(), 3.0)
def ask_engine(folder: Path) -> None:
    """Ask the engine; a refusal must not be called a defect of OptiSense."""
    answer = ENGINE.ask((folder / "request").read_bytes())
    if answer is not None and not answer["ok"]:
        error = answer["error"]
        assert error["kind"] != "InternalError", error["message"]
        raise RefusedError(error["message"])
