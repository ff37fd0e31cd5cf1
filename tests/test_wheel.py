"""The wheel works in an environment of its own, without the checkout and without a compiler."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).parent.parent
USE = """
from rosidl_proto.std_msgs.msg import Header, HeaderAdapter
header = HeaderAdapter.new(frame_id="map")
assert HeaderAdapter.from_cdr(HeaderAdapter.to_cdr(header)).frame_id == "map"
import rosidl_adapter_proto
print(rosidl_adapter_proto.__file__)
"""


def run(*command: str | Path, folder: Path, **variables: str) -> str:
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    done = subprocess.run(
        command, cwd=folder, env={**environment, **variables}, capture_output=True, check=False, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_wheel(tmp_path: Path) -> None:
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", "--quiet", "--no-deps", "--wheel-dir", tmp_path, ROOT, folder=tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    venv.create(tmp_path / "venv", with_pip=True, symlinks=True)
    programs = tmp_path / "venv/bin"
    run(programs / "pip", "install", "--quiet", wheel, folder=tmp_path)
    no_compiler = {"PATH": str(programs)}
    run(
        programs / "rosidl-proto",
        "generate",
        "std_msgs",
        "--distro",
        "kilted",
        folder=tmp_path,
        **no_compiler,
    )
    packages = {"PYTHONPATH": str(tmp_path / "generated/python")}
    where = run(programs / "python", "-W", "error", "-c", USE, folder=tmp_path, **no_compiler, **packages)
    assert where.startswith(str(tmp_path / "venv"))
