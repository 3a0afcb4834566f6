"""``python -m tests.memory``: the same work again and again, with the memory in use meanwhile.

500 images, 1,000 scores and 50 designs unless told otherwise. It ends with 1 where memory or open
files grow beyond their bounds.
"""

from __future__ import annotations

import argparse
import sys

from .work import WORK, measured, wrong

TIMES = {"images": 500, "scores": 1000, "designs": 50, "files": 500}
"""How often each piece of work is done."""


def main() -> int:
    """Run from the command line, one piece of work a process."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("work", choices=sorted(WORK))
    parser.add_argument("--times", type=int)
    given = parser.parse_args()
    times = given.times or TIMES[given.work]
    every = max(1, times // 20)
    print(f"{given.work:<10}{'MiB':>8}{'files':>8}", flush=True)
    rows = []
    for row in measured(given.work, times):
        rows.append(row)
        number, mebibytes, files = row
        if number % every == 0 or number == 1:
            print(f"{number:<10}{mebibytes:>8.0f}{files:>8}", flush=True)
    found = wrong(given.work, rows)
    largest = max(mebibytes for _, mebibytes, _ in rows)
    print(f"largest   {largest:>8.0f}        {found}", flush=True)
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
