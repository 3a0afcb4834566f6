"""``python -m optisense.cli`` is ``optisense``."""

from optisense.cli.app import main

if __name__ == "__main__":
    main()
