"""`rosidl-proto plotjuggler series` and `run`."""

from __future__ import annotations

from pathlib import Path

import numpy
import pytest
from mcap.writer import Writer

from benchmarks.bag_maker import IMU, SCAN, record, write_mcap
from tests.cli.conftest import Outcome, Run, run

__all__ = ["run"]

LIST = """\
topic  key                type    count  first       last
/imu   /header/stamp/sec  int32      20  1700000000  1700000000
/imu   /header/frame_id   string     20  "imu_link"  "imu_link"
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_mcap(tmp_path / "bag.mcap", record([IMU, SCAN], 0.1))
    return tmp_path / "bag.mcap"


def test_series_are_listed(path: Path, run: Run) -> None:
    fields = ("--field", "/imu/header/stamp/sec", "--field", "/*/frame_id", "--topic", "/imu")
    assert run("plotjuggler", "series", str(path), *fields) == Outcome(0, LIST, "")


def test_run_takes_a_plugin(path: Path, run: Run, plugin_files: dict[str, Path]) -> None:
    command = ("plotjuggler", "run", str(plugin_files["ros2msg"]), str(path))
    fields = ("--field", "/imu/header/stamp/sec", "--field", "/imu/header/frame_id")
    assert run(*command, *fields) == Outcome(0, LIST, "")


def test_series_are_written(path: Path, run: Run, tmp_path: Path) -> None:
    output = tmp_path / "scan.npz"
    options = ("--field", "/scan/ranges", "--array-limit", "3", "--clamp", "--output", str(output))
    assert run("plotjuggler", "series", str(path), *options) == Outcome(0, f"{output}: 3 series\n", "")
    with numpy.load(output, allow_pickle=False) as found:
        assert [name for name in found if not name.endswith("time")] == [
            f"/scan/ranges[{each}]" for each in range(3)
        ]


def test_what_is_missing_is_told_and_makes_exit_code_1(tmp_path: Path, run: Run) -> None:
    path = tmp_path / "bag.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        channel = writer.register_channel("/text", "cdr", schema)
        for time, data in enumerate((b"\0\1\0\0\3\0\0\0hi\0", b"\0\1\0\0\xff\0\0\0hi\0")):
            writer.add_message(channel, time, data, time)
        writer.finish()  # type: ignore[no-untyped-call]
    outcome = run("plotjuggler", "series", str(path))
    assert outcome.code == 1
    assert outcome.out.splitlines()[1:] == ['/text  /data  string      1  "hi"   "hi"']
    assert outcome.err.startswith(
        f"Warning: 1 of 2 messages of /text could not be parsed and are left out; the first: {path}: message 2 of /text"
    )


@pytest.mark.parametrize(
    ("options", "code", "text"),
    [
        (("--clamp",), 2, "Error: --clamp needs --array-limit: how many elements to show.\n"),
        (("--output", "-"), 2, "Error: series cannot go to the standard output; name a file\n"),
        (("--output", "a.xml"), 2, "Error: a.xml: the suffix says no format of series; name the file "),
        (("--topic", "/ima"), 2, "there is no topic /ima; did you mean /imu?\n"),
        (("--field", "/imu/header/stam"), 2, "there is no series /imu/header/stam; did you mean "),
    ],
)
def test_options_that_are_wrong(options: tuple[str, ...], code: int, text: str, path: Path, run: Run) -> None:
    outcome = run("plotjuggler", "series", str(path), *options)
    assert (outcome.code, outcome.out) == (code, "")
    assert text in outcome.err
