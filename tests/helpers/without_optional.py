"""A plugin of pytest that takes the optional dependencies away: `pytest -p without_optional`.

A user who installed OptiSense Studio without its extras has none of them. Processes that a test
starts have them again.
"""

from __future__ import annotations

import sys

OPTIONAL = ("OCP", "dask", "distributed", "lxml", "networkx", "pyarrow", "pyluxcore")
"""Top-level modules of the extras `step`, `parquet`, `dask` and `bench`, and of the tests' own
readers."""

for name in OPTIONAL:
    sys.modules[name] = None  # type: ignore[assignment]  # an import of it fails, and none finds it
