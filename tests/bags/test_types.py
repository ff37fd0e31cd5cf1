from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from google.protobuf import timestamp_pb2
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.bags.descriptors import descriptor_set
from rosidl_adapter_proto.bags.model import CDR, PROTOBUF, RecordedDefinition, Topic
from rosidl_adapter_proto.bags.types import BagTypes, protobuf_definition, ros_definition
from rosidl_adapter_proto.errors import BagError, RequestError, SchemaError
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.transcode.codec import Transcoder

RULE = "=" * 80
POINT_HASH = "RIHS01_1c8c4d5d2ad4e3d2d2b0b7a7c6fd0d1f7a2e0dcb5b7b1df2c3a4d5e6f7a8b9c0"
TOPIC = "topic /track (my_msgs/msg/Track): "
TRACK = f"std_msgs/Header header\nPoint[] points\n{RULE}\nMSG: my_msgs/Point\nfloat64 x\nfloat64 y\n"
HEADER = f"""\
{RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


@pytest.fixture(autouse=True)
def no_ros(folder: Path) -> None:
    """Hide what is installed, whatever that is."""


def topic(text: str | None = None, type_name: str = "my_msgs/msg/Track", **values: Any) -> Topic:
    definition: Any = RecordedDefinition() if text is None else RecordedDefinition("ros2msg", text.encode())
    return Topic(
        **{"name": "/track", "serialization_format": CDR, "type_name": type_name, "definition": definition}
        | values
    )


def types(*topics: Topic, **options: Any) -> BagTypes:
    return BagTypes(topics, **options)


def refused(wrong: Topic, *, others: tuple[Topic, ...] = (), **options: Any) -> str:
    with pytest.raises(BagError) as caught:
        types(wrong, *others, **options).schema(wrong)
    return str(caught.value)


def package(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        file = folder / "my_msgs" / "msg" / f"{name}.msg"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return folder


def hash_of(folder: Path, name: str = "my_msgs/msg/Track") -> str:
    return Catalog((folder_source(folder), store_source())).hash(TypeName.parse(name))


def test_a_type_of_the_recording_is_that_of_its_folder(tmp_path: Path) -> None:
    folder = package(tmp_path / "src", Track=TRACK.partition(RULE)[0], Point="float64 x\nfloat64 y\n")
    recorded = topic(TRACK + HEADER, type_hash=hash_of(folder))
    bag = types(recorded)
    schema = bag.schema(recorded)
    installed = TypeRegistry.from_folders(folder)["my_msgs/msg/Track"]
    assert schema.type_hash == installed.type_hash == recorded.type_hash
    assert schema.file == installed.file
    assert schema.message_class is installed.message_class
    assert bag.schema(recorded) is schema
    assert bag.message_class(recorded) is schema.message_class
    assert bag.origin(recorded) == "the recording"
    assert bag.warnings == []


def test_each_topic_has_its_own_version() -> None:
    old = topic(f"Point point\n{RULE}\nMSG: my_msgs/Point\nint32 x\n", name="/old")
    new = topic(f"Point point\n{RULE}\nMSG: my_msgs/Point\nfloat64 x\n", name="/new")
    bag = types(old, new)
    old_point, new_point = (bag.schema(each).message_class().point for each in (old, new))  # type: ignore[attr-defined]
    old_point.x, new_point.x = 1, 1.5
    with pytest.raises(TypeError):
        old_point.x = 1.5
    assert bag.warnings == []
    with pytest.raises(BagError) as caught:
        bag.recorded_types()
    assert str(caught.value) == (
        "my_msgs/msg/Point is not the same in topics /old and /new: code can only have one version"
    )


def test_what_the_recording_does_not_define(tmp_path: Path) -> None:
    folder = package(tmp_path / "src", Track="float64 x\n")
    humble = topic(type_name="sensor_msgs/msg/Range")
    custom = topic()
    bag = types(humble, custom, include=[folder], distro="humble")
    assert bag.schema(custom).message is not None
    assert bag.origin(custom) == str(folder)
    assert bag.origin(humble) == "embedded store humble"
    assert "variance" not in {each.name for each in bag.schema(humble).descriptor.fields}
    assert bag.warnings == [
        "my_msgs/msg/Track: the recording neither defines all of it nor says which version it has: my_msgs/msg/Track "
        f"from {folder}",
        "sensor_msgs/msg/Range: the recording neither defines all of it nor says which version it has: "
        "sensor_msgs/msg/Range from embedded store humble, std_msgs/msg/Header from embedded store humble",
    ]


def test_another_version_than_the_recorded_one_is_refused() -> None:
    of_humble = types(distro="humble").schema(topic(type_name="sensor_msgs/msg/Range")).type_hash
    recorded = topic(type_name="sensor_msgs/msg/Range", type_hash=POINT_HASH)
    assert refused(recorded, distro="humble") == (
        f"topic /track (sensor_msgs/msg/Range): it was recorded with the type hash {POINT_HASH}, but has {of_humble} "
        "with sensor_msgs/msg/Range from embedded store humble, std_msgs/msg/Header from embedded store humble: give "
        "the folder of its package with --include FOLDER, or the distribution it is from with --distro"
    )


def test_a_definition_of_the_recording_with_another_hash_is_used() -> None:
    recorded = topic("int8 a\n", type_hash=POINT_HASH)
    bag = types(recorded)
    schema = bag.schema(recorded)
    assert bag.warnings == [
        f"my_msgs/msg/Track was recorded with the type hash {POINT_HASH}, but has {schema.type_hash} with the "
        "definition in the recording, which is used"
    ]


def test_what_is_missing_in_a_definition_is_looked_for_elsewhere() -> None:
    recorded = topic(TRACK)
    bag = types(recorded, distro="jazzy")
    assert bag.origin(recorded) == "the recording, embedded store jazzy"
    assert len(bag.warnings) == 1
    known = topic(TRACK, type_hash=bag.schema(recorded).type_hash)
    bag = types(known, distro="jazzy")
    assert bag.schema(known).type_hash == known.type_hash
    assert bag.warnings == []


def test_missing_definition() -> None:
    missing = topic(type_name="robot/msg/Track")
    fine = topic("int8 a\n", "my_msgs/msg/Other")
    bag = types(missing, fine, distro="jazzy")
    bag.schema(fine)
    with pytest.raises(BagError) as caught:
        bag.schema(missing)
    assert str(caught.value) == (
        "topic /track (robot/msg/Track): package 'robot' was not found; looked in the recording, embedded store jazzy "
        "(messages only); give the folder of its package with --include FOLDER, or the distribution it is from with "
        "--distro"
    )


def test_definition_of_another_topic() -> None:
    bare, defined = topic(name="/bare"), topic("int8 a\n")
    bag = types(bare, defined)
    assert bag.schema(bare).type_hash == bag.schema(defined).type_hash
    assert bag.warnings == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "flot64 x\n",
            f"{TOPIC}my_msgs/msg/flot64 was not found, but my_msgs/msg/Track.x (definition of topic /track: MSG "
            "my_msgs/msg/Track:1:8) needs it\nlooked in the recording, embedded store jazzy (messages only); give the "
            "folder of its package with --include FOLDER, or the distribution it is from with --distro",
        ),
        (
            "int8 x y\n",
            f"{TOPIC}definition of topic /track: MSG my_msgs/msg/Track:1:8: expected a whole number from -128 to 127, "
            "not 'y'\n  int8 x y\n         ^",
        ),
        (
            f"Track a\n{RULE}\nMSG: my_msgs/Other\nint8 a\n",
            f"{TOPIC}a message cannot contain itself: my_msgs/msg/Track.a (definition of topic /track: MSG "
            "my_msgs/msg/Track:1:7)",
        ),
        (
            "".join(f"T{n + 1} t\n{RULE}\nMSG: my_msgs/T{n + 1}\n" for n in range(200)) + "int8 a\n",
            f"{TOPIC}my_msgs/msg/T100.t (definition of topic /track: MSG my_msgs/msg/T100:1:6) nests messages more "
            "than 100 deep, which protobuf does not read; flatten my_msgs/msg/T101 or what is in it",
        ),
        (
            "float64[99999999999] x\n",
            f"{TOPIC}my_msgs/msg/Track.x (definition of topic /track: MSG my_msgs/msg/Track:1:22): the length of an "
            "array must be at most 4294967295, since ROS sends no more, not 99999999999",
        ),
    ],
)
def test_what_is_wrong_in_a_definition(text: str, message: str) -> None:
    assert refused(topic(text), distro="jazzy") == message


def test_other_encodings_count_as_none() -> None:
    for encoding in ("", "unknown", "jsonschema"):
        recorded = topic(
            type_name="std_msgs/msg/String", definition=RecordedDefinition(encoding, b"nonsense")
        )
        assert types(recorded, distro="jazzy").origin(recorded) == "embedded store jazzy"


def test_text_without_fields() -> None:
    blank = topic("\n", "std_msgs/msg/String")
    assert types(blank, distro="jazzy").origin(blank) == "embedded store jazzy"
    unknown = topic("\n")
    assert types(unknown).origin(unknown) == "the recording"
    empty = topic("", "std_msgs/msg/Empty")
    known = topic("", type_hash=types(unknown).schema(unknown).type_hash)
    assert types(known).schema(known).type_hash == known.type_hash
    assert types(empty).schema(empty).message_class().ByteSize() == 0


def test_service_events() -> None:
    event = topic("int8 a\n---\nfloat32 b\n", "my_msgs/srv/Find_Event", name="/find/_service_event")
    bag = types(event, distro="jazzy")
    schema = bag.schema(event)
    message = schema.message_class()
    message.request.add().a = 5  # type: ignore[attr-defined]
    transcoder = Transcoder(schema.type_description, schema.descriptor)
    data = message.SerializeToString()
    assert transcoder.cdr_to_proto(transcoder.proto_to_cdr(data)) == data or message.request[0].a == 5  # type: ignore[attr-defined]
    known = topic(type_name="my_msgs/srv/Find_Event", definition=event.definition, type_hash=schema.type_hash)
    assert types(known, distro="jazzy").schema(known).type_hash == schema.type_hash
    found = types(event, distro="jazzy").recorded_types()
    assert found.types == tuple(found.definitions) == (TypeName("my_msgs", "srv", "Find"),)


def test_unknown_folder_and_distribution(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="there is no file or folder"):
        types(include=[tmp_path / "nowhere"])


def in_protobuf(recorded: Topic, bag: BagTypes) -> Topic:
    schema = bag.schema(recorded)
    return Topic(
        recorded.name,
        recorded.type_name,
        PROTOBUF,
        protobuf_definition(schema),
        bag.ros_definition(recorded),
        schema.descriptor.full_name,
        recorded.type_hash,
    )


def test_there_and_back() -> None:
    recorded = topic(TRACK + HEADER)
    bag = types(recorded)
    converted = in_protobuf(recorded, bag)
    assert converted.ros_definition == recorded.definition
    back = types(converted)
    assert back.schema(converted).message_class is bag.schema(recorded).message_class
    assert back.ros_definition(converted) == recorded.definition
    files = FileDescriptorSet.FromString(converted.definition.data).file
    assert [each.name for each in files] == [
        "my_msgs/msg/Point.proto",
        "builtin_interfaces/msg/Time.proto",
        "std_msgs/msg/Header.proto",
        "my_msgs/msg/Track.proto",
    ]


SMALL = "int8 level\nint8[] levels\nwstring name\nfloat64 value\n"


def told(data: bytes) -> dict[str, int]:
    """Return the fields whose options tell the ROS type, which `descriptor.proto` does not know."""
    (file,) = FileDescriptorSet.FromString(data).file
    options = {each.name: each.options.SerializeToString() for each in file.message_type[0].field}
    assert all(each[:-1] in (b"", b"\xaa\xc7\x21\x01") for each in options.values())
    return {name: each[-1] for name, each in options.items() if each}


def test_a_recording_tells_what_protobuf_does_not() -> None:
    recorded = topic(SMALL)
    schema = types(recorded).schema(recorded)
    assert told(protobuf_definition(schema).data) == {"level": 2, "levels": 2, "name": 18}
    assert told(descriptor_set(schema.descriptor)) == {}


def test_a_recording_need_not_tell_what_protobuf_does_not() -> None:
    recorded = topic(SMALL)
    bag = types(recorded)
    plain = RecordedDefinition(PROTOBUF, descriptor_set(bag.schema(recorded).descriptor))
    converted = Topic(**{**vars(in_protobuf(recorded, bag)), "definition": plain})
    assert types(converted).schema(converted).message_class is bag.schema(recorded).message_class


def test_definitions_that_were_not_recorded(tmp_path: Path) -> None:
    folder = package(tmp_path / "src", Track=TRACK.partition(RULE)[0], Point="float64 x\nfloat64 y")
    recorded = topic()
    bag = types(recorded, include=[folder], distro="jazzy")
    definition = ros_definition(bag.schema(recorded))
    assert definition == bag.ros_definition(recorded) == ros_definition(bag.schema(recorded))
    assert definition.encoding == "ros2msg"
    assert definition.data.decode() == TRACK + HEADER.replace("int32", "int32")
    again = topic(definition.data.decode())
    assert types(again).schema(again).type_hash == bag.schema(recorded).type_hash
    assert types(again).ros_definition(again) == definition


def numbered(data: bytes) -> bytes:
    """Return a descriptor set with other field numbers."""
    files = FileDescriptorSet.FromString(data)
    for file in files.file:
        for message in file.message_type:
            del message.reserved_range[:], message.reserved_name[:]
            for number, field in enumerate(message.field, 1):
                field.number = number
    return files.SerializeToString()


def test_other_numbers_in_the_recording() -> None:
    recorded = topic(TRACK + HEADER)
    bag = types(recorded)
    converted = in_protobuf(recorded, bag)
    other = Topic(
        **{**vars(converted), "definition": RecordedDefinition(PROTOBUF, numbered(converted.definition.data))}
    )
    schema = types(other).schema(other)
    assert [each.number for each in schema.descriptor.fields] == [1, 2]
    assert types(other).message_class(other) is schema.message_class
    message = schema.message_class()
    message.points.add(x=1.5, y=2.5)  # type: ignore[attr-defined]
    cdr = Transcoder(schema.type_description, schema.descriptor).proto_to_cdr(message.SerializeToString())
    ours = bag.schema(recorded)
    data = Transcoder(ours.type_description, ours.descriptor).cdr_to_proto(cdr)
    assert ours.message_class.FromString(bytes(data)).points[0].y == 2.5  # type: ignore[attr-defined]


def test_ros_type_by_the_name_of_the_message() -> None:
    bag = types(distro="jazzy")
    header = topic(type_name="std_msgs/msg/Header")
    converted = in_protobuf(header, bag)
    bare = Topic(
        "/a", "std_msgs.msg.pb.Header", PROTOBUF, converted.definition, schema_name="std_msgs.msg.pb.Header"
    )
    assert types(bare, distro="jazzy").schema(bare).type_name == "std_msgs/msg/Header"


CLOUD = FileDescriptorProto(
    name="foxglove/PointCloud.proto",
    package="foxglove",
    syntax="proto3",
    dependency=["foxglove/Vector.proto"],
)
CLOUD.message_type.add(name="PointCloud").field.add(
    name="origin",
    number=1,
    type=FieldDescriptorProto.TYPE_MESSAGE,
    label=FieldDescriptorProto.LABEL_OPTIONAL,
    type_name=".foxglove.Vector",
)
VECTOR = FileDescriptorProto(name="foxglove/Vector.proto", package="foxglove", syntax="proto3")
VECTOR.message_type.add(name="Vector").field.add(
    name="x", number=3, type=FieldDescriptorProto.TYPE_DOUBLE, label=FieldDescriptorProto.LABEL_OPTIONAL
)


def cloud(*files: FileDescriptorProto | bytes, name: str = "foxglove.PointCloud") -> Topic:
    data = b"".join(
        each if isinstance(each, bytes) else FileDescriptorSet(file=[each]).SerializeToString()
        for each in files
    )
    return Topic("/cloud", name, PROTOBUF, RecordedDefinition(PROTOBUF, data), schema_name=name)


def test_protobuf_messages_of_others_are_read() -> None:
    for recorded in (cloud(VECTOR, CLOUD), cloud(CLOUD, VECTOR)):
        message = types(recorded).message_class(recorded)()
        message.origin.x = 1.5  # type: ignore[attr-defined]
        assert message.SerializeToString().hex() == "0a0919000000000000f83f"
        assert refused(recorded) == (
            "topic /cloud (foxglove.PointCloud): its messages are protobuf messages of no ROS type: they can be read, "
            "but not converted"
        )
        assert types(recorded).recorded_types() == ({}, ())


def test_messages_with_maps_and_well_known_types() -> None:
    file = FileDescriptorProto(
        name="a.proto", package="a", syntax="proto3", dependency=["google/protobuf/timestamp.proto"]
    )
    message = file.message_type.add(name="A")
    entry = message.nested_type.add(name="TimesEntry")
    entry.options.map_entry = True
    single, many = FieldDescriptorProto.LABEL_OPTIONAL, FieldDescriptorProto.LABEL_REPEATED
    text, nested = FieldDescriptorProto.TYPE_STRING, FieldDescriptorProto.TYPE_MESSAGE
    entry.field.add(name="key", number=1, label=single, type=text)
    entry.field.add(name="value", number=2, label=single, type=nested, type_name=".google.protobuf.Timestamp")
    message.field.add(name="times", number=1, label=many, type=nested, type_name=".a.A.TimesEntry")
    message.field.add(name="inner", number=2, label=single, type=nested, type_name=".a.A")
    timestamp = FileDescriptorProto.FromString(timestamp_pb2.DESCRIPTOR.serialized_pb)
    recorded = cloud(file, timestamp, name="a.A")
    read: Any = types(recorded).message_class(recorded)()
    read.inner.times["x"].FromJsonString("1970-01-01T00:00:05Z")
    assert read.inner.times["x"].seconds == 5


def changed(file: FileDescriptorProto, **values: Any) -> FileDescriptorProto:
    copy = FileDescriptorProto.FromString(file.SerializeToString())
    copy.MergeFrom(FileDescriptorProto(**values))
    return copy


@pytest.mark.parametrize(
    ("recorded", "message"),
    [
        (cloud(b"\xff"), "its protobuf descriptor is damaged: .*"),
        (cloud(VECTOR, VECTOR), "its protobuf descriptor has two files of the same name"),
        (cloud(b"\n\3\n\1\x80"), "its protobuf descriptor has a file whose name is not UTF-8"),
        (
            cloud(CLOUD),
            "its protobuf descriptor has no file 'foxglove/Vector.proto', which 'foxglove/PointCloud.proto' imports",
        ),
        (
            cloud(changed(VECTOR, dependency=["foxglove/PointCloud.proto"]), CLOUD),
            "files of its protobuf descriptor import each other: foxglove/Vector.proto, foxglove/PointCloud.proto",
        ),
        (cloud(VECTOR), "its protobuf descriptor has no message 'foxglove.PointCloud'"),
        (
            cloud(changed(VECTOR, syntax="proto9")),
            "protobuf does not take the file 'foxglove/Vector.proto' of its descriptor: .*",
        ),
        (cloud(b""), "the recording has no protobuf descriptor of foxglove.PointCloud"),
        (cloud(bytes(2**24 + 1)), "its protobuf descriptor has more than 16777216 bytes"),
    ],
)
def test_descriptors_that_are_none(recorded: Topic, message: str) -> None:
    with pytest.raises(BagError) as caught:
        types(recorded).message_class(recorded)
    assert re.fullmatch(rf"topic /cloud \(foxglove.PointCloud\): {message}", str(caught.value)), caught.value


def test_a_descriptor_that_does_not_fit_the_ros_type() -> None:
    recorded = Topic(
        **{**vars(cloud(VECTOR, name="foxglove.Vector")), "type_name": "geometry_msgs/msg/Vector3"}
    )
    assert refused(recorded, distro="jazzy") == (
        "topic /cloud (geometry_msgs/msg/Vector3): its protobuf descriptor does not fit its ROS definition: "
        "geometry_msgs/msg/Vector3.y: foxglove.Vector does not have this field; --include FOLDER gives another one"
    )


def test_messages_that_only_the_user_calls_protobuf_have_the_numbers_of_generated_code() -> None:
    labelled = topic(TRACK + HEADER)
    said = topic(TRACK + HEADER, serialization_format=PROTOBUF)
    bag = types(said)
    assert bag.schema(said).descriptor is types(labelled).schema(labelled).descriptor
    assert bag.ros_definition(said) == labelled.definition
    assert bag.warnings == [
        "my_msgs/msg/Track: the recording has no protobuf descriptor; the one that `generate` makes is used"
    ]


def test_the_version_that_was_recorded_is_found_by_its_hash() -> None:
    """`sensor_msgs/msg/Range` has another field since Iron."""
    old = Catalog((store_source("humble"),)).hash(TypeName.parse("sensor_msgs/msg/Range"))
    recorded = topic(type_name="sensor_msgs/msg/Range", type_hash=old)
    bag = types(recorded, distro="jazzy")
    schema = bag.schema(recorded)
    assert schema.type_hash == old and "variance" not in schema.descriptor.fields_by_name
    assert bag.warnings == [] and "embedded store" in bag.origin(recorded)


def test_topics_that_are_not_of_ros_are_not_generated() -> None:
    recorded = topic(TRACK + HEADER), Topic("/json", "", "json"), cloud(VECTOR, CLOUD)
    assert types(*recorded).recorded_types().types == (TypeName("my_msgs", "msg", "Track"),)


@pytest.fixture
def elsewhere() -> Catalog:
    return find_catalog((), None)


@pytest.fixture
def whole(elsewhere: Catalog) -> Topic:
    return in_protobuf(topic(TRACK + HEADER), types(elsewhere=elsewhere))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_garbage(elsewhere: Catalog, whole: Topic, data: st.DataObject) -> None:
    content = bytearray(whole.definition.data)
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content)))
        content[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    damaged = Topic(**{**vars(whole), "definition": RecordedDefinition(PROTOBUF, bytes(content))})
    try:
        schema = types(damaged, elsewhere=elsewhere).schema(damaged)
        Transcoder(schema.type_description, schema.descriptor)
    except (BagError, SchemaError):
        pass


ROS1 = f"""\
Header header
geometry_msgs/Point point
duration[] ages
byte level
{RULE}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
{RULE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
"""


def test_ros1() -> None:
    recorded = topic(definition=RecordedDefinition("ros1msg", ROS1.encode()), serialization_format="ros1")
    bag = types(recorded)
    schema = bag.schema(recorded)
    message = schema.message_class()
    message.header.seq = 5  # type: ignore[attr-defined]
    message.header.stamp.sec = 7  # type: ignore[attr-defined]
    assert bag.warnings == []
    converted = in_protobuf(recorded, bag)
    assert converted.ros_definition == recorded.definition
    assert types(converted).schema(converted).message_class is schema.message_class
    # What ROS 2 has of the header has the same numbers, and is not mistaken for that of ROS 1.
    header = types(recorded).schema(topic(type_name="std_msgs/msg/Header")).message_class
    assert "seq" not in header.DESCRIPTOR.fields_by_name
    assert header.FromString(message.header.SerializeToString()).stamp.sec == 7  # type: ignore[attr-defined]


def test_rosbags_reads_the_definitions() -> None:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = Catalog((store_source("jazzy"),))
    registry = TypeRegistry(store)
    for name in registry:
        text = ros_definition(registry[name]).data.decode()
        if "char" in text.split() or "char[" in text:  # rosbags takes it for another type
            continue
        typestore = get_typestore(Stores.EMPTY)
        typestore.register(get_types_from_msg(text, name))
        assert typestore.hash_rihs01(name) == registry[name].type_hash, name
