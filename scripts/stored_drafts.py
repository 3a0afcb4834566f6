"""Make the drafts of the built-in sensors anew: python scripts/stored_drafts.py

The engine makes them, as for a front end that opens such a sensor.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from optisense.sensors import SENSORS
from optisense.sensors.stored_drafts import FOLDER


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        lines = [{"id": 0, "do": "hello", "protocol": 1, "client": "drafts", "folder": folder}]
        lines += [
            {"id": name, "do": "simulate", "design": f"builtin:{name}", "draft": True, "name": name}
            for name in SENSORS.names()
        ]
        with subprocess.Popen(
            [sys.executable, "-m", "optisense.cli", "engine"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as engine:
            assert engine.stdin is not None and engine.stdout is not None
            for line in lines:  # one by one, as a waiting draft is replaced by the next one
                print(json.dumps(line), file=engine.stdin, flush=True)
                answer = json.loads(engine.stdout.readline())
                while "ok" not in answer:
                    answer = json.loads(engine.stdout.readline())
                if not answer["ok"]:
                    sys.exit(answer["error"]["message"])
            engine.stdin.close()
        FOLDER.mkdir(exist_ok=True)
        for name in SENSORS.names():
            shutil.copyfile(Path(folder) / f"{name}.picture.png", FOLDER / f"{name}.png")


if __name__ == "__main__":
    main()
