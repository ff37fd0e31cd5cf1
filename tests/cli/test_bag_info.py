"""`rosidl-proto bag info`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import bag_maker
from benchmarks.bag_maker import IMU, JOINT_STATES, TF, record
from rosidl_adapter_proto.cli.commands.bag.info import _rate
from rosidl_adapter_proto.cli.texts import size_text
from tests.cli.conftest import Run


@pytest.fixture
def bag(folder: Path) -> Path:
    """A bag of two seconds."""
    path = folder / "bag.mcap"
    bag_maker.write_mcap(path, record([IMU, TF], 2), compression="zstd")
    return path


def test_info(bag: Path, run: Run) -> None:
    ended = run("bag", "info", "bag.mcap")

    assert (ended.code, ended.err) == (0, "")
    assert ended.out == f"""\
files:     bag.mcap
storage:   mcap, zstd
size:      {size_text(bag.stat().st_size)}
messages:  500
duration:  1.995000000 s
start:     2023-11-14T22:13:20.000000000Z (1700000000000000000)
end:       2023-11-14T22:13:21.995000000Z (1700000001995000000)

topic  type                    format  messages     rate  types from
/imu   sensor_msgs/msg/Imu     cdr          400   201 Hz  the recording
/tf    tf2_msgs/msg/TFMessage  cdr          100  50.1 Hz  the recording
"""


def test_json(bag: Path, run: Run) -> None:
    ended = run("bag", "info", "bag.mcap", "--json")

    assert (ended.code, ended.err) == (0, "")
    assert json.loads(ended.out) == {
        "files": ["bag.mcap"],
        "storage": ["mcap"],
        "compression": ["zstd"],
        "size": bag.stat().st_size,
        "start_time": 1700000000000000000,
        "end_time": 1700000001995000000,
        "message_count": 500,
        "topics": [
            {
                "name": name,
                "type_name": type_name,
                "serialization_format": "cdr",
                "message_count": count,
                "types_from": "the recording",
            }
            for name, type_name, count in (
                ("/imu", "sensor_msgs/msg/Imu", 400),
                ("/tf", "tf2_msgs/msg/TFMessage", 100),
            )
        ],
        "warnings": [],
    }


@pytest.mark.parametrize(
    ("compression", "printed"),
    [("", "sqlite3"), ("file", "sqlite3, zstd (whole files)"), ("message", "sqlite3, zstd (each message)")],
)
def test_what_rosbag2_compresses(folder: Path, run: Run, compression: str, printed: str) -> None:
    bag_maker.write_folder(folder / "bag", record([JOINT_STATES], 1), compression=compression)

    ended = run("bag", "info", "bag")

    assert (ended.code, ended.err) == (0, "")
    assert f"storage:   {printed}\n" in ended.out
    assert "/joint_states  sensor_msgs/msg/JointState  cdr           50" in ended.out


def write_text(path: Path, encoding: str, text: str, data: bytes, label: str = "cdr") -> None:
    """Write a bag with one message of `my_msgs/msg/A`."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("my_msgs/msg/A", encoding, text.encode())
        channel = writer.register_channel("/a", label, schema)
        writer.add_message(channel, 5, data, 5)
        writer.finish()  # type: ignore[no-untyped-call]


def test_definitions_that_are_elsewhere(folder: Path, my_msgs: Path, run: Run) -> None:
    write_text(folder / "bag.mcap", "", "", b"\0\1\0\0\1")

    ended = run("bag", "info", "bag.mcap")
    assert ended.code == 0
    assert ended.out.endswith("/a     my_msgs/msg/A  cdr            1        nowhere\n")
    assert ended.err.startswith("Warning: topic /a (my_msgs/msg/A): package 'my_msgs' was not found")

    for option in ("--interfaces", "--include", "-I"):
        assert run("bag", "info", "bag.mcap", option, "src").out.endswith(
            "/a     my_msgs/msg/A  cdr            1        src\n"
        )


def test_labels_that_are_wrong(folder: Path, run: Run) -> None:
    write_text(folder / "bag.mcap", "ros2msg", "bool a", b"\x08\x01")

    ended = run("bag", "info", "bag.mcap")

    assert ended.code == 0
    assert ended.err.startswith("Warning: topic /a says cdr, but its messages do not look like it; ")


def test_an_empty_bag(folder: Path, run: Run) -> None:
    bag_maker.write_mcap(folder / "bag.mcap", [])

    ended = run("bag", "info", "bag.mcap")

    assert ended.out.splitlines()[1:] == [
        "storage:   mcap",
        f"size:      {(folder / 'bag.mcap').stat().st_size} B",
        "messages:  0",
        "",
        "topic  type  format  messages  rate  types from",
    ]


def test_what_is_in_chunks_is_not_looked_for(bag: Path, run: Run) -> None:
    data = bytearray(bag.read_bytes())
    data[5000:5004] = bytes(4)
    bag.write_bytes(data)

    ended = run("bag", "info", "bag.mcap")

    assert ended.code == 0
    assert "messages:  500\n" in ended.out
    assert ended.err == ""
    assert ": the chunk is damaged: " in run("bag", "cat", "bag.mcap", "/imu").err


def test_no_bag(run: Run) -> None:
    ended = run("bag", "info", "no.mcap")

    assert (ended.code, ended.out, ended.err) == (3, "", "Error: no.mcap: no such file or folder\n")


@pytest.mark.parametrize(
    ("count", "seconds", "printed"),
    [
        (0, 1, ""),
        (1, 0, ""),
        (5, 3, "1.67 Hz"),
        (999, 1, "999 Hz"),
        (9996, 10, "1000 Hz"),
        (123456, 1, "123456 Hz"),
    ],
)
def test_rates(count: int, seconds: int, printed: str) -> None:
    assert _rate(count, seconds * 10**9) == printed


def test_protobuf_messages_of_other_programs(folder: Path, run: Run) -> None:
    from google.protobuf import timestamp_pb2
    from google.protobuf.descriptor_pb2 import FileDescriptorSet
    from mcap.writer import Writer

    files = FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    with Path("bag.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("google.protobuf.Timestamp", "protobuf", files.SerializeToString())
        writer.add_message(writer.register_channel("/a", "protobuf", schema), 5, b"", 5)
        writer.finish()  # type: ignore[no-untyped-call]

    ended = run("bag", "info", "bag.mcap")

    assert ended.out.endswith("/a     google.protobuf.Timestamp  protobuf         1        nowhere\n")
    assert ended.err.startswith("Warning: topic /a (google.protobuf.Timestamp): its messages are protobuf")


def test_messages_of_no_ros_type(folder: Path, run: Run) -> None:
    from mcap.writer import Writer

    with Path("bag.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("Place", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/a", "json", schema), 5, b"{}", 5)
        writer.finish()  # type: ignore[no-untyped-call]

    ended = run("bag", "info", "bag.mcap")

    assert ended.out.endswith("/a     Place  json           1        nowhere\n")
    assert (
        ended.err == "Warning: topic /a (Place): its messages are json of no ROS type: they cannot be read\n"
    )
