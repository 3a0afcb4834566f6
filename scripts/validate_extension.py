"""Let Blender's own tool check the extension's zip: python scripts/validate_extension.py FILE.zip

Runs in .venv-blender; the tool comes with Blender as a plain script.
"""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path


def main() -> int:
    """Validate the file named on the command line, and return the tool's exit code."""
    spec = find_spec("bpy")
    if spec is None or spec.origin is None:
        sys.exit("this Python has no Blender: make setup-blender")
    tool = next(Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    return subprocess.run(
        [sys.executable, str(tool), "validate", sys.argv[1]], check=False
    ).returncode


if __name__ == "__main__":
    sys.exit(main())
