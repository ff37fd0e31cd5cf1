"""What is said where the native module is missing, as in the folder of the sources."""

from __future__ import annotations

import sys
from pathlib import Path

import rosidl_adapter_proto
from tests.programs import run

IMPORT = """
import sys
sys.modules["rosidl_adapter_proto.transcode._core"] = None
try:
    import rosidl_adapter_proto.transcode
except ImportError as error:
    print(error.name, error, sep="|")
"""


def test_the_native_module_is_missing(tmp_path: Path) -> None:
    name, _, text = run(sys.executable, "-c", IMPORT, folder=tmp_path).strip().partition("|")
    assert name == "rosidl_adapter_proto.transcode._core"
    folder = Path(rosidl_adapter_proto.__file__).parent / "transcode"
    assert text.startswith(f"{folder} has no native module (")
    assert text.endswith(
        "); install the project with pip, and if this is its source folder, run Python elsewhere"
    )
