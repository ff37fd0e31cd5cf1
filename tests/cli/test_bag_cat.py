"""`rosidl-proto bag cat`."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.shell_completion import ShellComplete
from google.protobuf import any_pb2
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from mcap.writer import Writer

from benchmarks import bag_maker
from benchmarks.bag_maker import IMU, SMALL_IMAGE, START, TF, record
from rosidl_adapter_proto import open_bag
from rosidl_adapter_proto.cli import program
from tests.cli.conftest import Outcome, Run


@pytest.fixture(autouse=True)
def bag(folder: Path) -> Path:
    """A bag of two seconds, in the current folder."""
    path = folder / "bag.mcap"
    bag_maker.write_mcap(path, record([IMU, SMALL_IMAGE, TF], 2))
    return path


def lines(ended: Outcome) -> list[Any]:
    assert (ended.code, ended.err) == (0, "")
    return [json.loads(line) for line in ended.out.splitlines()]


def test_messages_are_lines_of_json(bag: Path, run: Run) -> None:
    printed = lines(run("bag", "cat", "bag.mcap", "/imu", "/tf"))

    messages = list(open_bag(bag).messages(["/imu", "/tf"]))
    for line, recorded in zip(printed, messages, strict=True):
        assert {name: line[name] for name in ("topic", "log_time", "publish_time", "sequence")} == {
            "topic": recorded.topic,
            "log_time": recorded.log_time,
            "publish_time": recorded.publish_time,
            "sequence": recorded.sequence,
        }
    imu = messages[0].message
    assert printed[0]["message"] == {
        "header": {"stamp": {"sec": START // 10**9, "nanosec": 0}, "frame_id": "imu_link"},
        "orientation": {axis: getattr(imu.orientation, axis) for axis in "xyzw"},
        "orientation_covariance": list(imu.orientation_covariance),
        "angular_velocity": {axis: getattr(imu.angular_velocity, axis) for axis in "xyz"},
        "angular_velocity_covariance": list(imu.angular_velocity_covariance),
        "linear_acceleration": {axis: getattr(imu.linear_acceleration, axis) for axis in "xyz"},
        "linear_acceleration_covariance": list(imu.linear_acceleration_covariance),
    }


def test_patterns_of_topics(run: Run) -> None:
    printed = lines(run("bag", "cat", "bag.mcap", "/[it]*", "/imu"))

    assert printed == lines(run("bag", "cat", "bag.mcap", "/imu", "/tf"))
    assert run("bag", "cat", "bag.mcap", "/x*").err == (
        "Error: bag.mcap: there is no topic /x*; there are /camera/image, /imu, /tf\n"
    )


def test_fields_have_the_order_of_the_definition(run: Run) -> None:
    (line,) = lines(run("bag", "cat", "bag.mcap", "/tf", "--limit", "1"))

    first = line["message"]["transforms"][0]
    assert list(first) == ["header", "child_frame_id", "transform"]
    assert list(first["transform"]["rotation"]) == ["x", "y", "z", "w"]


def test_bytes_are_base64(bag: Path, run: Run) -> None:
    (line,) = lines(run("bag", "cat", "bag.mcap", "/camera/image", "--limit", "1"))

    image = next(open_bag(bag).messages("/camera/image")).message
    assert base64.b64decode(line["message"]["data"]) == image.data
    assert line["message"]["is_bigendian"] == 0  # is printed though it is 0


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ("header.stamp", {"header": {"stamp": {"sec": START // 10**9, "nanosec": 0}}}),
        ("header.stamp.nanosec, is_bigendian", {"header": {"stamp": {"nanosec": 0}}, "is_bigendian": 0}),
        ("header,header.frame_id,width", None),
    ],
)
def test_chosen_fields(run: Run, fields: str, expected: object) -> None:
    (line,) = lines(run("bag", "cat", "bag.mcap", "/camera/image", "--limit", "1", "--fields", fields))

    whole = {
        "header": {"stamp": {"sec": START // 10**9, "nanosec": 0}, "frame_id": "camera_link"},
        "width": 64,
    }
    assert line["message"] == (whole if expected is None else expected)


def test_fields_that_are_given_one_by_one(run: Run) -> None:
    options = ["--fields", "header.stamp.nanosec", "--fields", "width,height"]
    (line,) = lines(run("bag", "cat", "bag.mcap", "/camera/image", "--limit", "1", *options))

    assert line["message"] == {"header": {"stamp": {"nanosec": 0}}, "height": 48, "width": 64}


def test_chosen_fields_of_elements(run: Run) -> None:
    (line,) = lines(
        run("bag", "cat", "bag.mcap", "/tf", "--limit", "1", "--fields", "transforms.child_frame_id")
    )

    assert line["message"] == {"transforms": [{"child_frame_id": frame} for frame in bag_maker.FRAMES]}


@pytest.mark.parametrize(
    ("start", "end", "first", "count"),
    [
        ("2023-11-14T22:13:21Z", None, START + 10**9, 200),
        ("2023-11-14 23:13:21.5+01:00", None, START + 1_500_000_000, 100),
        ("2023-11-14T22:13:20.990000001Z", "2023-11-14T22:13:21.000000001Z", START + 995_000_000, 2),
        (str(START + 10**9), str(START + 1_005_000_000), START + 10**9, 1),
        (None, str(START + 10_000_000), START, 2),
    ],
)
def test_chosen_times(run: Run, start: str | None, end: str | None, first: int | None, count: int) -> None:
    options = [
        each for name, value in (("--start", start), ("--end", end)) if value for each in (name, value)
    ]

    printed = lines(run("bag", "cat", "bag.mcap", "/imu", *options))

    assert len(printed) == count
    assert [line["log_time"] for line in printed[:1]] == ([] if first is None else [first])


def test_no_messages(run: Run) -> None:
    ended = run("bag", "cat", "bag.mcap", "/imu", "--start", "2030-01-01T00:00:00Z")

    warning = "Warning: there are no messages of these topics and times\n"
    assert (ended.code, ended.out, ended.err) == (0, "", warning)
    assert lines(run("bag", "cat", "bag.mcap", "/imu", "--limit", "0")) == []


@pytest.mark.parametrize("time", ["yesterday", "2023-11-14", "2023-02-30T00:00:00Z", "-1", "1.5"])
def test_no_times(run: Run, time: str) -> None:
    ended = run("bag", "cat", "bag.mcap", "/imu", f"--start={time}")

    assert (ended.code, ended.out) == (2, "")
    assert ended.err.endswith(
        f"Error: Invalid value for '--start': {time!r} is neither like 2026-05-01T12:00:00Z"
        " nor a number of nanoseconds since 1970\n"
    )


def test_times_without_a_time_zone(run: Run) -> None:
    assert run("bag", "cat", "bag.mcap", "/imu", "--end", "2023-11-14T22:13:21").err.endswith(
        "Error: Invalid value for '--end': '2023-11-14T22:13:21' has no time zone;"
        " write 2023-11-14T22:13:21Z for UTC\n"
    )


def test_unknown_topics_and_fields(run: Run) -> None:
    ended = run("bag", "cat", "bag.mcap", "/imy")
    error = "Error: bag.mcap: there is no topic /imy; did you mean /imu?\n"
    assert (ended.code, ended.out, ended.err) == (2, "", error)
    ended = run("bag", "cat", "bag.mcap", "/imu", "--fields", "header.time")
    error = "Error: sensor_msgs/msg/Imu.header has no field 'time'\n"
    assert (ended.code, ended.out, ended.err) == (3, "", error)


def test_a_wrong_message_ends_it(folder: Path, run: Run) -> None:
    first, second, *_ = record([IMU], 1)
    wrong = bag_maker.Recorded(second.log_time, IMU, 1, second.data[:4])
    bag_maker.write_mcap(folder / "wrong.mcap", [first, wrong])

    ended = run("bag", "cat", "wrong.mcap", "/imu")

    assert (ended.code, len(ended.out.splitlines())) == (3, 1)
    assert ended.err.startswith(
        f"Error: wrong.mcap: message 2 of /imu, recorded at {second.log_time}: sensor_msgs/msg/Imu.header.stamp.sec"
    )


def test_what_json_has_no_words_for(folder: Path, run: Run) -> None:
    import numpy

    message = bag_maker.imu(numpy.random.default_rng(0), START)
    message.linear_acceleration.x, message.linear_acceleration.y = numpy.nan, -numpy.inf
    message.header.frame_id = "ü\n"
    data = bytes(bag_maker.typestore().serialize_cdr(message, IMU.type_name))
    bag_maker.write_mcap(folder / "odd.mcap", [bag_maker.Recorded(START, IMU, 0, data)])

    (line,) = lines(run("bag", "cat", "odd.mcap", "/imu", "--fields", "linear_acceleration,header.frame_id"))

    assert line["message"]["linear_acceleration"]["x"] == "NaN"
    assert line["message"]["linear_acceleration"]["y"] == "-Infinity"
    assert line["message"]["header"]["frame_id"] == "ü\n"


def test_what_is_odd_about_the_bag_is_a_warning(folder: Path, run: Run) -> None:
    (folder / "folder").mkdir()
    (folder / "bag.mcap").rename("folder/bag.mcap")

    ended = run("bag", "cat", "folder", "/imu", "--limit", "1")

    assert (ended.code, len(ended.out.splitlines())) == (0, 1)
    assert ended.err.startswith("Warning: folder: no metadata.yaml; the files found")


@pytest.mark.parametrize(
    "before", [["cat", "bag.mcap"], ["table", "bag.mcap"], ["convert", "bag.mcap", "--topic"]]
)
@pytest.mark.parametrize(("typed", "expected"), [("/", ["/camera/image", "/imu", "/tf"]), ("/i", ["/imu"])])
def test_topics_are_completed(before: list[str], typed: str, expected: list[str]) -> None:
    complete = ShellComplete(program, {}, "rosidl-proto", "_COMPLETE")

    assert [item.value for item in complete.get_completions(["bag", *before], typed)] == expected
    assert complete.get_completions(["bag", before[0], "none", *before[2:]], typed) == []


def test_a_bag_that_was_cut_off(bag: Path, run: Run) -> None:
    whole = bag.read_bytes()
    bag.write_bytes(whole[: len(whole) // 2])
    ended = run("bag", "cat", "bag.mcap", "/imu")
    assert (ended.code, ended.out) == (3, "")
    assert ended.err.endswith(
        " whole, and `bag convert --on-error skip`, elsewhere `--salvage`, reads them\n"
    )

    ended = run("bag", "cat", "bag.mcap", "/imu", "--salvage")

    assert ended.code == 1 and 100 < len(ended.out.splitlines()) < 400
    searched, chunk, message = ended.err.splitlines()
    assert searched.startswith(
        "Warning: bag.mcap: the recording was not finished: it has no end; it was searched"
    )
    assert chunk.startswith("Warning: bag.mcap at byte 38: a Chunk record has ")
    assert message.startswith("Warning: bag.mcap at byte ")
    assert run("bag", "info", "bag.mcap").code == 3
    information = run("bag", "info", "bag.mcap", "--salvage")
    assert (information.code, information.err) == (1, ended.err)
    bag.write_bytes(whole)
    assert run("bag", "cat", "bag.mcap", "/imu", "--salvage") == run("bag", "cat", "bag.mcap", "/imu")


def test_a_pipe_that_closes(bag: Path) -> None:
    program = [sys.executable, "-c", "from rosidl_adapter_proto.cli import main; main()"]
    command = " ".join(f"'{part}'" for part in [*program, "bag", "cat", "bag.mcap", "/imu"])
    script = f"{command} | head -n 1; exit ${{PIPESTATUS[0]}}"
    ended = subprocess.run(
        ["bash", "-c", script], cwd=bag.parent, capture_output=True, text=True, check=False
    )

    assert (ended.returncode, ended.stderr) == (1, "")
    assert json.loads(ended.stdout)["topic"] == "/imu"


def test_a_message_that_is_no_json(bag: Path, run: Run) -> None:
    """An Any may have a type that is nowhere."""
    files = FileDescriptorSet(file=[FileDescriptorProto.FromString(any_pb2.DESCRIPTOR.serialized_pb)])
    with bag.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("google.protobuf.Any", "protobuf", files.SerializeToString())
        channel = writer.register_channel("/any", "protobuf", schema)
        writer.add_message(channel, 5, any_pb2.Any(type_url="a/b.C").SerializeToString(), 5)
        writer.finish()  # type: ignore[no-untyped-call]

    ended = run("bag", "cat", "bag.mcap", "/any")

    assert ended.code == 3
    assert ended.err.startswith(
        "Error: a message of /any, recorded at 5: protobuf cannot write it as JSON: Can not find message descriptor"
    )
