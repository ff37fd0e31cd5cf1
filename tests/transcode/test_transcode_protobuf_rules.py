"""What the protobuf specification allows on the wire, field by field: the result must be what protobuf itself reads."""

from __future__ import annotations

import struct

import pytest
from reference_cdr import write_cdr
from ros_types import struct_type, transcoder
from wire import DELIMITED, GROUP_END, GROUP_START, VARINT, delimited, double, fixed32, number, tag, varint

TYPES = {
    **struct_type("test/msg/Point", x="double", y="double", label="string"),
    **struct_type("test/msg/Pair", first="uint32", second="int16[2]", weights="double[2]"),
    **struct_type(
        "test/msg/Top",
        small="int16",
        flag="boolean",
        fixed="uint32",
        text="string",
        point="test/msg/Point",
        points="test/msg/Point[]",
        pair="test/msg/Pair",
        shorts="int16[]",
        flags="boolean[]",
        longs="int64[]",
        names="string[]",
        data="uint8[]",
        wide="wstring",
    ),
}
SMALL, FLAG, FIXED, TEXT, POINT, POINTS, PAIR, SHORTS, FLAGS, LONGS, NAMES, DATA, WIDE = range(1, 14)
X, Y, LABEL = 1, 2, 3
FIRST, SECOND, WEIGHTS = 1, 2, 3

NO_POINT = {"x": 0.0, "y": 0.0, "label": ""}
NO_PAIR = {"first": 0, "second": [0, 0], "weights": [0.0, 0.0]}
DEFAULT = {
    **{"small": 0, "flag": False, "fixed": 0, "text": "", "point": NO_POINT, "points": [], "pair": NO_PAIR},
    **{"shorts": [], "flags": [], "longs": [], "names": [], "data": [], "wide": ""},
}

UNKNOWN = b"".join((number(900, 5), double(901, 1.5), fixed32(902, 7), delimited(903, b"whatever")))
GROUP = b"".join(
    (
        tag(904, GROUP_START),
        UNKNOWN,
        number(SMALL, 5),
        tag(SMALL, GROUP_START),
        tag(905, GROUP_START),
        tag(905, GROUP_END),
        tag(SMALL, GROUP_END),
        tag(904, GROUP_END),
    )
)
LONG = struct.pack("<q", 5)

RULES = {
    "nothing is all defaults": (b"", {}),
    "fields in any order": (number(FLAG, 1) + number(SMALL, 3), {"flag": True, "small": 3}),
    "descending order": (
        delimited(TEXT, b"t") + fixed32(FIXED, 9) + number(FLAG, 1),
        {"text": "t", "fixed": 9, "flag": True},
    ),
    "the last number wins": (number(SMALL, 1) + number(SMALL, 2), {"small": 2}),
    "the last number wins over one that does not fit": (
        number(SMALL, 99999) + number(SMALL, 2),
        {"small": 2},
    ),
    "the last string wins": (delimited(TEXT, b"one") + delimited(TEXT, b"two"), {"text": "two"}),
    "the last bytes win": (delimited(DATA, b"ab") + delimited(DATA, b"c"), {"data": [99]}),
    "an explicit default": (number(SMALL, 0) + delimited(TEXT), {}),
    "unknown fields between": (UNKNOWN + number(SMALL, 1) + UNKNOWN, {"small": 1}),
    "unknown fields inside": (
        delimited(POINT, UNKNOWN, double(X, 1.0), UNKNOWN),
        {"point": {**NO_POINT, "x": 1.0}},
    ),
    "a field of another wire type is unknown": (fixed32(SMALL, 1) + number(TEXT, 7) + number(POINT, 1), {}),
    "a delimited number is unknown": (delimited(SMALL, b"\1"), {}),
    "negative numbers have ten bytes": (number(SMALL, -5), {"small": -5}),
    "a negative number of five bytes": (tag(SMALL, VARINT) + varint(2**32 - 5), {"small": -5}),
    "numbers are cut to 32 bits": (number(SMALL, 2**40 + 7), {"small": 7}),
    "any bool but 0 is true": (number(FLAG, 200), {"flag": True}),
    "a bool of high bits is true": (number(FLAG, 2**63), {"flag": True}),
    "varints with empty bytes": (tag(SMALL, VARINT) + varint(3, size=10), {"small": 3}),
    "a length with empty bytes": (tag(TEXT, DELIMITED) + varint(2, size=5) + b"ok", {"text": "ok"}),
    "a tag with empty bytes": (varint(SMALL << 3, size=5) + b"\4", {"small": 4}),
    "merged submessages": (
        delimited(POINT, double(X, 1.0), delimited(LABEL, b"l"))
        + delimited(POINT, double(Y, 2.0), double(X, 3.0)),
        {"point": {"x": 3.0, "y": 2.0, "label": "l"}},
    ),
    "merged submessages with others between": (
        delimited(POINT, double(X, 1.0))
        + number(SMALL, 1)
        + UNKNOWN
        + delimited(POINT)
        + delimited(POINT, double(Y, 2.0)),
        {"point": {**NO_POINT, "x": 1.0, "y": 2.0}, "small": 1},
    ),
    "merged submessages join their arrays": (
        delimited(PAIR, number(SECOND, 1), double(WEIGHTS, 0.5))
        + delimited(PAIR, double(WEIGHTS, 1.5), number(SECOND, 2)),
        {"pair": {"first": 0, "second": [1, 2], "weights": [0.5, 1.5]}},
    ),
    "repeated submessages are not merged": (
        delimited(POINTS, double(X, 1.0)) + delimited(POINTS, double(Y, 2.0)) + delimited(POINTS),
        {"points": [{**NO_POINT, "x": 1.0}, {**NO_POINT, "y": 2.0}, NO_POINT]},
    ),
    "repeated fields apart": (
        delimited(NAMES, b"a")
        + delimited(POINTS)
        + number(SMALL, 1)
        + delimited(NAMES)
        + UNKNOWN
        + delimited(NAMES, b"c"),
        {"names": ["a", "", "c"], "points": [NO_POINT], "small": 1},
    ),
    "packed varints": (delimited(SHORTS, varint(1), varint(-1), varint(300)), {"shorts": [1, -1, 300]}),
    "unpacked varints": (number(SHORTS, 1) + number(SHORTS, -1), {"shorts": [1, -1]}),
    "packed and unpacked varints": (
        number(SHORTS, 1)
        + delimited(SHORTS, varint(2), varint(3, size=4))
        + number(SHORTS, 4)
        + delimited(SHORTS),
        {"shorts": [1, 2, 3, 4]},
    ),
    "packed in pieces": (
        delimited(LONGS, LONG) + number(SMALL, 1) + delimited(LONGS, LONG, LONG) + UNKNOWN,
        {"longs": [5, 5, 5], "small": 1},
    ),
    "unpacked fixed numbers": (
        tag(LONGS, 1) + LONG + tag(LONGS, 1) + LONG + delimited(LONGS, LONG),
        {"longs": [5, 5, 5]},
    ),
    "one unpacked fixed number": (tag(LONGS, 1) + LONG, {"longs": [5]}),
    "packed bools": (delimited(FLAGS, b"\1\0\2", varint(2**40)), {"flags": [True, False, True, True]}),
    "an empty packed field": (delimited(LONGS) + delimited(SHORTS), {}),
    "repeated numbers with a foreign wire type between": (
        number(SHORTS, 1) + fixed32(SHORTS, 7) + number(SHORTS, 2),
        {"shorts": [1, 2]},
    ),
    "an absent array": (delimited(PAIR, fixed32(FIRST, 1)), {"pair": {**NO_PAIR, "first": 1}}),
    "text of several bytes": (delimited(TEXT, "é€😀".encode()), {"text": "é€😀"}),
    "groups are unknown": (GROUP + number(SMALL, 1) + GROUP, {"small": 1}),
    "groups inside": (delimited(POINT, GROUP, double(X, 1.0), GROUP), {"point": {**NO_POINT, "x": 1.0}}),
    "groups between repeated fields": (
        number(SHORTS, 1) + GROUP + number(SHORTS, 2) + GROUP + delimited(NAMES, b"a") + GROUP,
        {"shorts": [1, 2], "names": ["a"]},
    ),
    "groups between pieces": (
        delimited(POINT, double(X, 1.0)) + GROUP + delimited(POINT, GROUP, double(Y, 2.0)),
        {"point": {**NO_POINT, "x": 1.0, "y": 2.0}},
    ),
    "a group with the number of a field is unknown": (
        tag(SMALL, GROUP_START) + number(SMALL, 5) + tag(SMALL, GROUP_END),
        {},
    ),
    "groups as deep as protobuf reads them": (tag(904, GROUP_START) * 99 + tag(904, GROUP_END) * 99, {}),
    "lone surrogates": (
        delimited(WIDE, b"\x00\xdca\0\x3d\xd8\x3d\xd8\x00\xde\x00\xd8"),
        {"wide": "\udc00a\ud83d\U0001f600\ud800"},
    ),
    "wide text": (delimited(WIDE, "é😀".encode("utf-16-le")), {"wide": "é😀"}),
}


@pytest.mark.parametrize("rule", RULES)
def test_rule(rule: str) -> None:
    wire, changes = RULES[rule]
    transcode, message_class = transcoder(TYPES, "test/msg/Top", hashed=False)
    assert transcode.proto_to_cdr(wire) == write_cdr(TYPES, "test/msg/Top", {**DEFAULT, **changes})
    # protobuf itself reads the same: what it writes of it gives the same CDR
    canonical = message_class.FromString(wire).SerializeToString()
    assert transcode.proto_to_cdr(canonical) == transcode.proto_to_cdr(wire)
