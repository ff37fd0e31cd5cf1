"""Messages as ROS 1 serializes them: what rosbags writes is read, and what ROS 2 does not have is an error."""

from __future__ import annotations

import functools
import random
import struct
from typing import Any

import numpy
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference_cdr import write_ros1
from ros_types import (
    NUMBER_FORMATS,
    Types,
    Value,
    element_name,
    nasty_types,
    protobuf_message,
    random_value,
    same_message,
    shape,
    struct_type,
    transcoder,
)

from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from rosidl_adapter_proto.schema.registry import TypeRegistry
from rosidl_adapter_proto.transcode import TranscodeError

VALUES = 5
TIMES = {
    **struct_type("builtin_interfaces/msg/Time", sec="int32", nanosec="uint32"),
    **struct_type("builtin_interfaces/msg/Duration", sec="int32", nanosec="uint32"),
    **struct_type(
        "test/msg/Times", at="builtin_interfaces/msg/Time", took="builtin_interfaces/msg/Duration[]"
    ),
}
OTHER_TYPE = "the data is damaged or of another type"


@functools.cache
def typestore() -> Any:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS1_NOETIC)


@functools.cache
def noetic() -> TypeRegistry:
    return TypeRegistry(Catalog((store_source("noetic"),)))


def types_of(name: str) -> Types:
    description: Any = noetic()[name].type_description
    parts = (description["type_description"], *description["referenced_type_descriptions"])
    return {each["type_name"]: each for each in parts}


def in_both(types: Types, name: str, value: Value) -> Value:
    """Return a value whose times and durations are in ROS 1 and in ROS 2."""
    result = dict(value)
    for field in types[name]["fields"]:
        nested, content = field["type"]["nested_type_name"], value[field["name"]]
        if nested and shape(field) == "single":
            result[field["name"]] = in_both(types, nested, content)
        elif nested:
            result[field["name"]] = [in_both(types, nested, each) for each in content]
        elif name in ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"):
            result[field["name"]] = content & 0x7FFFFFFF
    return result


def rosbags_object(types: Types, name: str, value: Value) -> Any:
    arguments: dict[str, Any] = {}
    for field in types[name]["fields"]:
        element, nested, content = (
            element_name(field),
            field["type"]["nested_type_name"],
            value[field["name"]],
        )
        if nested and shape(field) == "single":
            content = rosbags_object(types, nested, content)
        elif nested:
            content = [rosbags_object(types, nested, each) for each in content]
        elif shape(field) != "single" and element != "string":
            content = numpy.array(content, dtype=NUMBER_FORMATS[element])
        elif element == "octet":  # signed in ROS 1
            content = content - 256 if content > 127 else content
        arguments[field["name"]] = content
    return typestore().types[name](**arguments)


@pytest.mark.parametrize("name", sorted(typestore().fielddefs))
def test_what_rosbags_writes_is_read(name: str) -> None:
    types = types_of(name)
    transcode, message_class = transcoder(types, name)
    rng = random.Random(name)
    for _ in range(VALUES):
        value = in_both(types, name, random_value(types, name, rng))
        ros1 = bytes(typestore().serialize_ros1(rosbags_object(types, name, value), name))
        proto = message_class.FromString(transcode.ros1_to_proto(ros1))
        assert same_message(proto, protobuf_message(types, name, value, message_class()))
        if len(ros1) > 1:
            with pytest.raises(TranscodeError):
                transcode.ros1_to_proto(ros1[:-1])
        with pytest.raises(TranscodeError, match="1 bytes follow the last field"):
            transcode.ros1_to_proto(ros1 + b"\0")


@pytest.mark.parametrize("name", nasty_types())
def test_every_kind_of_field(name: str) -> None:
    types = nasty_types()
    transcode, message_class = transcoder(types, name)
    rng = random.Random(name)
    for _ in range(50):
        value = random_value(types, name, rng)
        ros1 = write_ros1(types, name, value)
        proto = message_class.FromString(transcode.ros1_to_proto(ros1))
        assert same_message(proto, protobuf_message(types, name, value, message_class()))
        part, _ = transcoder(types, name, fields=[types[name]["fields"][-1]["name"]])
        assert len(part.ros1_to_proto(ros1)) <= len(proto.SerializeToString())


def error(types: Types, name: str, data: bytes) -> str:
    with pytest.raises(TranscodeError) as caught:
        transcoder(types, name)[0].ros1_to_proto(data)
    return str(caught.value).removeprefix(name)


def test_times_that_ros_2_does_not_have() -> None:
    def times(sec: int, nanosec: int, *took: tuple[int, int]) -> bytes:
        durations = b"".join(struct.pack("<ii", *each) for each in took)
        return struct.pack("<IIi", sec, nanosec, len(took)) + durations

    transcode, message_class = transcoder(TIMES, "test/msg/Times")
    good = message_class.FromString(
        transcode.ros1_to_proto(times(2**31 - 1, 2**32 - 1, (-1, 0), (-(2**31), 5)))
    )
    assert (good.at.sec, good.at.nanosec) == (2**31 - 1, 2**32 - 1)
    assert [(each.sec, each.nanosec) for each in good.took] == [(-1, 0), (-(2**31), 5)]
    assert error(TIMES, "test/msg/Times", times(2**31, 0)) == (
        ".at.sec at byte 0: 2147483648 seconds do not fit int32, which a time has in ROS 2; give a time before 2038"
    )
    assert error(TIMES, "test/msg/Times", times(0, 0, (0, 0), (3, -5))) == (
        ".took[1].nanosec at byte 24: -5 nanoseconds do not fit uint32, which a duration has in ROS 2;"
        " give nanoseconds from 0 on"
    )
    # Only of ROS's own types.
    own = struct_type("test/msg/Time", sec="int32", nanosec="uint32")
    assert transcoder(own, "test/msg/Time")[0].ros1_to_proto(b"\xff" * 8)


def test_messages_without_bytes() -> None:
    types = {
        **struct_type("test/msg/Empty", structure_needs_at_least_one_member="uint8"),
        **struct_type("test/msg/Five", empties="test/msg/Empty[5]"),
        **struct_type(
            "test/msg/Many", before="uint8", many="test/msg/Five[]", more="test/msg/Empty[]", after="uint8"
        ),
    }
    transcode, message_class = transcoder(types, "test/msg/Many")
    proto = message_class.FromString(transcode.ros1_to_proto(b"\1" + struct.pack("<II", 2, 3) + b"\2"))
    assert (proto.before, proto.after, len(proto.more)) == (1, 2, 3)
    assert [len(each.empties) for each in proto.many] == [5, 5]
    assert transcoder(types, "test/msg/Empty")[0].ros1_to_proto(b"") == b""
    assert transcode.ros1_to_proto(b"\1" + struct.pack("<II", 0, 65536) + b"\2")
    for data, place in (
        (struct.pack("<II", 0, 65537), "more at byte 5: 65537"),
        (struct.pack("<II", 2**32 - 1, 0), "many at byte 1: 4294967295"),
        (struct.pack("<II", 65536, 0), "many[0].empties at byte 5: 5"),
    ):
        assert error(types, "test/msg/Many", b"\1" + data + b"\2") == (
            f".{place} elements that take no bytes are announced, and a message may have 65536; {OTHER_TYPE}"
        )


def test_strings_and_counts() -> None:
    types = struct_type("test/msg/Mixed", flag="boolean", text="string", numbers="double[]")
    transcode, message_class = transcoder(types, "test/msg/Mixed")
    data = b"\1" + struct.pack("<I", 2) + b"ab" + struct.pack("<Id", 1, 2.5)
    proto = message_class.FromString(transcode.ros1_to_proto(data))
    assert (proto.flag, proto.text, list(proto.numbers)) == (True, "ab", [2.5])
    cut = "are needed and 0 are left; the data is cut off or of another type"
    assert error(types, "test/msg/Mixed", b"") == f".flag at byte 0: 1 bytes {cut}"
    assert error(types, "test/msg/Mixed", b"\2") == (
        f".flag at byte 0: a boolean is 0 or 1 and this one is 2; {OTHER_TYPE}"
    )
    assert error(types, "test/msg/Mixed", data[:5]) == f".text at byte 5: 2 bytes {cut}"
    assert error(types, "test/msg/Mixed", b"\1\1\0\0\0\xff" + bytes(4)) == (
        ".text at byte 5: the text is not valid UTF-8; encode it as UTF-8, or use bytes for what is not text"
    )
    assert error(types, "test/msg/Mixed", bytes(5) + b"\xff" * 4) == (
        ".numbers at byte 5: 4294967295 elements are announced, which 0 bytes cannot hold;"
        " the data is cut off or of another type"
    )


@given(st.binary(max_size=300))
def test_arbitrary_bytes(data: bytes) -> None:
    """Every kind of field, also those that ROS 1 does not have."""
    transcode, message_class = nasty()
    try:
        proto = transcode.ros1_to_proto(data)
    except TranscodeError as found:
        assert found.byte_offset <= len(data)
    else:
        message_class.FromString(proto)


@functools.cache
def nasty() -> tuple[Any, Any]:
    return transcoder(nasty_types(), "test/msg/Inner")
