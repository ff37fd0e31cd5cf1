"""Makes the ROS wheels of an environment usable for building: run this with its Python.

The CMake files of the wheels name the include folders of the machine that they were built on.
"""

from __future__ import annotations

import sys
import sysconfig
from pathlib import Path

import numpy as np

PYTHON = "/opt/python/cp311-cp311"


def main() -> None:
    """Replace the folders by those of this environment."""
    replacements = {
        f"{PYTHON}/include/python3.11": sysconfig.get_path("include"),
        f"{PYTHON}/lib/python3.11/site-packages/numpy/_core/include": np.get_include(),
    }
    for file in Path(sys.prefix, "share").rglob("*.cmake"):
        text = file.read_text(encoding="utf-8")
        for old, new in replacements.items():
            text = text.replace(old, new)
        if text != file.read_text(encoding="utf-8"):
            file.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
