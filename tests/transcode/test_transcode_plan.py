"""Packed plans: the core checks them when it loads them, whoever wrote them."""

from __future__ import annotations

import contextlib
import random
import struct
from dataclasses import replace
from typing import Any

import pytest
from google.protobuf.descriptor import FieldDescriptor
from reference_cdr import write_cdr
from ros_types import describe, nasty_types, protobuf_class, random_value, struct_type

from rosidl_adapter_proto.interfaces.model import Shape
from rosidl_adapter_proto.interfaces.scalars import NESTED_TYPE_ID, SCALARS, CdrForm
from rosidl_adapter_proto.transcode import TranscodeError, _core
from rosidl_adapter_proto.transcode.plan import (
    NOT_IN_PROTOBUF,
    MessagePlan,
    Operation,
    Plan,
    build_plan,
)

NASTY = nasty_types()


def load(given: Plan | bytes) -> _core.Transcoder:
    packed = given.pack() if isinstance(given, Plan) else given
    return _core.Transcoder(packed, "test/msg/A", 1 << 20)


def number(name: str, scalar: str, field_number: int = 1, **changes: Any) -> Operation:
    """An operation for a number."""
    row = SCALARS[scalar]
    assert row.cdr is not None
    protobuf = getattr(FieldDescriptor, f"TYPE_{row.protobuf.upper()}")
    operation = Operation(name, name, row.type_id, row.cdr, protobuf, field_number)
    return replace(operation, **changes)


def nested(name: str, message: int, field_number: int = 1, **changes: Any) -> Operation:
    """An operation for a nested message."""
    protobuf = FieldDescriptor.TYPE_MESSAGE
    operation = Operation(
        name, name, NESTED_TYPE_ID, CdrForm.MESSAGE, protobuf, field_number, message=message
    )
    return replace(operation, **changes)


def plan(*messages: tuple[Operation, ...]) -> Plan:
    return Plan(tuple(MessagePlan("test/msg/A", "test.msg.pb.A", each) for each in messages))


def one_field(**changes: Any) -> Plan:
    return plan((number("x", "uint32", **changes),))


def test_plan_of_a_type() -> None:
    types = {
        **struct_type("test/msg/Inner", x="double"),
        **struct_type("test/msg/A", name="string<7>[<=3]", parts="test/msg/Inner[2]", flag="boolean"),
        **struct_type("test/msg/Empty", structure_needs_at_least_one_member="uint8"),
    }
    descriptor = protobuf_class(types, "test/msg/A", hashed=False).DESCRIPTOR
    text = Operation(
        *("name", "name", SCALARS["string"].type_id, CdrForm.STRING, FieldDescriptor.TYPE_STRING, 1),
        shape=Shape.SEQUENCE,
        count=3,
        string_bound=7,
    )
    assert build_plan(describe(types, "test/msg/A"), descriptor) == Plan(
        (
            MessagePlan(
                "test/msg/A",
                "test.msg.pb.A",
                (text, nested("parts", 1, 2, shape=Shape.ARRAY, count=2), number("flag", "boolean", 3)),
            ),
            MessagePlan("test/msg/Inner", "test.msg.pb.Inner", (number("x", "double"),)),
        ),
    )
    descriptor = protobuf_class(types, "test/msg/Empty").DESCRIPTOR
    (empty,) = build_plan(describe(types, "test/msg/Empty"), descriptor).messages
    (member,) = empty.operations
    assert (member.cdr, member.protobuf, member.number) == (CdrForm.UINT8, NOT_IN_PROTOBUF, 0)


OTHER_VERSION = "the plan has another version than this core, which reads version 2; build it again"
FORMS = "the plan has a field whose forms do not go together"

WRONG: dict[str, tuple[Plan | bytes, str]] = {
    "nothing": (b"", "the plan does not begin as a plan does"),
    "another mark": (b"RPX2" + bytes(16), "the plan does not begin as a plan does"),
    "another version": (b"RPP1" + bytes(16), OTHER_VERSION),
    "no messages": (b"RPP2" + bytes(16), "the plan does not have the size that it names"),
    "cut": (one_field().pack()[:-1], "the plan does not have the size that it names"),
    "huge": (
        struct.pack("<4s4I", b"RPP2", *[2**32 - 1] * 3, 0),
        "the plan does not have the size that it names",
    ),
    "an unknown property": (
        one_field().pack()[:16] + b"\2" + one_field().pack()[17:],
        "the plan has an unknown property",
    ),
    "an empty message": (plan(()), "the messages of the plan do not follow each other"),
    "number 0": (one_field(number=0), FORMS),
    "a large number": (one_field(number=2**29), "the plan has a field number out of range"),
    "an unknown form": (one_field(cdr=max(CdrForm) + 1), "the plan has an unknown operation"),
    "no form": (one_field(cdr=0), "the plan has an unknown operation"),
    "another protobuf form": (one_field(protobuf=FieldDescriptor.TYPE_SFIXED32), FORMS),
    "an unknown protobuf form": (one_field(protobuf=200), FORMS),
    "a number without a protobuf form": (one_field(protobuf=NOT_IN_PROTOBUF), FORMS),
    "an unknown shape": (one_field(shape=3), "the plan has an unknown operation"),
    "an array of nothing": (one_field(shape=Shape.ARRAY, count=0), "the plan has an array of no length"),
    "a recursive message": (plan((nested("x", 0),)), "the plan nests its messages in the wrong order"),
    "a missing message": (plan((nested("x", 1),)), "the plan nests its messages in the wrong order"),
    "a huge array": (
        one_field(shape=Shape.ARRAY, count=2**31 - 1),
        "a message of this type is larger than 2 GiB",
    ),
    "two fields with one number": (
        plan((number("x", "boolean"), number("y", "boolean"))),
        "the plan gives one field number to two fields",
    ),
    "deep nesting": (
        plan(*((nested("x", i + 1),) for i in range(100)), (number("x", "boolean"),)),
        "the messages of the plan are nested too deeply",
    ),
    "a name that is not there": (
        one_field().pack()[:-1] + b"\xff",
        "the plan has a name that is not among its names",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_plan(case: str) -> None:
    wrong, text = WRONG[case]
    with pytest.raises(ValueError, match=f"^{text}$"):
        load(wrong)


def test_without_a_protobuf_field() -> None:
    """What protobuf does not have is skipped in CDR and zeros in CDR, whatever is there."""
    types = {
        **struct_type("test/msg/Inner", n="uint8", x="double"),
        **struct_type("test/msg/Texts", texts="string[]", wide="wstring"),
        **struct_type(
            "test/msg/A",
            a="uint8",
            b="double",
            c="int16[3]",
            d="string",
            e="wstring[]",
            f="test/msg/Inner[2]",
            g="test/msg/Inner[]",
            h="test/msg/Texts[]",
            i="test/msg/Texts",
            last="int32",
        ),
    }
    message_class = protobuf_class(types, "test/msg/A")
    whole = build_plan(describe(types, "test/msg/A"), message_class.DESCRIPTOR)
    top, *parts = whole.messages
    absent = {"protobuf": NOT_IN_PROTOBUF, "number": 0, "protobuf_name": ""}
    operations = tuple(
        each if each.name == "last" else replace(each, **absent) for each in top.operations  # type: ignore[arg-type]
    )
    transcode = load(Plan((replace(top, operations=operations), *parts)))
    rng = random.Random(3)
    zeros = _core.Transcoder(whole.pack(), "test/msg/A", 1 << 20).proto_to_cdr(b"")
    for big_endian in (False, True):
        value = random_value(types, "test/msg/A", rng) | {"last": 5}
        cdr = write_cdr(types, "test/msg/A", value, big_endian=big_endian)
        proto = message_class(last=5).SerializeToString()
        assert transcode.cdr_to_proto(cdr) == proto
        assert transcode.proto_to_cdr(proto) == zeros[:-4] + struct.pack("<i", 5)
        for size in range(len(cdr)):
            with pytest.raises(TranscodeError):
                transcode.cdr_to_proto(cdr[:size])
    # A field with the number of one that is not in the plan is unknown, and so skipped.
    assert transcode.proto_to_cdr(message_class(a=3, d="x").SerializeToString()) == zeros


def test_large_plan() -> None:
    """More fields than the core has ready memory for."""
    transcode = load(plan(tuple(number(f"f{i}", "uint8", i + 1) for i in range(500))))
    cdr = b"\0\1\0\0" + bytes(i % 100 for i in range(500))
    assert transcode.proto_to_cdr(transcode.cdr_to_proto(cdr)) == cdr


def test_damaged_plans() -> None:
    """A damaged plan is refused or describes some other type; whatever is read with it, nothing breaks."""
    descriptor = protobuf_class(NASTY, "test/msg/Inner").DESCRIPTOR
    packed = build_plan(describe(NASTY, "test/msg/Inner"), descriptor).pack()
    rng = random.Random(11)
    loaded = 0
    for _ in range(5000):
        damaged = bytearray(packed)
        for _ in range(rng.randint(1, 3)):
            damaged[rng.randrange(len(damaged))] = rng.choice(
                (0, 1, 2, 3, 12, 0x7F, 0xFF, rng.randrange(256))
            )
        try:
            transcode = load(bytes(damaged))
        except ValueError:
            continue
        loaded += 1
        for work in (transcode.cdr_to_proto, transcode.proto_to_cdr):
            with contextlib.suppress(TranscodeError):
                work(b"\0\1\0\0" + rng.randbytes(rng.randrange(60)))
    assert loaded > 1000
