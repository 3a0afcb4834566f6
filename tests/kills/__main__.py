"""``python -m tests.kills --kills 200``: kill commands at random moments, and count.

The kills are shared among the commands; the table tells how many came before a command's end, and
what was not as it must be.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

from .killing import kill_repeatedly
from .work import WORK


def main() -> int:
    """Run from the command line; 1 where something went wrong."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--kills", type=int, default=200, help="in all")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--only", action="append", choices=sorted(WORK), help="only these")
    parser.add_argument("--json", type=Path, help="write the counts here, too")
    given = parser.parse_args()
    names = given.only or list(WORK)
    shares = sum(WORK[name].share for name in names)
    rows = {}
    print(f"{'command':<20}{'killed':>8}{'too late':>10}{'wrong':>7}", flush=True)
    with tempfile.TemporaryDirectory(prefix="optisense-kills-") as home:
        for number, name in enumerate(names):
            kills = round(given.kills * WORK[name].share / shares)
            report = kill_repeatedly(name, kills, given.seed, Path(home, str(number)))
            wrong = len(report.wrong)
            print(f"{name:<20}{report.killed:>8}{report.late:>10}{wrong:>7}", flush=True)
            for line in report.wrong:
                print(f"    {line}", flush=True)
            rows[name] = {"killed": report.killed, "late": report.late, "wrong": wrong}
            if given.json:
                given.json.write_text(json.dumps(rows, indent=1) + "\n")
    return int(any(row["wrong"] for row in rows.values()))


if __name__ == "__main__":
    sys.exit(main())
