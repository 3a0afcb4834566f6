"""Time that a front end waits for the engine: first picture, drafts, relighting.

    python benchmarks/engine.py [--design gelsight-mini-ideal] [--drafts 10]

Wall time is what a user waits; processor time is that of the engine alone, which another load on
the machine changes less.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

PRESS = ["sphere:1.5@0,0:0.6"]


class Engine:
    """An engine that answers one request after another."""

    def __init__(self, folder: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "optisense.cli", "engine"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self.number = 0
        self.ask("hello", protocol=1, folder=folder)

    def ask(self, do: str, **fields: Any) -> dict[str, Any]:
        """Make a request, wait for its answer and return its result.

        Raises:
            SystemExit: the engine answers with an error.
        """
        assert self.process.stdin is not None and self.process.stdout is not None
        self.number += 1
        line = json.dumps({"id": self.number, "do": do, **fields}) + "\n"
        self.process.stdin.write(line.encode())
        self.process.stdin.flush()
        while "ok" not in (message := json.loads(self.process.stdout.readline())):
            pass
        if not message["ok"]:
            raise SystemExit(message["error"]["message"])
        return dict(message["result"])

    def processor_seconds(self) -> float:
        """Return the processor time (s) of the engine; NaN where the system does not report it."""
        stat = Path(f"/proc/{self.process.pid}/stat")
        if not stat.exists():
            return float("nan")
        user, system = stat.read_text().rsplit(")", 1)[1].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--design", default="gelsight-mini-ideal")
    parser.add_argument("--drafts", type=int, default=10)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        engine = Engine(folder)
        print(f"{'started':44s} {time.perf_counter() - began:7.2f} s")

        def timed(what: str, times: int, do: str, **fields: Any) -> dict[str, Any]:
            used, began = engine.processor_seconds(), time.perf_counter()
            for step in range(times):
                shown = {k: v(step) if callable(v) else v for k, v in fields.items()}
                result = engine.ask(do, **shown)
            wall = (time.perf_counter() - began) / times
            used = (engine.processor_seconds() - used) / times
            print(f"{what:44s} {wall:7.3f} s wall {used:7.3f} s processor", flush=True)
            return result

        design = given.design
        timed("warm", 1, "warm", design=design, contacts=True)
        timed(
            "first picture, camera's size", 1, "simulate", design=design, contacts=PRESS, name="a"
        )
        timed("the same with another contact", 1, "simulate", design=design,
              contacts=["sphere:1.5@1,1:0.6"], name="b")  # fmt: skip
        group = next(iter(engine.ask("open", design=design)["data"]["lights"]))
        path = f"lights.{group}.lights[0].position.x"
        start = engine.ask("open", design=design)["data"]["lights"][group]["lights"][0]["position"]

        def moved(step: int) -> dict[str, Any]:
            return {"from": design, "set": {path: start[0] + 0.05 * (step + 1)}}

        timed("first draft", 1, "simulate", design=moved(99), contacts=PRESS, draft=True)
        timed("draft, a light moved", given.drafts, "simulate", design=moved, contacts=PRESS,
              draft=True, files=["pixels"], name="draft")  # fmt: skip

        def pressed(step: int) -> list[str]:
            return [f"sphere:1.5@{0.1 * step:g},0:0.6"]

        timed("draft, a contact moved", given.drafts, "simulate", design=moved(99),
              contacts=pressed, draft=True, files=["pixels"], name="draft")  # fmt: skip

        def dimmed(step: int) -> dict[str, Any]:
            return {group: {"flux": 0.1 * step}}

        for image, what in (("draft", "160 wide"), ("a", "camera's size")):
            timed(f"relit, {what}, pixels", 30, "relight", image=image, lights=dimmed,
                  files=["pixels"], name="relit")  # fmt: skip
        timed("relit, camera's size, PNG", 30, "relight", image="a", lights=dimmed, name="relit")
        engine.ask("shutdown")


if __name__ == "__main__":
    main()
