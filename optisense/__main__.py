"""``optisense``, and ``python -m optisense``, which is the same."""

from __future__ import annotations

import signal


def main() -> None:
    """Run the command line.

    While Python still imports it, Ctrl-C ends the process without a word, as it ends a program
    that does not handle it. Then `optisense.cli.stopping` takes over.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from optisense.cli import main as run

    run()


if __name__ == "__main__":
    main()
