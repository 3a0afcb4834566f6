"""``python -m optisense.cli`` is ``optisense``."""

from optisense.__main__ import main

if __name__ == "__main__":
    main()
