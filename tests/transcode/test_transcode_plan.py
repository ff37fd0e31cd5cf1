"""Packed plans: the core checks them when it loads them, whoever wrote them."""

from __future__ import annotations

import contextlib
import random
import struct

import pytest
from ros_types import describe, nasty_types, protobuf_class, struct_type

from rosidl_adapter_proto.transcode import TranscodeError, _core
from rosidl_adapter_proto.transcode.plan import Kind, Operation, Plan, Shape, build_plan

NASTY = nasty_types()


def load(plan: Plan | bytes) -> _core.Transcoder:
    packed = plan.pack() if isinstance(plan, Plan) else plan
    return _core.Transcoder(packed, "test/msg/A", 1 << 20)


def one_field(**changes: object) -> Plan:
    fields = {"name": "x", "number": 1, "kind": Kind.FIXED32, **changes}
    return Plan("test/msg/A", ((Operation(**fields),),))  # type: ignore[arg-type]


def test_plan_of_a_type() -> None:
    types = {
        **struct_type("test/msg/Inner", x="double"),
        **struct_type("test/msg/A", name="string<7>[<=3]", parts="test/msg/Inner[2]", flag="boolean"),
    }
    descriptor = protobuf_class(types, "test/msg/A", hashed=False).DESCRIPTOR
    assert build_plan(describe(types, "test/msg/A"), descriptor) == Plan(
        "test/msg/A",
        (
            (
                Operation("name", 1, Kind.STRING, Shape.SEQUENCE, count=3, string_bound=7),
                Operation("parts", 2, Kind.MESSAGE, Shape.ARRAY, count=2, message=1),
                Operation("flag", 3, Kind.BOOL),
            ),
            (Operation("x", 1, Kind.FIXED64),),
        ),
    )


WRONG = {
    "nothing": (b"", "the plan does not begin as a plan does"),
    "another mark": (b"RPP0" + bytes(12), "the plan does not begin as a plan does"),
    "no messages": (b"RPP1" + bytes(12), "the plan does not have the size that it names"),
    "cut": (one_field().pack()[:-1], "the plan does not have the size that it names"),
    "huge": (
        struct.pack("<4sIII", b"RPP1", *[2**32 - 1] * 3),
        "the plan does not have the size that it names",
    ),
    "an empty message": (Plan("A", ((),)), "the messages of the plan do not follow each other"),
    "number 0": (one_field(number=0), "the plan has a field number out of range"),
    "a large number": (one_field(number=2**29), "the plan has a field number out of range"),
    "an unknown kind": (one_field(kind=13), "the plan has an unknown operation"),
    "an unknown shape": (one_field(shape=3), "the plan has an unknown operation"),
    "an array of nothing": (one_field(shape=Shape.ARRAY, count=0), "the plan has an array of no length"),
    "a recursive message": (one_field(kind=Kind.MESSAGE), "the plan nests its messages in the wrong order"),
    "a missing message": (
        one_field(kind=Kind.MESSAGE, message=1),
        "the plan nests its messages in the wrong order",
    ),
    "a huge array": (
        one_field(shape=Shape.ARRAY, count=2**31 - 1),
        "a message of this type is larger than 2 GiB",
    ),
    "two fields with one number": (
        Plan("A", ((Operation("x", 1, Kind.BOOL), Operation("y", 1, Kind.BOOL)),)),
        "the plan gives one field number to two fields",
    ),
    "deep nesting": (
        Plan(
            "A",
            (
                *((Operation("x", 1, Kind.MESSAGE, message=i + 1),) for i in range(100)),
                (Operation("x", 1, Kind.BOOL),),
            ),
        ),
        "the messages of the plan are nested too deeply",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_plan(case: str) -> None:
    plan, text = WRONG[case]
    with pytest.raises(ValueError, match=f"^{text}$"):
        load(plan)


def test_large_plan() -> None:
    """More fields than the core has ready memory for."""
    fields = tuple(Operation(f"f{i}", i + 1, Kind.UINT8) for i in range(500))
    transcode = load(Plan("A", (fields,)))
    cdr = b"\0\1\0\0" + bytes(i % 100 for i in range(500))
    assert transcode.proto_to_cdr(transcode.cdr_to_proto(cdr)) == cdr


def test_damaged_plans() -> None:
    """A damaged plan is refused or describes some other type; whatever is read with it, nothing breaks."""
    descriptor = protobuf_class(NASTY, "test/msg/Inner").DESCRIPTOR
    plan = build_plan(describe(NASTY, "test/msg/Inner"), descriptor).pack()
    rng = random.Random(11)
    loaded = 0
    for _ in range(5000):
        damaged = bytearray(plan)
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
