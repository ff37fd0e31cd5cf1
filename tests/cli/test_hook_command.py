"""`rosidl-proto hook install` and `rosidl-proto cmake-dir`."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.cli.conftest import Run
from tests.folders import content

CONFIG = "share/rosidl_generator_proto/cmake/rosidl_generator_protoConfig.cmake"


def test_hook_install(folder: Path, run: Run) -> None:
    prefix = folder / "ros"
    (prefix / "share" / "ament_index").mkdir(parents=True)

    first = run("hook", "install", "--prefix", "ros")
    again = run("hook", "install", "--prefix", "ros")

    assert (first.code, first.err, again) == (0, "", first)
    files = [path for path, data in content(prefix).items() if data is not None]
    assert sorted(first.out.splitlines()) == sorted(f"wrote ros/{path}" for path in files)
    assert sorted(files) == [
        "share/ament_index/resource_index/rosidl_generator_packages/rosidl_generator_proto",
        CONFIG,
        "share/rosidl_generator_proto/cmake/rosidl_generator_proto_arguments.cmake",
        "share/rosidl_generator_proto/cmake/rosidl_generator_proto_generate_interfaces.cmake",
        "share/rosidl_generator_proto/cmake/rosidl_generator_proto_python.cmake",
        "share/rosidl_generator_proto/cmake/rosidl_generator_proto_run.cmake",
    ]
    python = (prefix / CONFIG).with_name("rosidl_generator_proto_python.cmake")
    assert python.read_text() == f'set(_rosidl_generator_proto_python "{sys.executable}")\n'
    shown = run("cmake-dir")
    assert (shown.code, shown.err) == (0, "")
    assert (Path(shown.out.strip()) / Path(CONFIG).name).read_bytes() == (prefix / CONFIG).read_bytes()


def test_a_folder_that_is_no_prefix(folder: Path, run: Run) -> None:
    ended = run("hook", "install", "--prefix", "ros")

    assert (ended.code, ended.out) == (3, "")
    assert ended.err == (
        "Error: ros is not a prefix of ROS packages: it has no share/ament_index; give one of those in "
        "AMENT_PREFIX_PATH, of a workspace one such as install/<package>\n"
    )
    assert not (folder / "ros").exists()


def test_a_prefix_that_cannot_be_written(folder: Path, run: Run) -> None:
    (folder / "ros/share/ament_index").mkdir(parents=True)
    (folder / "ros/share/rosidl_generator_proto").write_text("")

    ended = run("hook", "install", "--prefix", "ros")

    assert ended.code == 3
    assert ended.err.startswith("Error: cannot write to ros: ")
