"""Series of bags: of every kind of bag, with every choice, and of what goes wrong."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy
import pytest
from mcap.writer import CompressionType, Writer

from benchmarks.bag_maker import IMU, JOINT_STATES, SCAN, START, TF, record, write_folder, write_mcap
from rosidl_adapter_proto import BagError, open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.plotjuggler import series_buffers
from rosidl_adapter_proto.plotjuggler.columns import Column
from rosidl_adapter_proto.plotjuggler.host import ArrayPolicy, open_plugin
from rosidl_adapter_proto.plotjuggler.series import BagSeries, read_series
from rosidl_adapter_proto.plotjuggler.values import BuiltinType
from tests.plotjuggler import outputs, wat

FLOAT, TEXT = BuiltinType.FLOAT64, BuiltinType.STRING
STREAMS = (IMU, JOINT_STATES, SCAN, TF)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of CDR messages."""
    path = tmp_path_factory.mktemp("bag") / "bag.mcap"
    write_mcap(path, record(STREAMS, 1), compression="zstd", chunk_size=10_000)
    return path


def echo_bag(path: Path, *topics: tuple[str, Iterable[tuple[int, bytes]]], encoding: str = "echo") -> Path:
    """Write a bag whose messages are what a plugin gives back as they are: times and outputs."""
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        for topic, messages in topics:
            schema = writer.register_schema("Echo", encoding, b"")
            channel = writer.register_channel(topic, encoding, schema)
            for time, data in messages:
                writer.add_message(channel, time, data, time)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def number(key: str, value: float) -> outputs.Written:
    return key, FLOAT, struct.pack("<d", value)


def echoed(path: Path, **options: Any) -> BagSeries:
    return read_series(open_bag(path), plugin=open_plugin(wat.plugin()), **options)


def values_of(found: BagSeries) -> dict[str, tuple[list[int], list[Any]]]:
    return {each.name: (each.times.tolist(), list(each.values)) for each in found.series}


def same(one: BagSeries, other: BagSeries) -> bool:
    def facts(found: BagSeries) -> list[Any]:
        return [
            (each.topic, each.key, each.type_name, each.times.tolist(), list(each.values))
            for each in found.series
        ]

    return facts(one) == facts(other) and one.warnings == other.warnings == ()


def test_every_kind_of_bag_has_the_same_series(path: Path, tmp_path: Path) -> None:
    expected = read_series(open_bag(path))
    assert {each.topic for each in expected.series} == {stream.topic for stream in STREAMS}
    write_folder(tmp_path / "sqlite3", record(STREAMS, 1))
    convert_bag(path, tmp_path / "protobuf.mcap", target_format="protobuf")
    for bag in ("sqlite3", "protobuf.mcap"):
        assert same(read_series(open_bag(tmp_path / bag)), expected), bag


def test_series_of_imu(path: Path) -> None:
    found = read_series(open_bag(path), ["/imu"])
    by_key = {each.key: each for each in found.series}
    messages = [each for each in record(STREAMS, 1) if each.stream is IMU]
    assert list(by_key)[:5] == [
        "/header/stamp/sec",
        "/header/stamp/nanosec",
        "/header/frame_id",
        "/orientation/x",
        "/orientation/y",
    ]
    assert [each.type_name for each in found.series][:4] == ["int32", "uint32", "string", "float64"]
    assert by_key["/header/stamp/nanosec"].times.tolist() == [each.log_time for each in messages]
    nanoseconds = [(each.log_time - START) % 10**9 for each in messages]
    assert by_key["/header/stamp/nanosec"].values.tolist() == nanoseconds  # type: ignore[union-attr]
    assert by_key["/header/frame_id"].values == ["imu_link"] * len(messages)
    assert repr(by_key["/orientation/x"]) == "Series(topic='/imu', key='/orientation/x')"


@pytest.mark.parametrize(
    ("fields", "names"),
    [
        (["/imu/orientation/x"], ["/imu/orientation/x"]),
        (["/imu/orientation"], [f"/imu/orientation/{each}" for each in "xyzw"]),
        (["/joint_states/velocity"], [f"/joint_states/velocity[{each}]" for each in range(12)]),
        (["/joint_states/effort[1?]"], ["/joint_states/effort[10]", "/joint_states/effort[11]"]),
        (
            ["/*s*/header/frame_id"],
            [
                "/joint_states/header/frame_id",
                "/scan/header/frame_id",
                *(f"/tf/transforms[{each}]/header/frame_id" for each in range(6)),
            ],
        ),
        (["/imu/angular*/z", "/scan/scan_time"], ["/imu/angular_velocity/z", "/scan/scan_time"]),
    ],
)
def test_fields(path: Path, fields: list[str], names: list[str]) -> None:
    assert [each.name for each in read_series(open_bag(path), fields=fields).series] == names


def test_topics_and_times(path: Path) -> None:
    found = read_series(
        open_bag(path), ["/im*"], ["/imu/orientation/x"], start=START + 10**8, end=START + 2 * 10**8
    )
    (series,) = found.series
    assert series.times.tolist() == list(range(START + 10**8, START + 2 * 10**8, 5_000_000))


def test_long_arrays(path: Path) -> None:
    def keys(policy: ArrayPolicy | None) -> int:
        found = read_series(open_bag(path), fields=["/scan/*"], array_policy=policy).series
        return sum(each.key.startswith("/ranges") for each in found)

    assert keys(None) == 0
    assert keys(ArrayPolicy(clamp=True, maximum=10)) == 10
    assert keys(ArrayPolicy(clamp=False, maximum=719)) == 0
    assert keys(ArrayPolicy(clamp=False, maximum=720)) == 720


def test_progress(path: Path) -> None:
    counts: list[int] = []
    read_series(open_bag(path), ["/imu", "/tf"], progress=counts.append)
    assert sum(counts) == IMU.rate + TF.rate


def test_a_plugin_takes_the_topics_of_its_encoding(path: Path, plugin_files: dict[str, Path]) -> None:
    found = read_series(open_bag(path), plugin=open_plugin(plugin_files["ros2msg"]))
    assert same(found, read_series(open_bag(path)))
    text = f"{path}: the plugin is for other topics than these, which are ros2msg"
    with pytest.raises(RequestError, match=f"^{re.escape(text)}$"):
        read_series(open_bag(path), plugin=open_plugin(plugin_files["protobuf"]))


def test_keys_of_some_messages_have_times_of_their_own(tmp_path: Path) -> None:
    messages = [
        (10, outputs.released(number("/a", 1), number("/b", 2))),
        (20, outputs.released(number("/a", 3))),
        (30, outputs.released(number("/b", 4), number("/a", 5), ("/t", TEXT, b"hi"))),
        (40, outputs.released(("/a", BuiltinType.INT8, b"\x06"), ("/blob", BuiltinType.BLOB, bytes(8)))),
    ]
    found = echoed(echo_bag(tmp_path / "bag.mcap", ("/x", messages)))
    assert [(each.key, each.type_name, each.times.tolist(), list(each.values)) for each in found.series] == [
        ("/a", "float64", [10, 20, 30], [1, 3, 5]),
        ("/b", "float64", [10, 30], [2, 4]),
        ("/t", "string", [30], ["hi"]),
        ("/a", "int8", [40], [6]),
    ]
    assert [None if each.messages is None else each.messages.tolist() for each in found.series] == [
        [0, 1, 2],
        [0, 2],
        [2],
        [3],
    ]


def test_series_are_in_the_order_of_time_across_files(tmp_path: Path) -> None:
    def columns(rows: list[int], values: list[float]) -> list[Column]:
        return [Column("/a", FLOAT, numpy.array(rows), numpy.array(values))]

    collected = series_buffers.TopicSeries("/x", lambda name: True)
    collected.add(numpy.array([30, 40]), columns([0, 1], [3.0, 4.0]), ())
    collected.add(numpy.array([10, 20]), columns([1], [2.0]), ())
    collected.add(numpy.array([10, 40, 5]), columns([0, 1], [1.5, 4.5]), {2})
    (series,) = collected.series()
    assert series.times.tolist() == [10, 20, 30, 40, 40]
    assert list(series.values) == [1.5, 2.0, 3.0, 4.0, 4.5]
    assert series.messages is not None
    assert series.messages.tolist() == [1, 2, 3, 4, 5]


def test_messages_that_are_not_valid_are_counted(tmp_path: Path) -> None:
    messages = [
        (10, outputs.released(number("/a", 1))),
        (20, b""),
        (30, outputs.released(number("/a", 3))),
        (40, b""),
    ]
    path = echo_bag(tmp_path / "bag.mcap", ("/x", messages), ("/y", messages[:1]))
    found = echoed(path)
    assert values_of(found) == {"/x/a": ([10, 30], [1, 3]), "/y/a": ([10], [1])}
    assert found.warnings == (
        f"2 of 4 messages of /x could not be parsed and are left out; the first: {path}: message 2 of /x, recorded at "
        "20: pj_parser_decode returned 0",
    )


def test_a_plugin_that_breaks_its_contract_ends_a_topic(tmp_path: Path) -> None:
    good = (10, outputs.released(number("/a", 1)))
    path = echo_bag(tmp_path / "bag.mcap", ("/x", [(20, b"\xff" * 8)]), ("/y", [good]))
    found = echoed(path)
    assert values_of(found) == {"/y/a": ([10], [1])}
    (warning,) = found.warnings
    assert warning.startswith("plugin: /x (Echo): message 0: ") and warning.endswith(
        "; 0 of 1 messages of /x were read"
    )


def test_too_many_keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(series_buffers, "MAXIMUM_KEYS", 3)
    messages = [(time, outputs.released(*(number(f"/{key}", key) for key in range(5)))) for time in range(2)]
    found = echoed(echo_bag(tmp_path / "bag.mcap", ("/x", messages)))
    assert list(values_of(found)) == ["/x/0", "/x/1", "/x/2"]
    assert found.warnings == (
        "/x has more than 20000 series; 4 values of others are left out: choose some with --field",
    )


def test_topics_of_which_nothing_is_known(tmp_path: Path) -> None:
    path = echo_bag(tmp_path / "bag.mcap", ("/x", [(10, b"{}")]), encoding="json")
    found = read_series(open_bag(path))
    assert found.series == ()
    assert found.warnings == (
        "topic /x: its messages are json, for which there is no plugin here; give one to `plotjuggler run`; "
        "0 of 1 messages of /x were read",
    )


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"topics": ["/ima"]}, RequestError, "there is no topic /ima; did you mean /imu?"),
        (
            {"fields": ["/gps"]},
            RequestError,
            "no topic has such series; there are /imu, /joint_states, /scan, /tf",
        ),
        (
            {"fields": ["/imu/orientation/x", "/imu/orientation/v"]},
            RequestError,
            "there is no series /imu/orientation/v; did you mean",
        ),
        ({"topics": "/imu"}, TypeError, "topics is one text, '/imu'; give a list of names"),
        ({"fields": "/imu"}, TypeError, "fields is one text, '/imu'; give a list of names"),
    ],
)
def test_choices_that_are_wrong(path: Path, options: Any, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=re.escape(text)):
        read_series(open_bag(path), **options)


def test_times_that_no_series_can_have(tmp_path: Path) -> None:
    path = echo_bag(tmp_path / "bag.mcap", ("/x", [(2**63, outputs.released(number("/a", 1)))]))
    text = (
        f"{path}: a message of /x has the time {2**63}, and no series goes beyond {2**63 - 1} (the year 2262)"
    )
    with pytest.raises(BagError, match=f"^{re.escape(text)}$"):
        echoed(path)


def test_ros1_bags(tmp_path: Path) -> None:
    from rosbags.rosbag1 import Writer as Ros1Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    path = tmp_path / "ros1.bag"
    with Ros1Writer(path) as writer:
        connection = writer.add_connection("/point", "geometry_msgs/msg/Point32", typestore=store)
        for number, size in ((0, 12), (1, 5), (2, 12)):
            writer.write(connection, START + number, struct.pack("<fff", number, 0, -1)[:size])
    found = read_series(open_bag(path))
    assert values_of(found) == {
        f"/point/{name}": ([START, START + 2], values)
        for name, values in zip("xyz", ([0, 2], [0, 0], [-1, -1]), strict=True)
    }
    (warning,) = found.warnings
    assert warning.startswith("1 of 3 messages of /point could not be parsed and are left out; the first: ")


def test_bags_without_definitions(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("geometry_msgs/msg/Point32", "", b"")
        channel = writer.register_channel("/point", "cdr", schema)
        writer.add_message(channel, 5, b"\0\1\0\0" + struct.pack("<fff", 1, 2, 3), 5)
        writer.finish()  # type: ignore[no-untyped-call]
    found = read_series(open_bag(path))
    assert values_of(found) == {"/point/x": ([5], [1]), "/point/y": ([5], [2]), "/point/z": ([5], [3])}
    assert found.warnings == ()


def test_a_type_of_which_nothing_is_known(tmp_path: Path) -> None:
    path = echo_bag(tmp_path / "bag.mcap", ("/x", [(1, b"")]), encoding="cdr")
    found = read_series(open_bag(path))
    assert found.series == ()
    (warning,) = found.warnings
    assert warning.startswith("topic /x (Echo): ") and warning.endswith("; 0 of 1 messages of /x were read")
