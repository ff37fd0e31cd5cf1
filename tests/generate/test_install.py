"""The output folder as a project that pip installs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from rosidl_adapter_proto.generate import Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source
from tests.folders import content, write_package

CHECKOUT = Path(__file__).parents[2]
USE = """
from rosidl_proto.my_msgs.msg import Place, PlaceAdapter
from rosidl_proto.base_msgs.msg import Point
import rosidl_proto.my_msgs
place = Place(position=Point(x=1.0), name="here")
assert Place.FromString(place.SerializeToString()) == place
assert PlaceAdapter.type_name == "my_msgs/msg/Place"
print(rosidl_proto.my_msgs.__path__[0])
"""


@pytest.mark.parametrize("ignored", [False, True])
def test_pip_install(ignored: bool, tmp_path: Path) -> None:
    """The folder is installed whole, even where git ignores it."""
    pytest.importorskip("hatchling", reason="needs hatchling, which builds the folder")
    source = tmp_path / "src"
    write_package(source / "base_msgs", {"msg/Point.msg": "float64 x\n"})
    write_package(source / "my_msgs", {"msg/Place.msg": "base_msgs/Point position\nstring name\n"})
    output = tmp_path / "generated"
    generate(Request(("my_msgs",)), Catalog((folder_source(source),)), output)
    if ignored:
        if shutil.which("git") is None:
            pytest.skip("needs git")
        subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
        (tmp_path / ".gitignore").write_text("generated/\n")
    before = content(output)
    environment = tmp_path / "venv"
    venv.create(environment, symlinks=True)
    python = environment / "bin" / "python"
    paths = {*map(sysconfig.get_path, ("purelib", "platlib")), str(CHECKOUT)}

    def run(*command: str | Path) -> str:
        # What builds the folder, and what it needs when it runs, are those of the tests.
        variables = {**os.environ, "PYTHONPATH": os.pathsep.join(sorted(paths))}
        done = subprocess.run(
            command, env=variables, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    install = ("install", "--quiet", "--no-deps", "--no-build-isolation", "--no-compile")
    run(sys.executable, "-m", "pip", "--python", python, *install, output)

    assert content(output) == before
    share = {path: data for path, data in content(environment / "share").items() if data is not None}
    assert share == {
        path.removeprefix("proto/").replace("index/", "ament_index/resource_index/"): data
        for path, data in before.items()
        if path.startswith(("proto/", "index/")) and data is not None
    }
    (site,) = (environment / "lib").glob("python*/site-packages")
    installed = {path: data for path, data in content(site).items() if path.startswith("rosidl_proto/")}
    assert installed == {
        path.removeprefix("python/"): data
        for path, data in before.items()
        if path.startswith("python/rosidl_proto/")
    }
    assert run(python, "-c", USE) == f"{site}/rosidl_proto/my_msgs\n"
