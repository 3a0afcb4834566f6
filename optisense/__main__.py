"""``optisense``, and ``python -m optisense``, which is the same."""

from __future__ import annotations

from optisense.starting import exit_on_signals


def main() -> None:
    """Run the command line; `optisense.cli.stopping` handles signals once it is imported."""
    exit_on_signals()
    from optisense.cli import main as run

    run()


if __name__ == "__main__":
    main()
