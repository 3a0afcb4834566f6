"""Make the picture of docs/study-report.md anew: python scripts/report_picture.py

It searches the mirror of GelSight Svelte, writes the search's report, and takes a picture of the
upper part of that page with Chromium, which must be installed.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

OUT = Path(__file__).parent.parent / "docs" / "images" / "study-report.png"
OPTISENSE = (sys.executable, "-m", "optisense.cli")
SEARCH = (
    *("search", "gelsight-svelte", "--objective", "aoap", "--budget", "300"),
    *("--vary", "cages.M1.points.x=+-8"),
    *("--vary", "cages.M1.points.y=+-1"),
    *("--vary", "cages.M1.points.z=+-2"),
)
PHOTONS = "3000000"
WIDTH, HEIGHT, SCALE = 1280, 2036, 0.64
"""Width and height (pixels) of the browser's window, which shows the upper part of the page, and
scale of the picture."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


def main() -> None:
    """Search, write the report and take the picture."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        sys.exit("Chromium is needed to take the picture: none of " + ", ".join(BROWSERS))
    with TemporaryDirectory() as folder:
        study = Path(folder) / "mirror"
        subprocess.run([*OPTISENSE, *SEARCH, "--out", str(study)], check=True)
        subprocess.run([*OPTISENSE, "report", str(study), "--photons", PHOTONS], check=True)
        options = [
            *("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
            *(f"--user-data-dir={folder}/browser", f"--window-size={WIDTH},{HEIGHT}"),
            f"--force-device-scale-factor={SCALE}",
            *("--virtual-time-budget=3000", f"--screenshot={OUT}"),
        ]
        page = (study / "report.html").as_uri()
        subprocess.run([browser, *options, page], check=True, capture_output=True, timeout=120)
    print(OUT)


if __name__ == "__main__":
    main()
