"""The wheel works in an environment of its own, without the checkout and without a compiler."""

from __future__ import annotations

import venv
import zipfile
from pathlib import Path

import rosidl_adapter_proto
from rosidl_adapter_proto.plotjuggler.build import source_digest
from tests.programs import run

USE = """
from rosidl_proto.std_msgs.msg import Header, HeaderAdapter
header = HeaderAdapter.new(frame_id="map")
assert HeaderAdapter.from_cdr(HeaderAdapter.to_cdr(header)).frame_id == "map"
import rosidl_adapter_proto
print(rosidl_adapter_proto.__file__)
"""

DIGEST = "from rosidl_adapter_proto.plotjuggler.build import source_digest; print(source_digest())"


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
    # The sources of the plugins are all there: they are found by the same name as those of the source tree.
    digest = run(programs / "python", "-c", DIGEST, folder=tmp_path, variables=no_compiler)
    assert digest.strip() == source_digest()


def test_built_plugins_are_in_the_wheel(wheel: Path) -> None:
    """As many as there are: `make plugins` builds them."""
    package = "rosidl_adapter_proto/plotjuggler/built"
    with zipfile.ZipFile(wheel) as archive:
        found = {name for name in archive.namelist() if name.startswith(package)}
    root = Path(rosidl_adapter_proto.__file__).parent.parent
    assert found == {file.relative_to(root).as_posix() for file in (root / package).rglob("*.wasm")}
