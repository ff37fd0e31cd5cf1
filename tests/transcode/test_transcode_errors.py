"""The errors, word for word."""

from __future__ import annotations

import pickle
import struct
from typing import Any

import pytest
from ros_types import Types, describe, protobuf_class, struct_type, transcoder

from rosidl_adapter_proto.errors import Error, SchemaError
from rosidl_adapter_proto.transcode import TranscodeError, Transcoder
from tests.transcode.wire import (
    DELIMITED,
    FIXED64,
    GROUP_END,
    GROUP_START,
    VARINT,
    delimited,
    double,
    number,
    tag,
    varint,
)

POINT = struct_type("test/msg/Point", x="double", name="string")
TYPES: Types = {
    **POINT,
    **struct_type("test/msg/Header", stamp="test/msg/Point", frame_id="string"),
    **struct_type("test/msg/Stamped", header="test/msg/Header", points="test/msg/Point[]"),
    **struct_type("test/msg/Flags", flag="boolean", flags="boolean[]"),
    **struct_type("test/msg/Text", text="string<3>", wide="wstring<3>", texts="string[]"),
    **struct_type("test/msg/Characters", chars="char[]", wide_chars="wchar[]"),
    **struct_type("test/msg/Letter", letter="char"),
    **struct_type("test/msg/Numbers", a="uint8", b="int8", c="uint16", d="int16", many="uint16[]"),
    **struct_type(
        "test/msg/Sizes", array="double[3]", bounded="int32[<=2]", data="uint8[2]", names="string[2]"
    ),
}
HEADER = b"\0\1\0\0"
TYPE = "the data is damaged or of another type"
CUT = "the data is cut off or of another type"
NO_PROTOBUF = "the data is cut off or no protobuf message"
DAMAGED = "the data is damaged or no protobuf message"


def cdr(form: str, *values: Any) -> bytes:
    return HEADER + struct.pack("<" + form, *values)


FROM_CDR = {
    "empty": (
        "Point",
        b"",
        " at byte 0: a CDR message begins with a header of 4 bytes and this one has 0;"
        " give the whole serialized message",
    ),
    "short": (
        "Point",
        b"\0\1\0",
        " at byte 0: a CDR message begins with a header of 4 bytes and this one has 3;"
        " give the whole serialized message",
    ),
    **{
        f"encapsulation {name}": (
            "Point",
            struct.pack(">HH", number, 0) + bytes(20),
            f""
            f" at byte 0: the encapsulation is {name} (0x{number:04x}), and only plain CDR (CDR_BE, CDR_LE) is read;"
            " serialize the message as plain CDR",
        )
        for number, name in [
            (2, "PL_CDR_BE"),
            (3, "PL_CDR_LE"),
            (6, "CDR2_BE"),
            (7, "CDR2_LE"),
            (8, "D_CDR2_BE"),
            (9, "D_CDR2_LE"),
            (10, "PL_CDR2_BE"),
            (11, "PL_CDR2_LE"),
            (0x0A0D, "unknown"),
        ]
    },
    "cut number": ("Point", cdr("I", 0), f".x at byte 4: 8 bytes are needed and 4 are left; {CUT}"),
    "cut length": ("Point", cdr("d", 0), f".name at byte 12: 4 bytes are needed and 0 are left; {CUT}"),
    "cut string": (
        "Point",
        cdr("dI2s", 0, 9, b"ab"),
        f".name at byte 16: 9 bytes are needed and 2 are left; {CUT}",
    ),
    "no NUL": (
        "Point",
        cdr("dI2s", 0, 2, b"ab"),
        f".name at byte 17: the string does not end with NUL; {TYPE}",
    ),
    "bad UTF-8": (
        "Point",
        cdr("dI3s", 0, 3, b"a\xff"),
        ".name at byte 16: the text is not valid UTF-8;"
        " encode it as UTF-8, or use bytes for what is not text",
    ),
    "nested": (
        "Stamped",
        cdr("dI", 0, 5),
        f".header.stamp.name at byte 16: 5 bytes are needed and 0 are left; {CUT}",
    ),
    "in a sequence": (
        "Stamped",
        cdr("dIII4xdI4xd", 0, 0, 0, 2, 0, 0, 0),
        f".points[1].name at byte 52: 4 bytes are needed and 0 are left; {CUT}",
    ),
    "too many elements": (
        "Stamped",
        cdr("dIIII", 0, 0, 0, 1000, 0),
        f".points at byte 20: 1000 elements are announced, which 4 bytes cannot hold; {CUT}",
    ),
    "bool": (
        "Flags",
        cdr("B3xI", 2, 0),
        f".flag at byte 4: a boolean is 0 or 1 and this one is 2; {TYPE}",
    ),
    "bools": (
        "Flags",
        cdr("B3xI3B", 1, 3, 1, 0, 255),
        f".flags[2] at byte 14: a boolean is 0 or 1 and this one is 255; {TYPE}",
    ),
    "trailing": (
        "Flags",
        cdr("B3xI4x", 1, 0),
        " at byte 12: 4 bytes follow the last field; the data is of another type",
    ),
    "string bound": (
        "Text",
        cdr("I5s", 5, b"abcd"),
        ".text at byte 8: the string has 4 characters and its bound is 3; shorten it",
    ),
    "wide bound": (
        "Text",
        cdr("IIIIII", 0, 4, 65, 65, 65, 65),
        ".wide at byte 12: the string has 4 characters and its bound is 3; shorten it",
    ),
    "wide unit": (
        "Text",
        cdr("IIII", 0, 2, 65, 65536),
        f".wide at byte 16: a UTF-16 code unit goes up to 65535 and this one is 65536; {TYPE}",
    ),
    "lone surrogate": (
        "Characters",
        cdr("IIHH", 0, 2, 65, 0xD800),
        ".wide_chars[1] at byte 14: half of a surrogate pair stands alone, which text cannot hold;"
        " send both halves",
    ),
    "swapped surrogates": (
        "Characters",
        cdr("IIHHH", 0, 3, 65, 0xDC00, 0xD800),
        ".wide_chars[1] at byte 14: half of a surrogate pair stands alone, which text cannot hold;"
        " send both halves",
    ),
    "wide too long": (
        "Text",
        cdr("IIII", 0, 9, 65, 65),
        f".wide at byte 8: 9 elements are announced, which 8 bytes cannot hold; {CUT}",
    ),
    "chars": (
        "Characters",
        cdr("I2s", 2, b"a\xc3"),
        f".chars[1] at byte 9: a char goes from 0 to 127 (ASCII) and this one is 195; {TYPE}",
    ),
    "char": (
        "Letter",
        cdr("B", 200),
        f".letter at byte 4: a char goes from 0 to 127 (ASCII) and this one is 200; {TYPE}",
    ),
    "sequence bound": (
        "Sizes",
        cdr("3dI", 0, 0, 0, 3),
        ".bounded at byte 28: the sequence has 3 elements and its bound is 2; remove the rest",
    ),
}

FROM_PROTO = {
    "cut tag": ("Point", b"\x80", f" at byte 0: a varint does not end; {NO_PROTOBUF}"),
    "long varint": (
        "Point",
        tag(2, DELIMITED) + b"\xff" * 10 + b"\1",
        f".name at byte 1: a varint does not end; {NO_PROTOBUF}",
    ),
    "field number 0": ("Point", b"\0\0", f" at byte 0: 0 is no field number; {DAMAGED}"),
    "large field number": ("Point", varint(2**33), f" at byte 0: {2**30} is no field number; {DAMAGED}"),
    "wire type": (
        "Point",
        b"\x0e",
        f" at byte 0: field number 1 has wire type 6, which protobuf does not have; {DAMAGED}",
    ),
    **{
        f"group {case}": (
            "Point",
            group,
            f" at byte {place}: the group of field number 7 has no end, no beginning or too many groups inside;"
            f" {DAMAGED}",
        )
        for case, (group, place) in {
            "without end": (tag(7, GROUP_START) + number(1, 5), 1),
            "without beginning": (tag(7, GROUP_END), 0),
            "of another end": (tag(7, GROUP_START) + tag(8, GROUP_END), 1),
            "cut off": (tag(7, GROUP_START) + b"\x0a\5abc", 1),
            "with a wrong tag": (tag(7, GROUP_START) + b"\0" + tag(7, GROUP_END), 1),
            "too deep": (tag(7, GROUP_START) * 101 + tag(7, GROUP_END) * 101, 1),
        }.items()
    },
    "cut number": (
        "Point",
        tag(1, FIXED64) + b"1234567",
        f".x at byte 1: 8 bytes are needed and 7 are left; {NO_PROTOBUF}",
    ),
    "cut string": (
        "Point",
        tag(2, DELIMITED) + b"\5abc",
        f".name at byte 2: 5 bytes are needed and 3 are left; {NO_PROTOBUF}",
    ),
    "cut unknown": (
        "Point",
        tag(9, DELIMITED) + b"\5abc",
        f" at byte 2: 5 bytes are needed and 3 are left; {NO_PROTOBUF}",
    ),
    "bad UTF-8": (
        "Stamped",
        delimited(2, double(1, 1.0)) + delimited(2, delimited(2, b"\xed\xa0\x80")),
        ".points[1].name at byte 15: the text is not valid UTF-8;"
        " encode it as UTF-8, or use bytes for what is not text",
    ),
    "NUL": (
        "Point",
        delimited(2, b"a\0b"),
        ".name at byte 2: the string contains NUL, which ends a string in ROS; remove it",
    ),
    "string bound": (
        "Text",
        delimited(1, "äöüß".encode()),
        ".text at byte 2: the string has 4 characters and its bound is 3; shorten it",
    ),
    "wide bound": (
        "Text",
        delimited(2, "abcd".encode("utf-16-le")),
        ".wide at byte 2: the string has 4 characters and its bound is 3; shorten it",
    ),
    "odd wide": (
        "Text",
        delimited(2, b"abc"),
        ".wide at byte 2: 3 bytes are no UTF-16, which has 2 bytes for each code unit;"
        " encode the text as UTF-16LE",
    ),
    "char": (
        "Letter",
        number(1, 200),
        ".letter at byte 1: 200 does not fit char; give a number from 0 to 127 (ASCII)",
    ),
    "large char": (
        "Letter",
        number(1, 256),
        ".letter at byte 1: 256 does not fit char; give a number from 0 to 127 (ASCII)",
    ),
    "chars": (
        "Characters",
        delimited(1, "aé".encode()),
        ".chars[1] at byte 3: 233 does not fit char; give a number from 0 to 127 (ASCII)",
    ),
    "bad UTF-8 in chars": (
        "Characters",
        delimited(1, b"a\xff"),
        ".chars at byte 3: the text is not valid UTF-8;"
        " encode it as UTF-8, or use bytes for what is not text",
    ),
    "lone surrogate": (
        "Characters",
        delimited(2, b"a\xed\xa0\x80"),
        ".wide_chars at byte 3: the text is not valid UTF-8;"
        " encode it as UTF-8, or use bytes for what is not text",
    ),
    "repeated string": (
        "Text",
        delimited(3, b"ok") + delimited(3, b"\xff"),
        ".texts[1] at byte 6: the text is not valid UTF-8;"
        " encode it as UTF-8, or use bytes for what is not text",
    ),
    "uint8": ("Numbers", number(1, 256), ".a at byte 1: 256 does not fit uint8; give a number from 0 to 255"),
    "int8": (
        "Numbers",
        number(2, -129),
        ".b at byte 1: -129 does not fit int8; give a number from -128 to 127",
    ),
    "uint16": (
        "Numbers",
        number(3, 65536),
        ".c at byte 1: 65536 does not fit uint16; give a number from 0 to 65535",
    ),
    "int16": (
        "Numbers",
        number(4, 32768),
        ".d at byte 1: 32768 does not fit int16; give a number from -32768 to 32767",
    ),
    "uint16 in a sequence": (
        "Numbers",
        delimited(5, varint(1), varint(70000)),
        ".many[1] at byte 3: 70000 does not fit uint16; give a number from 0 to 65535",
    ),
    "unpacked uint16 in a sequence": (
        "Numbers",
        tag(5, VARINT) + varint(1) + tag(5, VARINT) + varint(70000),
        ".many[1] at byte 3: 70000 does not fit uint16; give a number from 0 to 65535",
    ),
    "cut packed": (
        "Numbers",
        delimited(5, b"\1\x80"),
        f".many at byte 2: a varint does not end; {NO_PROTOBUF}",
    ),
    "array length": (
        "Sizes",
        delimited(1, bytes(16)),
        ".array at byte 0: the array has 2 elements; give 3, or none for zeros",
    ),
    "data length": (
        "Sizes",
        delimited(3, b"abc"),
        ".data at byte 0: the array has 3 elements; give 2, or none for zeros",
    ),
    "names length": (
        "Sizes",
        delimited(4),
        ".names at byte 0: the array has 1 elements; give 2, or none for zeros",
    ),
    "sequence bound": (
        "Sizes",
        delimited(2, bytes(12)),
        ".bounded at byte 0: the sequence has 3 elements and its bound is 2; remove the rest",
    ),
    "packed size": (
        "Sizes",
        delimited(2, bytes(6)),
        ".bounded at byte 2: a packed field of 6 bytes does not hold whole elements of 4 bytes;"
        " the data is damaged or of another type",
    ),
    "in a merged submessage": (
        "Stamped",
        number(9, 1) + delimited(1, delimited(2, b"a")) + delimited(1, delimited(2, b"\xff")),
        ".header.frame_id at byte 2: the text is not valid UTF-8;"
        " encode it as UTF-8, or use bytes for what is not text",
    ),
}


@pytest.mark.parametrize("case", FROM_CDR)
def test_from_cdr(case: str) -> None:
    name, data, text = FROM_CDR[case]
    transcode, _ = transcoder(TYPES, f"test/msg/{name}", hashed=False)
    with pytest.raises(TranscodeError) as caught:
        transcode.cdr_to_proto(data)
    assert str(caught.value) == f"test/msg/{name}{text}"


@pytest.mark.parametrize("case", FROM_PROTO)
def test_from_proto(case: str) -> None:
    name, data, text = FROM_PROTO[case]
    transcode, _ = transcoder(TYPES, f"test/msg/{name}", hashed=False)
    with pytest.raises(TranscodeError) as caught:
        transcode.proto_to_cdr(data)
    assert str(caught.value) == f"test/msg/{name}{text}"


def test_attributes() -> None:
    transcode, _ = transcoder(TYPES, "test/msg/Stamped")
    with pytest.raises(Error) as caught:
        transcode.cdr_to_proto(cdr("dI", 0, 5))
    error = caught.value
    assert isinstance(error, TranscodeError)
    assert (error.type_name, error.field_path, error.byte_offset) == (
        "test/msg/Stamped",
        "header.stamp.name",
        16,
    )
    assert error.reason == f"5 bytes are needed and 0 are left; {CUT}"
    assert error.batch_index is None
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), vars(copy)) == (str(error), vars(error))


def test_size_limit() -> None:
    transcode, _ = transcoder(TYPES, "test/msg/Point", hashed=False, size_limit=20)
    text = (
        "test/msg/Point{} at byte {}: the result would have more than 20 bytes;"
        " split the message or raise the size limit"
    )
    with pytest.raises(TranscodeError) as caught:
        transcode.cdr_to_proto(cdr("dI20s", 1.0, 20, b"a" * 19))
    assert str(caught.value) == text.format("", 36)
    with pytest.raises(TranscodeError) as caught:
        transcode.proto_to_cdr(delimited(2, b"aaaa"))
    assert str(caught.value) == text.format(".name", 0)


def test_limit_holds_before_memory_is_taken() -> None:
    types = {
        **struct_type("test/msg/Large", values="double[1000000]"),
        **struct_type("test/msg/Many", parts="test/msg/Large[]", one="test/msg/Large"),
    }
    transcode, _ = transcoder(types, "test/msg/Many", hashed=False, size_limit=100_000_000)
    assert len(transcode.proto_to_cdr(b"")) == 8_000_012
    with pytest.raises(TranscodeError, match="more than 100000000 bytes"):
        transcode.proto_to_cdr(delimited(1) * 100_000)


PLANS = {
    "missing field": (
        struct_type("test/msg/A", x="double"),
        struct_type("test/msg/A", x="double", y="double"),
        "test/msg/A.y: test.msg.pb.A does not have this field; generate it again",
    ),
    "foreign field": (
        struct_type("test/msg/A", x="double", y="double", z="double"),
        struct_type("test/msg/A", x="double"),
        "test/msg/A: test.msg.pb.A has fields that the ROS type does not have: y, z; generate it again",
    ),
    "other type": (
        struct_type("test/msg/A", x="float"),
        struct_type("test/msg/A", x="double"),
        "test/msg/A.x: the protobuf field is float where double is needed; generate its message again",
    ),
    "not repeated": (
        struct_type("test/msg/A", x="int32"),
        struct_type("test/msg/A", x="int32[]"),
        "test/msg/A.x: the protobuf field is sfixed32 where repeated sfixed32 is needed;"
        " generate its message again",
    ),
    "long double": (
        struct_type("test/msg/A", x="double"),
        struct_type("test/msg/A", x="long double"),
        "test/msg/A.x: long double has no one layout in CDR and cannot be transcoded;"
        " make the field a double",
    ),
    "recursive": (
        {
            **struct_type("test/msg/A", b="test/msg/B"),
            **struct_type("test/msg/B", a="test/msg/C"),
            **struct_type("test/msg/C", b="int32"),
        },
        {**struct_type("test/msg/A", b="test/msg/B"), **struct_type("test/msg/B", a="test/msg/A")},
        "test/msg/A: it contains itself, which IDL structs cannot; correct its type description",
    ),
}


@pytest.mark.parametrize("case", PLANS)
def test_plan(case: str) -> None:
    proto_types, ros_types, text = PLANS[case]
    message_class = protobuf_class(proto_types, "test/msg/A", hashed=False)
    with pytest.raises(SchemaError) as caught:
        Transcoder(describe(ros_types, "test/msg/A"), message_class.DESCRIPTOR)
    assert str(caught.value) == text


def test_plan_nested_too_deeply() -> None:
    types: Types = {}
    for depth in range(150):
        types |= struct_type(f"test/msg/D{depth}", x=f"test/msg/D{depth + 1}" if depth < 149 else "double")
    transcode, _ = transcoder(types, "test/msg/D50")
    assert transcode.proto_to_cdr(b"") == HEADER + bytes(8)
    with pytest.raises(SchemaError) as caught:
        transcoder(types, "test/msg/D49")
    assert str(caught.value) == "test/msg/D149: messages are nested more than 100 deep; flatten test/msg/D49"
