from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    Field,
    FieldType,
    Message,
    SequenceType,
    StringType,
    TypeName,
)
from rosidl_adapter_proto.interfaces.scalars import SCALARS
from rosidl_adapter_proto.schema.numbering import (
    LARGEST_NUMBER,
    HashNumbering,
    Numbers,
    SequentialNumbering,
    compute_proto_field_number,
)

FOO = TypeName("pkg", "msg", "Foo")
LOCK = "rosidl-proto.lock"
TYPES: dict[str, FieldType] = {
    "int8": BasicType("int8"),
    "int16": BasicType("int16"),
    "int32": BasicType("int32"),
    "uint8": BasicType("uint8"),
    "octet": BasicType("octet"),
    "string": StringType(),
    "string<=3": StringType(bound=3),
    "wstring": StringType(wide=True),
    "int32[]": SequenceType(BasicType("int32")),
    "int32[3]": ArrayType(BasicType("int32"), 3),
    "int32[4]": ArrayType(BasicType("int32"), 4),
    "int32[<=4]": SequenceType(BasicType("int32"), 4),
    "uint8[]": SequenceType(BasicType("uint8")),
    "int8[]": SequenceType(BasicType("int8")),
    "octet[]": SequenceType(BasicType("octet")),
    "long_double": BasicType("long double"),
    "long_double[]": SequenceType(BasicType("long double")),
    "Bar": TypeName("pkg", "msg", "Bar"),
    "Bar[]": SequenceType(TypeName("pkg", "msg", "Bar")),
    "Baz": TypeName("pkg", "msg", "Baz"),
}


def message(fields: str, name: TypeName = FOO) -> Message:
    """Return a message, given as `a b c:string`; fields without a type are `int32`."""
    parts = (each.partition(":") for each in fields.split())
    return Message(name, tuple(Field(field, TYPES[type_ or "int32"]) for field, _, type_ in parts))


# Numbers from a hash


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("data", 234097369),
        ("structure_needs_at_least_one_member", 407246362),
        ("g", 30678879),
        ("", 1),
        ("rgjer", 18957),
        ("aabmvfk", 20088),  # 19088 without the jump
    ],
)
def test_hash_numbers(name: str, number: int) -> None:
    assert compute_proto_field_number(name) == number


@pytest.mark.parametrize(
    ("checksum", "number"),
    [
        (0, 1),
        (18_998, 18_999),
        (18_999, 20_000),
        (19_000, 20_001),
        (LARGEST_NUMBER - 1001, LARGEST_NUMBER),
        (LARGEST_NUMBER - 1000, 1),
        (2**32 - 1, 7 + 1000 * 8 + 1),
    ],
)
def test_hash_numbers_jump_over_what_protobuf_reserves(
    checksum: int, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(zlib, "crc32", lambda data: checksum)
    assert compute_proto_field_number("a") == number


@given(st.text())
def test_hash_numbers_can_be_used(name: str) -> None:
    number = compute_proto_field_number(name)
    assert 1 <= number <= LARGEST_NUMBER
    assert not 19_000 <= number <= 19_999


# Two pairs of names that collide, found by trying
VEL, TEMP = "vel_height_x", "temp_rate_acc"


def test_the_second_of_two_names_that_collide_gets_a_counter() -> None:
    assert compute_proto_field_number(VEL) == compute_proto_field_number(TEMP) == 133126006
    with_counter = {VEL: compute_proto_field_number(f"{VEL}0"), TEMP: 137327076}
    assert compute_proto_field_number(f"{TEMP}0") == 137327076
    numbering = HashNumbering()
    assert numbering.numbers(message(f"{VEL} {TEMP}")).fields == {VEL: 133126006, TEMP: 137327076}
    assert numbering.numbers(message(f"{TEMP} a {VEL}")).fields == {
        TEMP: 133126006,
        "a": compute_proto_field_number("a"),
        VEL: with_counter[VEL],
    }


def test_the_counter_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    checksums = {b"a": 1, b"b": 1, b"b0": 1, b"b1": 1, b"b2": 5, b"c": 5, b"c0": 7}
    monkeypatch.setattr(zlib, "crc32", checksums.__getitem__)
    assert HashNumbering().numbers(message("a b c")) == Numbers({"a": 2, "b": 6, "c": 8})


def test_hash_numbers_do_not_depend_on_other_fields() -> None:
    numbering = HashNumbering()
    few, many = numbering.numbers(message("a b")).fields, numbering.numbers(message("z b:string y a")).fields
    assert few == {name: many[name] for name in few}


# Numbers in sequence


def sequence(*steps: str, lock: str | None = None) -> tuple[Numbers, str]:
    """Number a message in each form it has over time, with the lock file in between."""
    numbers = Numbers({})
    for step in steps:
        numbering = SequentialNumbering.from_lock(LOCK, lock)
        numbers = numbering.numbers(message(step))
        lock = numbering.lock_text()
    assert lock is not None
    return numbers, lock


@pytest.mark.parametrize(
    ("steps", "fields", "reserved"),
    [
        (["a b c"], {"a": 1, "b": 2, "c": 3}, {}),
        (["a b", "b a"], {"b": 2, "a": 1}, {}),  # reordered
        (["a b", "a x b"], {"a": 1, "x": 3, "b": 2}, {}),  # inserted
        (["a b", "x a y b"], {"x": 3, "a": 1, "y": 4, "b": 2}, {}),
        (["a b c", "a c"], {"a": 1, "c": 3}, {"b": 2}),  # removed
        (["a b c", "a c x"], {"a": 1, "c": 3, "x": 4}, {"b": 2}),
        (["a b", "a", "a x"], {"a": 1, "x": 3}, {"b": 2}),
        (["a b c", "a", "a b"], {"a": 1, "b": 2}, {"c": 3}),  # added again
        (["a b", "x"], {"x": 3}, {"a": 1, "b": 2}),
        (["a", "x", "a"], {"a": 1}, {"x": 2}),
        # Types whose values have the same bytes
        (["a:int8", "a:int16"], {"a": 1}, {}),
        (["a:uint8", "a:octet"], {"a": 1}, {}),
        (["a:uint8[]", "a:octet[]"], {"a": 1}, {}),
        (["a:string", "a:string<=3"], {"a": 1}, {}),
        (["a:int32[]", "a:int32[3]", "a:int32[4]", "a:int32[<=4]"], {"a": 1}, {}),
    ],
)
def test_sequential_numbers(steps: list[str], fields: dict[str, int], reserved: dict[str, int]) -> None:
    numbers, lock = sequence(*steps)
    assert numbers == Numbers(fields, reserved)
    assert list(numbers.fields) == list(fields)
    assert sequence(steps[-1], lock=lock) == (numbers, lock)


@pytest.mark.parametrize(
    ("steps", "was", "is_now"),
    [
        (["a", "a:string"], "int32", "string"),
        (["a:string", "a:wstring"], "string", "wstring"),
        (["a", "a:int32[]"], "int32", "int32[]"),
        (["a:uint8", "a:uint8[]"], "uint8", "uint8[]"),
        (["a:Bar", "a:Baz"], "pkg/msg/Bar", "pkg/msg/Baz"),
        (["a:Bar", "a:Bar[]"], "pkg/msg/Bar", "pkg/msg/Bar[]"),
        (["a:long_double", "a:long_double[]"], "long double", "long double[]"),
        (["b a", "b", "b a:string"], "int32", "string"),  # removed in between
        # All of these are bytes in protobuf.
        (["a:uint8[]", "a:int8[]"], "uint8[]", "int8[]"),
        (["a:int8[]", "a:octet[]"], "int8[]", "byte[]"),
        (["a:wstring", "a:uint8[]"], "wstring", "uint8[]"),
        (["a:octet[]", "a:wstring"], "byte[]", "wstring"),
    ],
)
def test_a_number_is_not_used_for_another_type(steps: list[str], was: str, is_now: str) -> None:
    number = len(steps) - 1
    with pytest.raises(SchemaError) as caught:
        sequence(*steps)
    assert str(caught.value) == (
        f"pkg/msg/Foo.a: {LOCK} has number {number} for it with type {was}, but its type is {is_now} now; "
        "a number cannot be used for another type: give the field a new name, or, if it was never released, "
        f"run: rosidl-proto lock drop pkg/msg/Foo.a --lock-file {LOCK}"
    )


@pytest.mark.parametrize("name", [*SCALARS, "Bar"])
@pytest.mark.parametrize("shape", [SequenceType, lambda type_: type_], ids=["many", "one"])
def test_every_type_is_read_as_it_was_written(name: str, shape: Callable[[Any], FieldType]) -> None:
    """Whatever an interface can have, its lock file is read again, and serves the same type."""
    element: FieldType = BasicType(name) if name in SCALARS else FOO
    if name in ("string", "wstring"):
        element = StringType(wide=name == "wstring")
    foo = Message(FOO, (Field("a", shape(element)),))
    numbering = SequentialNumbering.from_lock(LOCK, None)
    numbering.numbers(foo)
    text = numbering.lock_text()
    assert text.count("(") == 1

    again = SequentialNumbering.from_lock(LOCK, text)

    assert again.numbers(foo).fields == {"a": 1}
    assert again.lock_text() == text


def test_the_lock_file() -> None:
    numbering = SequentialNumbering.from_lock(LOCK, None)
    numbering.numbers(message("z", TypeName("pkg", "srv", "Do_Request")))
    numbering.numbers(message("c a:Bar b:uint8[] gone"))
    numbering.numbers(message("c d:string a:Bar b:uint8[]"))
    assert numbering.lock_text() == """{
  "version": 2,
  "messages": {
    "pkg/msg/Foo": {
      "fields": {
        "c": "1 sfixed32 (int32)",
        "a": "2 pkg.msg.pb.Bar (pkg/msg/Bar)",
        "b": "3 bytes (uint8[])",
        "d": "5 string (string)"
      },
      "removed": {
        "gone": "4 sfixed32 (int32)"
      }
    },
    "pkg/srv/Do_Request": {
      "fields": {
        "z": "1 sfixed32 (int32)"
      },
      "removed": {}
    }
  }
}
"""


def test_a_lock_file_of_version_1() -> None:
    """It has no ROS types. Fields get theirs when they are numbered; what was removed has none."""
    old = lock_of('{"a": "1 sfixed32", "b": "2 bytes"}', '{"gone": "3 bytes"}')

    numbers, lock = sequence("a b:wstring", lock=old)

    assert numbers == Numbers({"a": 1, "b": 2}, {"gone": 3})
    assert json.loads(lock) == {
        "version": 2,
        "messages": {
            "pkg/msg/Foo": {
                "fields": {"a": "1 sfixed32 (int32)", "b": "2 bytes (wstring)"},
                "removed": {"gone": "3 bytes"},
            }
        },
    }
    with pytest.raises(
        SchemaError, match=r" has number 2 for it with type bytes in protobuf, but its type is "
    ):
        sequence("a b", lock=old)


def test_dropped_entries() -> None:
    numbering = SequentialNumbering.from_lock(LOCK, sequence("a b c", "b c")[1])

    assert numbering.drop("pkg/msg/Foo.c") == {"c": 3}
    assert numbering.drop("pkg/msg/Foo.a") == {"a": 1}
    assert sequence("b a:string c", lock=numbering.lock_text())[0] == Numbers({"b": 2, "a": 3, "c": 4})
    assert numbering.drop("pkg/msg/Foo") == {"b": 2}
    assert numbering.messages == {}


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("pkg/msg/Fo", f"{LOCK} has no message 'pkg/msg/Fo'; did you mean pkg/msg/Foo?"),
        ("other/msg/Bar.a", f"{LOCK} has no message 'other/msg/Bar'"),
        ("", f"{LOCK} has no message ''"),
        ("pkg/msg/Foo.x", f"{LOCK} has no field 'x' of pkg/msg/Foo; it has a, b"),
        ("pkg/msg/Foo.", f"{LOCK} has no field '' of pkg/msg/Foo; it has a, b"),
    ],
)
def test_dropping_what_is_not_there(name: str, error: str) -> None:
    numbering = SequentialNumbering.from_lock(LOCK, sequence("a b", "a")[1])

    with pytest.raises(SchemaError) as caught:
        numbering.drop(name)

    assert str(caught.value) == error


def test_the_lock_file_does_not_depend_on_the_order_of_messages() -> None:
    messages = [message("a b", TypeName("pkg", "msg", name)) for name in "XYZ"]
    texts = set()
    for order in (messages, messages[::-1]):
        numbering = SequentialNumbering.from_lock(LOCK, None)
        for each in order:
            numbering.numbers(each)
        texts.add(numbering.lock_text())
    assert len(texts) == 1


def test_messages_that_are_not_asked_for_stay_in_the_lock_file() -> None:
    _, lock = sequence("a b")
    numbering = SequentialNumbering.from_lock(LOCK, lock)
    numbering.numbers(message("x", TypeName("pkg", "msg", "Other")))
    assert json.loads(numbering.lock_text())["messages"].keys() == {"pkg/msg/Foo", "pkg/msg/Other"}
    assert sequence("a b", lock=numbering.lock_text())[0] == Numbers({"a": 1, "b": 2})


def lock_of(fields: str = "{}", removed: str = "{}") -> str:
    return f'{{"version": 1, "messages": {{"pkg/msg/Foo": {{"fields": {fields}, "removed": {removed}}}}}}}'


@pytest.mark.parametrize(
    ("last", "following"),
    [
        (18_998, 18_999),
        (18_999, 20_000),
        (20_000, 20_001),
        (LARGEST_NUMBER - 1, LARGEST_NUMBER),
        (LARGEST_NUMBER, 1),
    ],
)
def test_numbers_behind_a_high_one(last: int, following: int) -> None:
    numbers, _ = sequence("a b", lock=lock_of(f'{{"a": "{last} sfixed32"}}'))
    assert numbers.fields == {"a": last, "b": following}


DAMAGED = [
    ("", "Expecting value: line 1 column 1 (char 0)"),
    (lock_of()[:-1], "Expecting ',' delimiter: line 1 column 74 (char 73)"),
    ("<<<<<<< HEAD\n" + lock_of(), "Expecting value: line 1 column 1 (char 0)"),
    ("[]", "it is not a lock file of rosidl-proto"),
    ("1", "it is not a lock file of rosidl-proto"),
    ("null", "it is not a lock file of rosidl-proto"),
    ("[" * 100_000, "it is not a lock file of rosidl-proto"),
    ("{}", "'version' is missing"),
    ('{"version": 1}', "'messages' is missing"),
    ('{"version": 1, "messages": []}', "it is not a lock file of rosidl-proto"),
    ('{"version": 1, "messages": {"pkg/msg/Foo": []}}', "it is not a lock file of rosidl-proto"),
    ('{"version": 1, "messages": {"pkg/msg/Foo": {}}}', "'fields' is missing"),
    ('{"version": 1, "messages": {"pkg/msg/Foo": {"fields": {}}}}', "'removed' is missing"),
    (lock_of('{"a": 1}'), "it is not a lock file of rosidl-proto"),
    (lock_of('{"a": "sfixed32"}'), "'a' has 'sfixed32' instead of a number and a type"),
    (lock_of('{"a": "1"}'), "'a' has '1' instead of a number and a type"),
    (lock_of('{"a": "1 bytes (u8[])"}'), "'a' has '1 bytes (u8[])' instead of a number and a type"),
    (lock_of('{"a": "1 bytes (p/msg/A)"}'), "'a' has '1 bytes (p/msg/A)' instead of a number and a type"),
    (lock_of('{"a": "1 p.msg.pb.A (A)"}'), "'a' has '1 p.msg.pb.A (A)' instead of a number and a type"),
    (lock_of('{"a": "1 bytes ()"}'), "'a' has '1 bytes ()' instead of a number and a type"),
    (lock_of('{"a": "-1 sfixed32"}'), "'a' has '-1 sfixed32' instead of a number and a type"),
    (lock_of('{"a": "0 sfixed32"}'), "pkg/msg/Foo.a has number 0, which protobuf does not allow"),
    (lock_of('{"a": "19000 sfixed32"}'), "pkg/msg/Foo.a has number 19000, which protobuf does not allow"),
    (lock_of('{"a": "19999 sfixed32"}'), "pkg/msg/Foo.a has number 19999, which protobuf does not allow"),
    (
        lock_of(f'{{"a": "{LARGEST_NUMBER + 1} sfixed32"}}'),
        "pkg/msg/Foo.a has number 536870912, which protobuf does not allow",
    ),
    (lock_of('{"a": "1 string", "b": "1 string"}'), "pkg/msg/Foo has number 1 for both 'a' and 'b'"),
    (lock_of('{"a": "1 string"}', '{"b": "1 string"}'), "pkg/msg/Foo has number 1 for both 'a' and 'b'"),
    (lock_of('{"a": "1 string", "a": "2 string"}'), "'a' stands in it twice"),
    (
        lock_of('{"a": "1 string"}', '{"a": "2 string"}'),
        "pkg/msg/Foo has 'a' both as a field and as a removed one",
    ),
]


@pytest.mark.parametrize(("text", "reason"), DAMAGED, ids=[reason for _, reason in DAMAGED])
def test_damaged_lock_files(text: str, reason: str) -> None:
    with pytest.raises(SchemaError) as caught:
        SequentialNumbering.from_lock(LOCK, text)
    assert str(caught.value) == f"{LOCK} is damaged: {reason}; restore it from version control"


def test_a_lock_file_of_another_version() -> None:
    with pytest.raises(SchemaError) as caught:
        SequentialNumbering.from_lock(LOCK, '{"version": 3}')
    assert str(caught.value) == (
        f"{LOCK} has version 3, this program reads 1 and 2; "
        "use the version of rosidl-proto that wrote it, or a newer one"
    )


@given(st.lists(st.lists(st.sampled_from("abcdef"), unique=True, max_size=6), min_size=1, max_size=8))
def test_a_name_never_changes_its_number(history: list[list[str]]) -> None:
    known: dict[str, int] = {}
    lock = None
    for names in history:
        numbering = SequentialNumbering.from_lock(LOCK, lock)
        numbers = numbering.numbers(message(" ".join(names)))
        everything = {**numbers.fields, **numbers.reserved}
        assert len(set(everything.values())) == len(everything)
        assert known.items() <= everything.items()
        assert list(numbers.fields) == names
        known, lock = everything, numbering.lock_text()
    assert sorted(known.values()) == list(range(1, len(known) + 1))


@given(
    st.text()
    | st.recursive(
        st.none() | st.integers() | st.text(), lambda x: st.lists(x) | st.dictionaries(st.text(), x)
    ).map(json.dumps)
)
def test_garbage_is_refused(text: str) -> None:
    with pytest.raises(SchemaError):
        SequentialNumbering.from_lock(LOCK, text)
