"""Every command and example in the documents runs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from benchmarks import bag_maker

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
TOP = [ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
ONE_PROGRAM = "rclpy.md"  # its blocks are one program, which tests/ros runs
BUILDS = ("build-colcon.md", "build-setuptools.md", "build-hatch.md")  # tests/hooks runs them
PLOTS = ("plots.md", "plotjuggler.md")  # tests/plotjuggler runs them
FRAMES = ("ray-data.md", "daft.md")  # tests/bags/peers runs them
PEERS = {
    "import polars": "polars",
    "to_pandas": "pandas",
    "from mcap_protobuf": "mcap_protobuf",
    "rosidl-proto plotjuggler": "wasmtime",
}
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.MULTILINE | re.DOTALL)
NEEDS_ROS = re.compile(r"convert_to_ros_message\(\w+\)  #|import rclpy|^rosidl generate", re.MULTILINE)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Generated packages, which the Python examples import as if they were installed."""
    folder = tmp_path_factory.mktemp("installed")
    run(folder, folder, "sh", "rosidl-proto generate sensor_msgs")
    return folder


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag that the documents read, which stands in the current folder there."""
    path = tmp_path_factory.mktemp("recorded") / "recording"
    streams = [bag_maker.IMU, bag_maker.JOINT_STATES, bag_maker.SMALL_IMAGE]
    bag_maker.write_folder(path, bag_maker.record(streams, 2), storage="mcap")
    return path


def run(folder: Path, installed: Path, kind: str, text: str) -> None:
    text = re.sub(r"^pip install \./generated$", "", text, flags=re.MULTILINE)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    python_path = os.pathsep.join([str(installed / "generated/python"), str(ROOT)])
    data = {"XDG_DATA_HOME": str(folder / "data")}  # where programs keep what is a user's
    environment = {**os.environ, **data, "PATH": path, "PYTHONPATH": python_path}
    command = ["bash", "-euc", text] if kind == "sh" else [sys.executable, "-c", text]
    process = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, check=False, text=True
    )
    assert process.returncode == 0, f"{text}\n{process.stdout}\n{process.stderr}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_blocks_run(document: Path, installed: Path, recording: Path, tmp_path: Path) -> None:
    if document.name == ONE_PROGRAM:
        pytest.skip("run by tests/ros/test_programs.py")
    if document.name in BUILDS:
        pytest.skip("run by tests/hooks")
    if document.name in PLOTS:
        pytest.skip("run by tests/plotjuggler")
    if document.name in FRAMES:
        pytest.skip("run by tests/bags/peers")
    shutil.copytree(recording, tmp_path / "recording")
    for kind, text in BLOCK.findall(document.read_text(encoding="utf-8")):
        if NEEDS_ROS.search(text):
            pytest.importorskip("rclpy", reason="needs a ROS installation")
        if any(word in text and not find_spec(module) for word, module in PEERS.items()):
            continue  # they run where the tests beside peers do
        run(tmp_path, installed, kind, text)


@pytest.mark.parametrize("document", [*DOCUMENTS, *TOP], ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", document.read_text(encoding="utf-8")):
        assert (document.parent / target).exists(), target


@pytest.mark.parametrize("example", ["without_ros.py", "with_ros.py"])
def test_examples_run(example: str, installed: Path, tmp_path: Path) -> None:
    if example == "with_ros.py":
        pytest.importorskip("rclpy", reason="needs a ROS installation")
    run(tmp_path, installed, "python", (ROOT / "examples" / example).read_text())
