"""Bags read as protobuf messages, against what was recorded and what rosbags and the mcap library read."""

from __future__ import annotations

import pickle
import shutil
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterable
from datetime import timezone
from pathlib import Path
from typing import Any

import pytest

from benchmarks import bag_maker
from benchmarks.bag_maker import IMU, JOINT_STATES, SMALL_IMAGE, START, TF, Recorded, record
from rosidl_adapter_proto import BagError, Error, SchemaError, adapter_for, open_bag
from rosidl_adapter_proto.bags.bag import Bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.message import BagMessage
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.time import to_datetime, to_nanoseconds
from tests.bags.values import assert_same_values

SECOND = 10**9
STREAMS = (IMU, JOINT_STATES, SMALL_IMAGE, TF)


@pytest.fixture(scope="module")
def recorded() -> list[Recorded]:
    """What every bag here has: a second of some topics."""
    return list(record(STREAMS, 1))


def write_mcap(compression: str) -> Callable[[Path, list[Recorded]], Path]:
    def write(folder: Path, messages: list[Recorded]) -> Path:
        path = folder / "bag.mcap"
        bag_maker.write_mcap(path, messages, compression=compression, chunk_size=10_000)
        return path

    return write


def write_folder(storage: str, compression: str = "") -> Callable[[Path, list[Recorded]], Path]:
    def write(folder: Path, messages: list[Recorded]) -> Path:
        bag_maker.write_folder(folder / "bag", messages, storage=storage, compression=compression)
        return folder / "bag"

    return write


def write_split(folder: Path, messages: list[Recorded]) -> Path:
    """Write two files, the names of which are not in their order."""
    half = len(messages) // 2
    path = folder / "split"
    path.mkdir()
    for name, part in (("b_0", messages[:half]), ("a_1", messages[half:])):
        bag_maker.write_mcap(path / f"{name}.mcap", part)
    text = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n"
    files = "  relative_file_paths: [b_0.mcap, a_1.mcap]\n  topics_with_message_count: []\n"
    (path / "metadata.yaml").write_text(text + files)
    return path


WRITERS = {
    "mcap": write_mcap(""),
    "mcap lz4": write_mcap("lz4"),
    "mcap zstd": write_mcap("zstd"),
    "folder of mcap": write_folder("mcap"),
    "folder of sqlite3": write_folder("sqlite3"),
    "sqlite3, files compressed": write_folder("sqlite3", "file"),
    "sqlite3, messages compressed": write_folder("sqlite3", "message"),
    "split": write_split,
}


@pytest.fixture(scope="module", params=WRITERS)
def path(
    request: pytest.FixtureRequest, recorded: list[Recorded], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The same bag in every form."""
    return WRITERS[request.param](tmp_path_factory.mktemp("bags"), recorded)


@pytest.fixture(scope="module")
def bag(recorded: list[Recorded], tmp_path_factory: pytest.TempPathFactory) -> Bag:
    """A bag in one form."""
    return open_bag(WRITERS["mcap zstd"](tmp_path_factory.mktemp("bag"), recorded))


def as_recorded(messages: Iterable[BagMessage]) -> list[tuple[str, int, bytes]]:
    return [(each.topic, each.log_time, each.data) for each in messages]


def chosen(recorded: list[Recorded], *topics: str) -> list[tuple[str, int, bytes]]:
    """Return what was recorded of some topics, or of all."""
    return [
        (each.stream.topic, each.log_time, each.data)
        for each in recorded
        if not topics or each.stream.topic in topics
    ]


def test_messages_are_those_that_were_recorded(path: Path, recorded: list[Recorded]) -> None:
    with open_bag(path) as bag:
        assert as_recorded(bag.messages()) == chosen(recorded)


def test_what_is_in_a_bag(path: Path, recorded: list[Recorded]) -> None:
    with open_bag(path) as bag:
        assert (bag.message_count, bag.start_time) == (len(recorded), START)
        assert bag.end_time == recorded[-1].log_time
        assert bag.duration == recorded[-1].log_time - START
        assert list(bag.topics) == sorted(stream.topic for stream in STREAMS)
        for stream in STREAMS:
            topic = bag.topics[stream.topic]
            assert (topic.type_name, topic.serialization_format) == (stream.type_name, "cdr")
            assert topic.message_count == sum(each.stream == stream for each in recorded)
            assert (
                topic.type_hash
                == bag.schema(stream.topic).type_hash
                == adapter_for(stream.type_name).type_hash
            )
        assert bag.warnings == []


def test_protobuf_messages_have_what_was_recorded(path: Path, recorded: list[Recorded]) -> None:
    typestore = bag_maker.typestore()
    with open_bag(path) as bag:
        for ours, theirs in zip(bag.messages(), recorded, strict=True):
            assert_same_values(ours.message, typestore.deserialize_cdr(theirs.data, theirs.stream.type_name))


def test_the_order_is_that_of_rosbags(path: Path) -> None:
    """Of messages of different times; rosbags has an order of its own where they are the same."""
    from rosbags.highlevel import AnyReader

    paths = sorted(path.glob("*.mcap")) if path.name == "split" else [path]
    with AnyReader(paths, default_typestore=bag_maker.typestore()) as reader, open_bag(path) as bag:
        theirs = [(connection.topic, time, bytes(data)) for connection, time, data in reader.messages()]
        assert sorted(as_recorded(bag.messages())) == sorted(theirs)
        assert [each.log_time for each in bag.messages()] == [time for _, time, _ in theirs]


def test_times_and_sequences_are_those_of_the_mcap_library(bag: Bag) -> None:
    from mcap.reader import make_reader

    with open(bag.path, "rb") as file:
        theirs = [
            (channel.topic, message.log_time, message.publish_time, message.sequence, message.data)
            for _, channel, message in make_reader(file).iter_messages(log_time_order=False)
        ]
    ours = [
        (each.topic, each.log_time, each.publish_time, each.sequence, each.data) for each in bag.messages()
    ]
    assert ours == theirs
    assert ours[1][2] == ours[1][1] - 1000


def test_messages_that_arrived_late_come_in_the_order_of_time(
    recorded: list[Recorded], tmp_path: Path
) -> None:
    late = sorted(recorded, key=lambda each: each.log_time + each.log_time % 7 * 10**8)
    assert late != recorded
    for name, write in WRITERS.items():
        if name == "split":
            continue  # the order is that of the files
        (tmp_path / name).mkdir()
        messages = list(open_bag(write(tmp_path / name, late)).messages())

        assert as_recorded(messages) == sorted(chosen(late), key=lambda each: each[1]), name


@pytest.mark.parametrize(
    "topics", [["/imu"], ["/imu", "/tf"], ["/camera/image", "/imu", "/joint_states", "/tf"], []]
)
def test_chosen_topics(path: Path, recorded: list[Recorded], topics: list[str]) -> None:
    expected = chosen(recorded, *topics) if topics else []

    assert as_recorded(open_bag(path).messages(topics)) == expected


def test_one_topic_by_its_name(bag: Bag, recorded: list[Recorded]) -> None:
    assert as_recorded(bag.messages("/imu")) == chosen(recorded, "/imu")


@pytest.mark.parametrize(
    ("start", "end"),
    [
        (START, START + SECOND),
        (START + SECOND // 2, None),
        (None, START + SECOND // 2),
        (START + SECOND // 4, START + SECOND // 2),
        (START + SECOND // 4, START + SECOND // 4),
        (START + 10 * SECOND, None),
        (None, START),
        (None, 2**70),
        (-1, None),
    ],
)
def test_chosen_times(path: Path, recorded: list[Recorded], start: int | None, end: int | None) -> None:
    expected = [
        each for each in chosen(recorded) if (start or 0) <= each[1] and (end is None or each[1] < end)
    ]

    assert as_recorded(open_bag(path).messages(start=start, end=end)) == expected


def test_times_may_be_of_any_kind(bag: Bag) -> None:
    start = to_datetime(START + SECOND // 2)
    assert start.tzinfo == timezone.utc
    stamp = next(bag.messages("/imu", start=start)).message.header.stamp

    assert to_nanoseconds(stamp) == START + SECOND // 2
    assert next(bag.messages("/imu", start=stamp)).log_time == START + SECOND // 2
    with pytest.raises(TypeError, match=r"^expected a time, not builtins\.float$"):
        bag.messages(start=1.5)  # type: ignore[arg-type]


def test_a_message_unpacks(bag: Bag) -> None:
    topic, imu, time = first = next(bag.messages("/imu"))

    assert (topic, time) == ("/imu", START)
    assert imu.header.frame_id == "imu_link"
    assert first.message is imu
    assert repr(first) == f"<BagMessage of /imu, recorded at {START}, {len(first.data)} bytes>"


def test_messages_are_of_the_class_that_the_adapter_has(bag: Bag) -> None:
    _, imu, _ = next(bag.messages("/imu"))

    assert type(imu) is adapter_for("sensor_msgs/msg/Imu").custom_type


def test_messages_hold_their_own_bytes(bag: Bag) -> None:
    assert {type(each.data) for each in bag.messages()} == {bytes}


LOADING = """
import pickle, sys
for each in pickle.loads(sys.stdin.buffer.read()):
    print(*each[:4], each[4].hex(), each[5].message.SerializeToString(deterministic=True).hex())
"""


def row(each: BagMessage) -> tuple[Any, ...]:
    return each.topic, each.log_time, each.publish_time, each.sequence, each.data


@pytest.mark.parametrize("fields", [None, ["header.stamp"]])
def test_messages_can_be_sent_to_another_process(path: Path, fields: list[str] | None) -> None:
    """Without generated code their classes are nowhere to be imported from."""
    messages = list(open_bag(path).messages(["/imu", "/camera/image"], fields=fields))
    rows = pickle.dumps([(*row(each), each) for each in messages])
    command = [sys.executable, "-c", LOADING]
    printed = subprocess.run(command, input=rows, stdout=subprocess.PIPE, check=True).stdout.decode()
    assert printed.splitlines() == [
        f"{topic} {log} {publish} {sequence} {data.hex()} {each.message.SerializeToString(deterministic=True).hex()}"
        for each in messages
        for topic, log, publish, sequence, data in [row(each)]
    ]
    one, other = (pickle.loads(pickle.dumps(each)) for each in messages[:2])
    assert one.message == messages[0].message and row(other) == row(messages[1])


def test_several_go_through_a_bag_at_once(bag: Bag, recorded: list[Recorded]) -> None:
    assert [(a.data, b.data) for a, b in zip(bag.messages(), bag.messages(), strict=True)] == [
        (each.data, each.data) for each in recorded
    ]


def test_chosen_fields(path: Path) -> None:
    topic, image, _ = next(open_bag(path).messages("/camera/image", fields=["header.stamp", "width"]))

    assert topic == "/camera/image"
    assert (image.width, image.header.stamp.sec, image.data) == (64, START // SECOND, b"")
    assert image.header.frame_id == ""


def test_fields_that_are_not_there(bag: Bag) -> None:
    with pytest.raises(SchemaError, match=r"^tf2_msgs/msg/TFMessage has no field 'header'"):
        bag.messages(["/imu", "/tf"], fields=["header"])
    with pytest.raises(
        TypeError, match=r"^fields must be a list of names, such as \['header'\], not a text$"
    ):
        bag.messages("/imu", fields="header")


def error_of(call: Callable[[], object], kind: type[Error] = BagError) -> str:
    with pytest.raises(kind) as raised:
        call()
    return str(raised.value)


def test_an_unknown_topic(bag: Bag) -> None:
    known = "/camera/image, /imu, /joint_states, /tf"

    for call, text in (
        (lambda: bag.messages("/imy"), "/imy; did you mean /imu?"),
        (lambda: bag.messages(["/imu", "x"]), f"x; there are {known}"),
        (lambda: bag.schema("imu"), "imu; did you mean /imu?"),
    ):
        assert error_of(call, RequestError) == f"{bag.path}: there is no topic {text}"


def test_no_bag(tmp_path: Path) -> None:
    assert error_of(lambda: open_bag(tmp_path / "none")) == f"{tmp_path}/none: no such file or folder"


def test_a_wrong_message_does_not_end_the_loop(recorded: list[Recorded], tmp_path: Path) -> None:
    wrong = [each for each in recorded if each.stream is IMU][:3]
    wrong[1] = Recorded(wrong[1].log_time, IMU, 1, wrong[1].data[:100])
    path = tmp_path / "bag.mcap"
    bag_maker.write_mcap(path, wrong)
    first, second, third = open_bag(path).messages()

    assert first.message.header.frame_id == third.message.header.frame_id == "imu_link"
    assert second.data == wrong[1].data
    assert error_of(lambda: second.message) == (
        f"{path}: message 2 of /imu, recorded at {START + 5_000_000}: sensor_msgs/msg/Imu.orientation_covariance"
        " at byte 60: 9 elements are announced, which 40 bytes cannot hold; the data is cut off or of another type"
    )


def test_a_type_that_nobody_knows(tmp_path: Path) -> None:
    path = write_one(tmp_path, "no_such_msgs/msg/Thing", "", b"", b"\0\1\0\0\1\0\0\0", "cdr")
    bag = open_bag(path)
    (message,) = bag.messages()

    assert message.data == b"\0\1\0\0\1\0\0\0"
    assert error_of(lambda: message.message).startswith(
        "topic /one (no_such_msgs/msg/Thing): package 'no_such_msgs' was not found"
    )

    definition = tmp_path / "src" / "no_such_msgs" / "msg" / "Thing.msg"
    definition.parent.mkdir(parents=True)
    definition.write_text("int32 number\n")
    _, thing, _ = next(open_bag(path, include=[tmp_path / "src"]).messages())
    assert thing.number == 1


def write_one(
    folder: Path, schema: str, encoding: str, definition: bytes, data: bytes, message_encoding: str = ""
) -> Path:
    """Write a bag with one message, recorded at `START`."""
    from mcap.writer import Writer

    path = folder / "one.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema_id = writer.register_schema(schema, encoding, definition)
        channel = writer.register_channel("/one", message_encoding or encoding, schema_id)
        writer.add_message(channel, START, data, START)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


@pytest.fixture(scope="module")
def protobuf_bag(bag: Bag, tmp_path_factory: pytest.TempPathFactory) -> Bag:
    """The bag, converted to protobuf."""
    path = tmp_path_factory.mktemp("protobuf") / "protobuf.mcap"
    convert_bag(bag.path, path, target_format="protobuf")
    return open_bag(path)


def test_protobuf_bags(bag: Bag, protobuf_bag: Bag, recorded: list[Recorded]) -> None:
    assert {each.serialization_format for each in protobuf_bag.topics.values()} == {"protobuf"}
    for ours, theirs in zip(protobuf_bag.messages(), bag.messages(), strict=True):
        assert (ours.topic, ours.log_time, ours.publish_time) == (
            theirs.topic,
            theirs.log_time,
            theirs.publish_time,
        )
        assert ours.message.DESCRIPTOR.full_name == theirs.message.DESCRIPTOR.full_name
        assert serialized(ours.message) == serialized(theirs.message)
    assert serialized(pickle.loads(pickle.dumps(ours)).message) == serialized(ours.message)


def serialized(message: Any) -> bytes:
    data: bytes = message.SerializeToString(deterministic=True)
    return data


def test_chosen_fields_of_protobuf_bags(protobuf_bag: Bag) -> None:
    _, image, _ = next(protobuf_bag.messages("/camera/image", fields=["header.stamp", "width"]))

    assert (image.width, image.header.stamp.sec, image.data) == (64, START // SECOND, b"")
    with pytest.raises(SchemaError, match=r"^tf2_msgs/msg/TFMessage has no field 'header'"):
        protobuf_bag.messages(["/imu", "/tf"], fields=["header"])


def test_a_wrong_protobuf_message(protobuf_bag: Bag, tmp_path: Path) -> None:
    imu = protobuf_bag.topics["/imu"]
    path = write_one(tmp_path, imu.schema_name, "protobuf", imu.definition.data, b"\xff")
    (message,) = open_bag(path).messages()

    assert error_of(lambda: message.message) == (
        f"{path}: message 1 of /one, recorded at {START}: sensor_msgs.msg.pb.Imu at byte 0:"
        " these are no bytes of this protobuf message"
    )


def test_protobuf_messages_that_ros_does_not_know(tmp_path: Path) -> None:
    from google.protobuf.descriptor_pb2 import FileDescriptorSet
    from google.protobuf.timestamp_pb2 import DESCRIPTOR, Timestamp

    descriptors = FileDescriptorSet()
    DESCRIPTOR.CopyToProto(descriptors.file.add())
    data = Timestamp(seconds=3).SerializeToString()
    path = write_one(tmp_path, "google.protobuf.Timestamp", "protobuf", descriptors.SerializeToString(), data)
    (message,) = open_bag(path).messages()

    assert message.message.seconds == pickle.loads(pickle.dumps(message)).message.seconds == 3
    assert "protobuf messages of no ROS type" in error_of(lambda: open_bag(path).schema("/one"))


@pytest.fixture
def ros1_bag(tmp_path: Path) -> Path:
    """A bag of ROS 1 with points that were recorded in no order."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    path = tmp_path / "ros1.bag"
    with Writer(path) as writer:
        connection = writer.add_connection("/point", "geometry_msgs/msg/PointStamped", typestore=store)
        for number in (0, 2, 1):
            stamp = types["builtin_interfaces/msg/Time"](sec=number, nanosec=5)
            header = types["std_msgs/msg/Header"](seq=number, stamp=stamp, frame_id="map")
            point = types["geometry_msgs/msg/Point"](x=float(number), y=0.0, z=-1.0)
            message = types["geometry_msgs/msg/PointStamped"](header=header, point=point)
            writer.write(connection, START + number, store.serialize_ros1(message, connection.msgtype))
    return path


def test_ros1_bags(ros1_bag: Path) -> None:
    with open_bag(ros1_bag) as bag:
        topic = bag.topics["/point"]
        assert (topic.type_name, topic.serialization_format) == ("geometry_msgs/msg/PointStamped", "ros1")
        for number, (_, point, time) in enumerate(bag.messages()):
            assert time == START + number
            assert (point.header.seq, point.header.stamp.sec, point.header.stamp.nanosec) == (
                number,
                number,
                5,
            )
            assert (point.header.frame_id, point.point.x, point.point.z) == ("map", number, -1.0)
        (_, point, _), *rest = bag.messages(fields=["header.stamp.sec", "point.z"], start=START + 2)
        assert (point.header.seq, point.header.stamp.sec, point.point.x, point.point.z) == (0, 2, 0.0, -1.0)
        assert rest == []


def test_only_chunks_that_overlap_are_in_memory(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    bag_maker.write_mcap(path, record([bag_maker.SCAN], 100), chunk_size=200_000)
    bag = open_bag(path)
    next(bag.messages()).message  # noqa: B018  # what is made at the first use does not count
    tracemalloc.start()
    try:
        assert sum(len(each.message.ranges) for each in bag.messages()) == 2000 * 720
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert path.stat().st_size > 10_000_000
    assert peak < 2_000_000


def test_a_topic_of_several_types(tmp_path: Path) -> None:
    other = bag_maker.Stream("/imu", "sensor_msgs/msg/JointState", 50, bag_maker.joint_state)
    path = tmp_path / "bag.mcap"
    bag_maker.write_mcap(path, record([IMU, other], 0.02))
    bag = open_bag(path)

    assert bag.topics["/imu"].message_count == bag.message_count == 5
    assert bag.warnings == [
        f"{path}: topic /imu has several types: sensor_msgs/msg/Imu, sensor_msgs/msg/JointState"
    ]
    assert [type(each.message).__name__ for each in bag.messages()] == [
        "Imu",
        "JointState",
        "Imu",
        "Imu",
        "Imu",
    ]


def test_another_serialization_format(tmp_path: Path) -> None:
    (message,) = open_bag(write_one(tmp_path, "a_msgs/msg/A", "ros2msg", b"", b"{}", "json")).messages()

    assert message.data == b"{}"
    assert error_of(lambda: message.message) == (
        "topic /one: its messages are json, which cannot be read as messages; cdr, protobuf, ros1 can"
    )


def test_a_bag_without_messages(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    bag_maker.write_mcap(path, [])
    bag = open_bag(path)

    assert list(bag.messages()) == []
    assert (bag.message_count, bag.start_time, bag.end_time, bag.duration) == (0, 0, 0, 0)
    text = f"{path}: there is no topic /imu; there are none"
    assert error_of(lambda: bag.messages("/imu"), RequestError) == text


def test_a_closed_bag(recorded: list[Recorded], tmp_path: Path) -> None:
    path = WRITERS["mcap"](tmp_path, recorded)
    with open_bag(path) as bag:
        begun, later = bag.messages(), bag.messages()
        next(begun)
    expected = f"{path}: the bag was closed; read its messages before, or do not close it"

    assert error_of(lambda: list(begun)) == expected
    assert error_of(lambda: next(later)) == expected
    assert bag.message_count == len(recorded)


def test_a_damaged_chunk_names_its_place(recorded: list[Recorded], tmp_path: Path) -> None:
    path = WRITERS["mcap"](tmp_path, recorded)
    data = bytearray(path.read_bytes())
    at = data.index(recorded[100].data)
    data[at : at + 4] = b"\xff" * 4
    path.write_bytes(data)

    assert " the chunk is damaged: its checksum is " in error_of(lambda: list(open_bag(path).messages()))


def test_files_that_nothing_is_asked_of_are_not_read(recorded: list[Recorded], tmp_path: Path) -> None:
    path = write_split(tmp_path, recorded)
    bag = open_bag(path)
    half = recorded[len(recorded) // 2].log_time
    assert bag.message_count == len(recorded)
    (path / "b_0.mcap").unlink()

    assert as_recorded(bag.messages(start=half + 1)) == [each for each in chosen(recorded) if each[1] > half]


def test_a_copy_with_other_names(bag: Bag, tmp_path: Path) -> None:
    shutil.copy(bag.path, tmp_path / "anything")

    assert open_bag(str(tmp_path / "anything")).message_count == bag.message_count
