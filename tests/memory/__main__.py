"""``python -m tests.memory``: the same work again and again, with the memory in use meanwhile.

500 images, 1,000 scores and 50 designs unless told otherwise.
"""

from __future__ import annotations

import argparse

from .work import WORK, measured

TIMES = {"images": 500, "scores": 1000, "designs": 50, "files": 500}
"""How often each piece of work is done."""


def main() -> None:
    """Run from the command line, one piece of work a process."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("work", choices=sorted(WORK))
    parser.add_argument("--times", type=int)
    given = parser.parse_args()
    times = given.times or TIMES[given.work]
    every = max(1, times // 20)
    print(f"{given.work:<10}{'MiB':>8}{'files':>8}", flush=True)
    for number, mebibytes, files in measured(given.work, times):
        if number % every == 0 or number == 1:
            print(f"{number:<10}{mebibytes:>8.0f}{files:>8}", flush=True)


if __name__ == "__main__":
    main()
