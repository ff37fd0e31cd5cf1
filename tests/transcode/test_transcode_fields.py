"""Chosen fields: only these are transcoded from CDR, and nothing else is looked at."""

from __future__ import annotations

import random
import struct
from typing import Any

import pytest
from google.protobuf.message import Message
from reference_cdr import write_cdr
from ros_types import (
    ROWS,
    Types,
    describe,
    element_name,
    installed_messages,
    installed_types,
    nasty_types,
    protobuf_class,
    protobuf_message,
    random_value,
    shape,
    struct_type,
)

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.transcode import TranscodeError, _core
from rosidl_adapter_proto.transcode.plan import build_plan

TYPES: Types = {**installed_types(), **nasty_types()}
NAMES = [*installed_messages(), *nasty_types()]


def transcoder(types: Types, name: str, fields: list[str] | None) -> tuple[_core.Transcoder, type[Message]]:
    message_class = protobuf_class(types, name)
    plan = build_plan(describe(types, name), message_class.DESCRIPTOR, fields=fields)
    return _core.Transcoder(plan.pack(), name, 1 << 30), message_class


def paths(types: Types, name: str) -> list[str]:
    """Return each field, and each field of the messages in it."""
    found = []
    for field in types[name]["fields"]:
        found.append(field["name"])
        nested = field["type"]["nested_type_name"]
        if nested:
            found += [f"{field['name']}.{inner['name']}" for inner in types[nested]["fields"]]
    return found


def keep(message: Message, path: list[str]) -> None:
    """Clear every field but one, and in that the same; single messages on the way are present."""
    for field in message.DESCRIPTOR.fields:
        if field.name != path[0]:
            message.ClearField(field.name)
    rest = path[1:]
    if not rest:
        return
    value: Any = getattr(message, path[0])
    if isinstance(value, Message):
        keep(value, rest)
    else:
        for each in value:
            keep(each, rest)


@pytest.mark.parametrize("name", NAMES)
def test_each_field_alone(name: str) -> None:
    rng = random.Random(name)
    value = random_value(TYPES, name, rng)
    whole, message_class = transcoder(TYPES, name, None)
    expected_whole = protobuf_message(TYPES, name, value, message_class())
    for path in paths(TYPES, name):
        transcode, _ = transcoder(TYPES, name, [path])
        expected = message_class()
        expected.CopyFrom(expected_whole)
        keep(expected, path.split("."))
        for big_endian in (False, True):
            cdr = write_cdr(TYPES, name, value, big_endian=big_endian)
            chosen = message_class.FromString(transcode.cdr_to_proto(cdr))
            assert chosen == expected, path
            # Whatever follows it does not count, and what is cut before its end is an error.
            assert transcode.cdr_to_proto(cdr + b"\xff" * 100) == transcode.cdr_to_proto(cdr)
    assert message_class.FromString(whole.cdr_to_proto(cdr)) == expected_whole


POINT = struct_type("test/msg/Point", x="double", label="string")
STAMP = struct_type("test/msg/Stamp", sec="int32", nanosec="uint32")
CLOUD = {
    **POINT,
    **STAMP,
    **struct_type("test/msg/Header", stamp="test/msg/Stamp", frame_id="string"),
    **struct_type(
        "test/msg/Cloud",
        header="test/msg/Header",
        height="uint32",
        names="string[]",
        points="test/msg/Point[]",
        data="uint8[]",
        last="int32",
    ),
}
VALUE = {
    "header": {"stamp": {"sec": 5, "nanosec": 6}, "frame_id": "map"},
    "height": 7,
    "names": ["a", "bc"],
    "points": [{"x": 1.0, "label": "one"}, {"x": 2.0, "label": "two"}],
    "data": [1, 2, 3],
    "last": 8,
}


def test_several_fields() -> None:
    transcode, message_class = transcoder(CLOUD, "test/msg/Cloud", ["points.x", "header.stamp", "height"])
    cdr = write_cdr(CLOUD, "test/msg/Cloud", VALUE)
    message: Any = message_class.FromString(transcode.cdr_to_proto(cdr))
    assert message == message_class(
        header={"stamp": {"sec": 5, "nanosec": 6}}, height=7, points=[{"x": 1.0}, {"x": 2.0}]
    )


@pytest.mark.parametrize(
    "fields", [["header", "header.stamp"], ["header.stamp", "header"], ["header", "header"]]
)
def test_a_message_and_a_part_of_it_are_all_of_it(fields: list[str]) -> None:
    transcode, message_class = transcoder(CLOUD, "test/msg/Cloud", fields)
    cdr = write_cdr(CLOUD, "test/msg/Cloud", VALUE)
    message: Any = message_class.FromString(transcode.cdr_to_proto(cdr))
    assert message == message_class(header=VALUE["header"])


def test_nothing_after_the_last_field_is_looked_at() -> None:
    cdr = write_cdr(CLOUD, "test/msg/Cloud", VALUE)
    transcode, message_class = transcoder(CLOUD, "test/msg/Cloud", ["header.stamp"])
    for data in (cdr[:12], cdr[:12] + b"\xff" * 50):
        message: Any = message_class.FromString(transcode.cdr_to_proto(data))
        assert message == message_class(header={"stamp": {"sec": 5, "nanosec": 6}})
    with pytest.raises(TranscodeError) as caught:
        transcode.cdr_to_proto(cdr[:11])
    assert caught.value.field_path == "header.stamp.nanosec"


def test_what_is_skipped_is_not_read() -> None:
    """Text that is no text, a string without its end and a boolean of 2 do no harm where nobody wants them."""
    types = struct_type(
        "test/msg/A", text="string", texts="string[]", wide="wstring", flag="boolean", x="uint8"
    )
    transcode, message_class = transcoder(types, "test/msg/A", ["x"])
    wide = struct.pack("<II", 1, 0xFFFFFFFF)
    cdr = b"\0\1\0\0" + struct.pack("<I4sII4s", 4, b"\xff" * 4, 1, 4, b"\xfe" * 4) + wide + b"\2\7"
    assert message_class.FromString(transcode.cdr_to_proto(cdr)) == message_class(x=7)
    for size in range(len(cdr)):
        with pytest.raises(TranscodeError):
            transcode.cdr_to_proto(cdr[:size])


HUGE = 0xFFFFFFF0
SKIPPED = {
    "string": ("string", struct.pack("<I", HUGE), f"{HUGE} bytes are needed and 0 are left"),
    "numbers": (
        "double[]",
        struct.pack("<I", HUGE),
        f"{HUGE} elements are announced, which 0 bytes cannot hold",
    ),
    "wide string": (
        "wstring",
        struct.pack("<I", HUGE),
        f"{HUGE} elements are announced, which 0 bytes cannot hold",
    ),
    "strings": (
        "string[]",
        struct.pack("<I", HUGE),
        f"{HUGE} elements are announced, which 0 bytes cannot hold",
    ),
    "points": (
        "test/msg/Point[]",
        struct.pack("<I", HUGE),
        f"{HUGE} elements are announced, which 0 bytes cannot hold",
    ),
    "stamps": (
        "test/msg/Stamp[]",
        struct.pack("<I", HUGE),
        f"{HUGE} elements are announced, which 0 bytes cannot hold",
    ),
    "bound": ("uint8[<=2]", struct.pack("<I3s", 3, b"abc"), "the sequence has 3 elements and its bound is 2"),
    "array": ("double[9]", bytes(71), "9 elements are announced, which 71 bytes cannot hold"),
    "padding": ("uint8", b"", "1 bytes are needed and 0 are left"),
}


@pytest.mark.parametrize("case", SKIPPED)
def test_what_is_skipped_is_checked(case: str) -> None:
    field, body, text = SKIPPED[case]
    types = {**POINT, **STAMP, **struct_type("test/msg/A", skipped=field, x="uint8")}
    transcode, _ = transcoder(types, "test/msg/A", ["x"])
    with pytest.raises(TranscodeError) as caught:
        transcode.cdr_to_proto(b"\0\1\0\0" + body)
    assert (caught.value.field_path, caught.value.reason.partition(";")[0]) == ("skipped", text)


def test_an_error_in_a_skipped_message_is_named() -> None:
    types = {**POINT, **struct_type("test/msg/A", points="test/msg/Point[]", x="uint8")}
    transcode, _ = transcoder(types, "test/msg/A", ["x"])
    with pytest.raises(TranscodeError) as caught:
        transcode.cdr_to_proto(b"\0\1\0\0" + struct.pack("<I4xdI4xdI", 2, 0, 0, 0, 9) + bytes(4))
    assert caught.value.field_path == "points[1].label"


def test_fixed_size_messages_with_padding_are_skipped() -> None:
    """Elements of a sequence whose first one needs other padding than the rest."""
    for inner in (
        {"a": "uint8", "b": "double"},
        {"a": "double", "b": "uint8"},
        {"a": "uint8", "b": "uint16"},
    ):
        types = {
            **struct_type("test/msg/Inner", **inner),
            **struct_type("test/msg/A", start="uint8[<=9]", parts="test/msg/Inner[]", x="uint8"),
        }
        transcode, message_class = transcoder(types, "test/msg/A", ["x"])
        for start in range(9):
            for count in range(5):
                parts = [{"a": 1, "b": 2}] * count
                cdr = write_cdr(types, "test/msg/A", {"start": [0] * start, "parts": parts, "x": 9})
                assert message_class.FromString(transcode.cdr_to_proto(cdr)) == message_class(x=9)


def test_messages_cannot_be_written() -> None:
    transcode, _ = transcoder(CLOUD, "test/msg/Cloud", ["height"])
    with pytest.raises(TranscodeError) as caught:
        transcode.proto_to_cdr(b"")
    assert str(caught.value) == (
        "test/msg/Cloud at byte 0: only chosen fields are transcoded, and a ROS message needs all of them;"
        " use a transcoder without fields"
    )


WRONG: dict[str, tuple[list[str], str]] = {
    "nothing": ([], "test/msg/Cloud: no field is chosen; name one, or give no fields for all of them"),
    "empty": ([""], "test/msg/Cloud has no field ''"),
    "near": (["hight"], "test/msg/Cloud has no field 'hight'; did you mean 'height'?"),
    "far": (["xyz"], "test/msg/Cloud has no field 'xyz'"),
    "nested": (["height", "header.stmp"], "test/msg/Cloud.header has no field 'stmp'; did you mean 'stamp'?"),
    "in a sequence": (["points.lable"], "test/msg/Cloud.points has no field 'lable'; did you mean 'label'?"),
    "in a number": (
        ["header.stamp.sec.x"],
        "test/msg/Cloud.header.stamp.sec is no message and has no field 'x'",
    ),
    "in a number that is chosen": (["height.x"], "test/msg/Cloud.height is no message and has no field 'x'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_unknown_fields(case: str) -> None:
    fields, text = WRONG[case]
    with pytest.raises(SchemaError) as caught:
        transcoder(CLOUD, "test/msg/Cloud", fields)
    assert str(caught.value) == text


def test_every_element_is_covered() -> None:
    """The types above have every element in every shape."""
    assert (
        len({(element_name(f), shape(f)) for f in TYPES["test/msg/Nasty"]["fields"]}) == (len(ROWS) + 1) * 4
    )
