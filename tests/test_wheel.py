"""The wheel works in an environment of its own, without the checkout and without a compiler."""

from __future__ import annotations

import venv
from pathlib import Path

import rosidl_adapter_proto
from tests.programs import run

USE = """
from rosidl_proto.std_msgs.msg import Header, HeaderAdapter
header = HeaderAdapter.new(frame_id="map")
assert HeaderAdapter.from_cdr(HeaderAdapter.to_cdr(header)).frame_id == "map"
import rosidl_adapter_proto
print(rosidl_adapter_proto.__file__)
"""


def test_version_of_the_wheel(wheel: Path) -> None:
    assert wheel.name.startswith(f"rosidl_adapter_proto-{rosidl_adapter_proto.__version__}-")


def test_wheel(wheel: Path, tmp_path: Path) -> None:
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
        variables=no_compiler,
    )
    packages = {**no_compiler, "PYTHONPATH": str(tmp_path / "generated/python")}
    where = run(programs / "python", "-W", "error", "-c", USE, folder=tmp_path, variables=packages)
    assert where.startswith(str(tmp_path / "venv"))
