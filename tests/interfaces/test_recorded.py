from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import type_closure
from rosidl_adapter_proto.interfaces.description import describe, individual_description
from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source
from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    Field,
    FieldType,
    Message,
    SequenceType,
    StringType,
    TypeName,
    references,
    value_type,
)
from rosidl_adapter_proto.interfaces.recorded import (
    MAXIMUM_DEFINITIONS,
    MAXIMUM_SIZE,
    described_text,
    recorded_definitions,
    recorded_source,
    recorded_text,
)
from tests import oracle

RULE = "=" * 80
TRACK = f"""\
std_msgs/Header header
Point[] points
{RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
{RULE}
MSG: my_msgs/Point
float64 x
float64 y
"""


def read(text: str | bytes, type_name: str = "my_msgs/msg/Track", encoding: str = "ros2msg") -> Catalog:
    data = text.encode() if isinstance(text, str) else text
    definitions = recorded_definitions(data, encoding, type_name, "a.mcap")
    return Catalog((recorded_source(definitions), store_source()))


def hash_of(text: str, type_name: str = "my_msgs/msg/Track", encoding: str = "ros2msg") -> str:
    return read(text, type_name, encoding).hash(TypeName.parse(type_name))


def names(text: str, type_name: str = "my_msgs/msg/Track", encoding: str = "ros2msg") -> list[str]:
    return [str(each) for each in recorded_definitions(text.encode(), encoding, type_name, "a.mcap")]


def fields(catalog: Catalog, name: str) -> list[tuple[str, str]]:
    message = catalog.message(TypeName.parse(name))
    types = (value_type(each.type) for each in message.fields)
    return [
        (each.name, type.name if isinstance(type, BasicType) else str(type))
        for each, type in zip(message.fields, types, strict=True)
    ]


WAYS = [
    TRACK,
    TRACK.rstrip("\n"),
    TRACK.replace("\n", "\r\n"),
    TRACK.replace(RULE, f"\n{RULE}"),  # as rosbag2 has it since Jazzy
    TRACK.replace("MSG: my_msgs/Point", "MSG: my_msgs/msg/Point"),
    TRACK.replace("MSG: my_msgs/Point", "MSG: Point"),
    TRACK.replace("Point[]", "my_msgs/Point[]"),
    TRACK.replace("Point[]", "my_msgs/msg/Point[]"),
    TRACK.replace("std_msgs/Header header", "Header header"),
    TRACK.replace("builtin_interfaces/Time stamp", "time stamp"),
    TRACK.replace("float64 x", "  float64 x # where it is, in C:\\unknown"),
    TRACK + TRACK[TRACK.index(RULE) :],  # the same ones again, as rosbag2 of Humble has them
    f"{RULE}\nMSG: my_msgs/Track\n{TRACK}",
    f"\ufeff{TRACK}",
    TRACK.replace("string frame_id", "string frame_id # K\xf6ln"),
]
"""Ways to write the definition of the same type."""


@pytest.mark.parametrize("text", WAYS)
def test_ways_to_write_the_same_type(text: str) -> None:
    assert hash_of(text) == hash_of(TRACK)
    expected = [
        "my_msgs/msg/Track",
        "std_msgs/msg/Header",
        "builtin_interfaces/msg/Time",
        "my_msgs/msg/Point",
    ]
    assert names(text) == expected


def test_text_that_is_not_utf_8() -> None:
    catalog = read(b"int32 a # K\xf6ln\n")
    assert catalog.definition(TypeName("my_msgs", "msg", "Track")).text == "int32 a # K\ufffdln\n"


def test_a_message_of_no_fields_has_no_text() -> None:
    assert hash_of("", "std_msgs/msg/Empty") == hash_of("\n\n", "std_msgs/msg/Empty")
    text = f"Nothing[] nothing\n{RULE}\nMSG: my_msgs/Nothing\n{RULE}\nMSG: my_msgs/Other\nint8 a\n"
    catalog = read(text)
    assert fields(catalog, "my_msgs/msg/Nothing") == [("structure_needs_at_least_one_member", "uint8")]


def test_header_of_the_same_package() -> None:
    catalog = read(f"Header header\n{RULE}\nMSG: my_msgs/Header\nint8 a\n")
    assert fields(catalog, "my_msgs/msg/Track") == [("header", "my_msgs/msg/Header")]
    catalog = read("Header header\n")
    assert fields(catalog, "my_msgs/msg/Track") == [("header", "std_msgs/msg/Header")]


def test_a_line_of_the_rule_alone_divides_nothing() -> None:
    catalog = read(f"# {RULE}\n#{RULE}\n{RULE[:-1]}\nMSG: my_msgs/Point\n")
    with pytest.raises(
        DefinitionError, match=r"^a.mcap: MSG my_msgs/msg/Track:3:1: expected a type and a name"
    ):
        catalog.message(TypeName("my_msgs", "msg", "Track"))


IDL_POINT = """\
module my_msgs { module msg { struct Point { double x; double y; }; }; };
"""
IDL_TRACK = f"""\
{RULE}
IDL: my_msgs/msg/Track
#include "my_msgs/msg/Point.idl"
module my_msgs {{ module msg {{ struct Track {{ sequence<my_msgs::msg::Point> points; }}; }}; }};

{RULE}
IDL: my_msgs/msg/Point
{IDL_POINT}"""
POINT_IN_MSG = f"{RULE}\nMSG: my_msgs/Point\nfloat64 x\nfloat64 y\n"
MIXED = IDL_TRACK.replace(f"{RULE}\nIDL: my_msgs/msg/Point\n{IDL_POINT}", POINT_IN_MSG)


def test_idl_in_any_order_and_beside_msg() -> None:
    expected = hash_of(f"Point[] points\n{POINT_IN_MSG}")
    assert POINT_IN_MSG in MIXED
    own, point = IDL_TRACK.split("\n\n")
    assert hash_of(IDL_TRACK, encoding="ros2idl") == expected
    assert hash_of(f"{point}\n{own}\n", encoding="ros2idl") == expected
    assert (
        hash_of(f"{own}\n{RULE}\nMSG: my_msgs/Point\nfloat64 x\nfloat64 y\n", encoding="ros2idl") == expected
    )
    assert hash_of(own.split("\n", 2)[2] + "\n" + point, encoding="ros2idl") == expected


def test_services_and_actions_as_rosbag2_writes_them() -> None:
    # It looks for a .msg first, and has written the delimiter when there is none.
    empty = f"{RULE}\nMSG: my_msgs/Point\n{RULE}\nIDL: my_msgs/Point\n{IDL_POINT}"
    service = f"{RULE}\nSRV: my_msgs/srv/Find\nint8 a\n---\nPoint point\n\n{empty}"
    event = read(service, "my_msgs/srv/Find_Event", "ros2idl")
    assert fields(event, "my_msgs/srv/Find_Event") == [
        ("info", "service_msgs/msg/ServiceEventInfo"),
        ("request", "my_msgs/srv/Find_Request"),
        ("response", "my_msgs/srv/Find_Response"),
    ]
    assert fields(event, "my_msgs/msg/Point") == [("x", "double"), ("y", "double")]
    action = f"{RULE}\nACTION: my_msgs/action/Go\nint8 a\n---\nint8 b\n---\nint8 c\n"
    for part in ("FeedbackMessage", "SendGoal_Event", "GetResult_Event"):
        catalog = read(action, f"my_msgs/action/Go_{part}")
        assert catalog.definition(TypeName("my_msgs", "action", f"Go_{part}")).format == ".action"
    feedback = [("goal_id", "unique_identifier_msgs/msg/UUID"), ("feedback", "my_msgs/action/Go_Feedback")]
    assert fields(catalog, "my_msgs/action/Go_FeedbackMessage") == feedback


def test_service_without_a_delimiter() -> None:
    # The hash of a recording of rosbag2's own tests.
    part = "".join(
        f"{name} {name}_value\n"
        for name in (
            *("bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16"),
            *("int32", "uint32", "int64", "uint64", "string"),
        )
    )
    expected = "RIHS01_5b9988a4805a06ae22dff12903a774ccda710e9514926b826ffc884e3a9a982e"
    assert hash_of(f"{part}---\n{part}", "test_msgs/srv/BasicTypes_Event") == expected


ROS1 = f"""\
# all that is other than in ROS 2
Header header
Child[2] children
time stamp
duration[] times
byte small
char letter
\tfloat64 camelCase   # a comment with = and \\x
string NAME=it's "quoted" # and this is no comment\t
string   Empty=
int32 LIMIT = 5 # a comment
bool Yes=True
byte LOWEST=-128
{RULE}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id

{RULE}
MSG: my_msgs/Child
uint8[] data
"""


def test_ros1() -> None:
    catalog = read(ROS1, "my_msgs/Track", "ros1msg")
    time, duration = "builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"
    assert fields(catalog, "my_msgs/msg/Track") == [
        ("header", "std_msgs/msg/Header"),
        ("children", "my_msgs/msg/Child"),
        ("stamp", time),
        ("times", duration),
        ("small", "int8"),
        ("letter", "uint8"),
        ("camelCase", "double"),
    ]
    message = catalog.message(TypeName("my_msgs", "msg", "Track"))
    assert {each.name: each.value for each in message.constants} == {
        "NAME": 'it\'s "quoted" # and this is no comment',
        "Empty": "",
        "LIMIT": 5,
        "Yes": True,
        "LOWEST": -128,
    }
    assert fields(catalog, "std_msgs/msg/Header")[:2] == [("seq", "uint32"), ("stamp", time)]


@pytest.mark.parametrize(
    ("text", "type_name", "encoding", "message"),
    [
        (
            "int8 a",
            "Track",
            "ros2msg",
            "a.mcap: 'Track' is not the name of a ROS type, such as 'sensor_msgs/msg/Imu'",
        ),
        (
            "int8 a",
            "a/b/C",
            "ros2msg",
            "a.mcap: 'a/b/C' is not the name of a ROS type, such as 'sensor_msgs/msg/Imu'",
        ),
        (
            f"{RULE}\nMSG: a/msg/b/C\n",
            "a/msg/B",
            "ros2msg",
            "a.mcap: 'a/msg/b/C' is not the name of a ROS type, such as 'sensor_msgs/msg/Imu'",
        ),
        (
            f"{RULE}\nMSG: a/B\nint8 a\n{RULE}\nMSG: a/B\nint8 b\n",
            "a/msg/B",
            "ros2msg",
            "a.mcap: a/msg/B is defined twice, not in the same way",
        ),
        (
            "{}",
            "a/msg/B",
            "jsonschema",
            "a.mcap: definitions with the encoding 'jsonschema' are not known, only ros2msg, ros2idl, ros1msg",
        ),
        (
            " " * (MAXIMUM_SIZE + 1),
            "a/msg/B",
            "ros2msg",
            "a.mcap: the definition has more than 4194304 bytes",
        ),
        (
            "".join(f"{RULE}\nMSG: a/B{number}\n" for number in range(MAXIMUM_DEFINITIONS + 1)),
            "a/msg/B0",
            "ros2msg",
            "a.mcap: the definition has more than 10000 types",
        ),
    ],
)
def test_what_is_refused(text: str, type_name: str, encoding: str, message: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        read(text, type_name, encoding)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("text", "encoding", "message"),
    [
        (
            f"Point a\n{RULE}\nMSG: my_msgs/Point\nfloat64 x\nTrack track\n",
            "ros2msg",
            "messages cannot contain each other:\n"
            "  my_msgs/msg/Track.a (a.mcap: MSG my_msgs/msg/Track:1:7) is a my_msgs/msg/Point\n"
            "  my_msgs/msg/Point.track (a.mcap: MSG my_msgs/msg/Point:2:7) is a my_msgs/msg/Track",
        ),
        (
            f"Point a\n{RULE}\nMSG: my_msgs/Point\nfloat64 x\nfloat64 x\n",
            "ros2msg",
            "a.mcap: MSG my_msgs/msg/Point:2:9: 'x' is defined twice, first in line 1\n  float64 x\n          ^",
        ),
        (
            IDL_TRACK.replace("double y", "double [y"),
            "ros2idl",
            "a.mcap: IDL my_msgs/msg/Point:1:63: expected a name before '['",
        ),
    ],
)
def test_what_is_wrong_in_a_definition_has_its_place(text: str, encoding: str, message: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        type_closure(read(text, encoding=encoding), TypeName("my_msgs", "msg", "Track"))
    assert str(caught.value).startswith(message)


@given(st.data())
def test_garbage(data: st.DataObject) -> None:
    text, encoding = data.draw(
        st.sampled_from([(TRACK, "ros2msg"), (IDL_TRACK, "ros2idl"), (ROS1, "ros1msg")])
    )
    content = bytearray(text.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content)))
        end = at + data.draw(st.integers(0, 20))
        content[at:end] = data.draw(
            st.sampled_from(
                [b"", b"\n", b"\0", b"\xff", RULE.encode(), b"MSG: ", b"Track", b"[9]", b"=", b"#", b"int8 a"]
            )
        )
    name = TypeName("my_msgs", "msg", "Track")
    try:
        catalog = read(bytes(content), str(name), encoding)
        type_closure(catalog, name)
        catalog.hash(name)
    except DefinitionError:
        pass


def with_dependencies(path: Path, suffix: str, seen: set[TypeName]) -> Iterator[tuple[str, str]]:
    """Yield a definition and those that it refers to, in the order of rosbag2."""
    yield str(oracle.type_name(path)), path.read_text(encoding="utf-8")
    for each in dependencies(path):
        if each not in seen:
            seen.add(each)
            yield from with_dependencies(Path(sys.prefix, "share", f"{each}{suffix}"), suffix, seen)


@cache
def dependencies(path: Path) -> list[TypeName]:
    name = oracle.type_name(path)
    interface = Catalog(tuple(prefix_sources())).definition(name).interface
    assert isinstance(interface, Message)
    return list(dict.fromkeys(each for _, each in references(interface)))


def recorded(path: Path, kind: str) -> str:
    found = list(with_dependencies(path, path.suffix, {oracle.type_name(path)}))
    texts = [
        f"{RULE}\n{kind}: {name.replace('/msg/', '/') if kind == 'MSG' else name}\n{text}\n"
        for name, text in found
    ]
    return "".join([found[0][1] + "\n", *texts[1:]] if kind == "MSG" else texts)


def installed_messages(suffix: str) -> list[Path]:
    found = oracle.installed_definitions(suffix)
    return [each for each in found if each.parts[-2] == "msg" and each.with_suffix(".json").exists()]


def installed_hash(path: Path) -> str:
    description = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    hashes = {each["type_name"]: each["hash_string"] for each in description["type_hashes"]}
    return str(hashes[str(oracle.type_name(path))])


def test_every_installed_message_has_its_hash(ros_prefix: object) -> None:
    found = installed_messages(".msg")
    assert len(found) > 150
    for path in found:
        assert hash_of(recorded(path, "MSG"), str(oracle.type_name(path))) == installed_hash(path), path


def test_every_installed_idl_has_its_hash(ros_prefix: object) -> None:
    for path in installed_messages(".idl"):
        assert hash_of(recorded(path, "IDL"), str(oracle.type_name(path)), "ros2idl") == installed_hash(
            path
        ), path


@pytest.mark.parametrize("suffix", [".srv", ".action"])
def test_every_part_of_services_and_actions_has_its_hash(suffix: str, ros_prefix: object) -> None:
    installed = Catalog(tuple(prefix_sources()))
    paths = [each for each in oracle.installed_definitions(suffix) if each.with_suffix(".json").exists()]
    assert paths
    for path in paths:
        needed = type_closure(installed, oracle.type_name(path))
        _, text = recorded_text({each: installed.definition(each) for each in reversed(needed)})
        described = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))["type_hashes"]
        own = f"{path.parts[-3]}/{path.parts[-2]}/{path.stem}"
        for each in described:
            if each["type_name"].startswith(own):
                assert hash_of(text.decode(), each["type_name"]) == each["hash_string"]


@pytest.mark.parametrize("distribution", ["humble", "noetic"])
def test_every_message_as_rosbags_writes_it(distribution: str) -> None:
    from rosbags.typesys import Stores, get_typestore

    is_ros1 = distribution == "noetic"
    version = 1 if is_ros1 else 2
    typestore = get_typestore(Stores(f"ros{version}_{distribution}"))
    embedded = Catalog((store_source(distribution),))
    for name in typestore.fielddefs:
        text, _ = typestore.generate_msgdef(name, ros_version=version)
        catalog = read(text, name, "ros1msg" if is_ros1 else "ros2msg")
        assert catalog.hash(TypeName.parse(name)) == embedded.hash(TypeName.parse(name)), name


@pytest.mark.parametrize(
    ("text", "type_name", "encoding"),
    [
        (TRACK, "my_msgs/msg/Track", "ros2msg"),
        (ROS1, "my_msgs/msg/Track", "ros1msg"),
        (IDL_TRACK, "my_msgs/msg/Track", "ros2idl"),
        (MIXED, "my_msgs/msg/Track", "ros2idl"),
        ("int8 a\n---\nint8 b\n", "my_msgs/srv/Find", "ros2msg"),
    ],
)
def test_written_again(text: str, type_name: str, encoding: str) -> None:
    definitions = recorded_definitions(text.encode(), encoding, type_name, "a.mcap")
    written_encoding, written = recorded_text(definitions)
    assert written_encoding == encoding
    again = recorded_definitions(written, encoding, type_name, "a.mcap")
    assert list(again.values()) == list(definitions.values())
    assert recorded_text(again) == (encoding, written)


def test_every_embedded_message_is_written_of_its_description() -> None:
    embedded = Catalog((store_source(),))
    names = [name for package in embedded.packages for name in embedded.package(package)]
    assert len(names) > 150
    for name in names:
        text = described_text(embedded.describe(name)).decode()
        assert hash_of(text, str(name)) == embedded.hash(name), name


@pytest.mark.parametrize(
    ("field_type", "text"),
    [
        (StringType(bound=10), "string<=10"),
        (SequenceType(StringType(wide=True, bound=10), 5), "wstring<=10[<=5]"),
        (ArrayType(BasicType("boolean"), 3), "bool[3]"),
        (BasicType("octet"), "byte"),
        (SequenceType(BasicType("char")), "uint8[]"),
        (BasicType("wchar"), "uint16"),
        (TypeName("test_msgs", "srv", "Empty_Request"), "test_msgs/Empty_Request"),
    ],
)
def test_types_of_described_fields(field_type: FieldType, text: str) -> None:
    name = TypeName("my_msgs", "msg", "Track")
    description = individual_description(Message(name, (Field("a", field_type), Field("b", field_type))))
    whole = described_text({"type_description": description, "referenced_type_descriptions": []})
    assert whole.decode() == f"{text} a\n{text} b\n"


def test_the_description_of_a_request_without_fields_has_a_name() -> None:
    name = TypeName("std_srvs", "srv", "Trigger_Request")
    fields = (Field("structure_needs_at_least_one_member", BasicType("uint8")),)
    text = described_text(describe(name, {name: Message(name, fields)}.__getitem__))
    assert text.decode() == f"{RULE}\nMSG: std_srvs/srv/Trigger_Request\n"


def test_a_described_long_double_is_no_msg() -> None:
    name = TypeName("my_msgs", "msg", "Track")
    message = Message(name, (Field("a", ArrayType(BasicType("long double"), 2)),))
    with pytest.raises(
        DefinitionError, match=r"^my_msgs/msg/Track\.a: no \.msg definition can have a long double$"
    ):
        described_text(describe(name, {name: message}.__getitem__))
