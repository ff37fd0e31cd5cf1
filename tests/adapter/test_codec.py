"""When an adapter has a codec, and what it does without one."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from rosidl_adapter_proto.adapter import FieldInfo, RosNotFoundError, TypeAdapter
from rosidl_adapter_proto.adapter.lazy import CONVERSIONS
from rosidl_adapter_proto.errors import ConversionError, SchemaError
from rosidl_adapter_proto.transcode.codec import Codec

INT32 = 6  # type_description_interfaces/msg/FieldType


@pytest.fixture
def part(things: SimpleNamespace) -> Any:
    """A generated adapter; what derives from it is made by each test."""
    return things.msg.PartAdapter_


def test_generated_adapters_have_one_codec(things: SimpleNamespace, part: Any) -> None:
    assert type(part.codec) is Codec
    assert part.codec is part.codec
    assert part.transcoder is part.codec.transcoder
    assert part.codec.message_class is things.msg.Part
    assert part.to_cdr(things.msg.Part(x=1)) == part.codec.to_cdr(things.msg.Part(x=1))


def test_chosen_fields(things: SimpleNamespace, part: Any) -> None:
    data = part.to_cdr(things.msg.Part(x=1))
    assert part.from_cdr(data, fields=["x"]) == things.msg.Part(x=1)
    assert part.from_cdr(data + b"more", ["x"]) == things.msg.Part(x=1)  # which is not looked at
    with pytest.raises(SchemaError, match="has no field 'y'"):
        part.from_cdr(data, fields=["y"])


def test_chosen_fields_need_a_codec(by_hand: Any) -> None:
    with pytest.raises(TypeError) as caught:
        by_hand.from_cdr(b"", fields=["x"])
    assert str(caught.value) == (
        "by_hand.<locals>.Negative: conversions that were written by hand take whole messages; leave `fields` out"
    )


def test_an_adapter_derived_from_one_in_use(things: SimpleNamespace) -> None:
    part = things.msg.Part(x=1)
    data = things.msg.PartAdapter_.to_cdr(part)

    class Derived(things.msg.PartAdapter_):  # type: ignore[misc, name-defined]
        custom_type = things.msg.PartAdapter

    with pytest.raises(SchemaError):  # its class has other fields
        Derived.from_cdr(data)
    assert things.msg.PartAdapter_.from_cdr(data).x == 1


def test_a_class_that_only_adds_has_a_codec_of_its_own(part: Any) -> None:
    assert part.codec is not None
    derived = type("Derived", (part,), {"more": 1})
    assert derived.codec is not part.codec
    assert derived.codec.message_class is part.custom_type


@pytest.mark.parametrize("name", CONVERSIONS)
@pytest.mark.parametrize("is_in_use", [False, True])
def test_no_codec_where_a_conversion_is_written_by_hand(part: Any, name: str, is_in_use: bool) -> None:
    if is_in_use:
        assert part.codec is not None
    by_hand = {name: staticmethod(lambda *arguments: None)}
    own = type("Own", (part,), by_hand)
    mixed_in = type("MixedIn", (type("Mixin", (), by_hand), part), {})
    for adapter in (own, mixed_in, type("Derived", (own,), {})):
        assert adapter.codec is None
        assert adapter.transcoder is None


def test_no_codec_where_all_is_written_by_hand(things: SimpleNamespace, part: Any) -> None:
    """Not even with all that a generated class has."""

    class Own(TypeAdapter[Any, Any]):
        custom_type = things.msg.PartAdapter
        type_name, type_hash, ros_class = part.type_name, part.type_hash, part.ros_class
        fields = (FieldInfo("y", INT32),)
        convert_to_ros_message = staticmethod(lambda source, destination=None: source)
        convert_to_custom = staticmethod(lambda source, destination=None: source)
        fill_ros_message = staticmethod(lambda source, message: None)
        fill_custom = staticmethod(lambda source, message: None)

    assert Own.codec is None


def test_no_codec_beside_classes_that_protoc_made(
    things: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where a module written by hand is called like a generated one."""
    messages: Any = ModuleType("mine.Part_pb2")
    messages.__file__, messages.DESCRIPTOR = "mine/Part_pb2.py", things.msg.Part.DESCRIPTOR.file
    monkeypatch.setitem(sys.modules, "mine.Part_pb2", messages)

    def convert_to_custom(source: Any, destination: Any = None) -> Any:
        return source

    convert_to_custom.__module__ = "mine.Part_adapter"
    own: Any = type("Own", (things.msg.PartAdapter_,), {"convert_to_custom": staticmethod(convert_to_custom)})
    assert own.codec is None


def test_fields_and_a_class_are_enough_where_nothing_is_converted(things: SimpleNamespace) -> None:
    class Number(TypeAdapter[Any, Any]):
        custom_type = things.msg.PartAdapter
        type_name = "things/msg/Number"
        fields = (FieldInfo("y", INT32),)

    data = Number.to_cdr(things.msg.PartAdapter(y=7))
    assert data == b"\0\1\0\0\7\0\0\0"
    assert Number.from_cdr(data).y == 7


def test_a_class_that_says_its_codec_has_that(part: Any) -> None:
    codec = SimpleNamespace(to_cdr=lambda message: b"mine", from_cdr=lambda data: data, transcoder=None)
    own: Any = type(
        "Own", (part,), {"codec": codec, "convert_to_custom": staticmethod(lambda source: source)}
    )
    assert own.to_cdr(part.custom_type()) == b"mine"
    assert own.from_cdr(b"data") == b"data"
    without: Any = type("Without", (part,), {"codec": None})
    assert without.codec is None


@pytest.fixture
def by_hand(things: SimpleNamespace) -> Any:
    """An adapter of `std_msgs/msg/Int32` with conversions of its own: protobuf has the negative number."""
    pytest.importorskip("std_msgs", reason="needs a ROS installation: pip install '.[ros]'")

    class Negative(TypeAdapter[Any, Any]):
        custom_type = things.msg.PartAdapter
        ros_class = "std_msgs.msg:Int32"

        @staticmethod
        def convert_to_ros_message(source: Any, destination: Any = None) -> Any:
            return Negative.ros_message_type(data=-source.y)

        @staticmethod
        def convert_to_custom(source: Any, destination: Any = None) -> Any:
            return things.msg.PartAdapter(y=-source.data)

    return Negative


def test_without_a_codec_messages_go_through_the_conversions(things: SimpleNamespace, by_hand: Any) -> None:
    data = by_hand.to_cdr(things.msg.PartAdapter(y=-7))
    assert data[4:] == b"\7\0\0\0"
    assert by_hand.from_cdr(memoryview(data)).y == -7
    with pytest.raises(ConversionError) as caught:
        by_hand.from_cdr(b"\0\1\0\0\7")
    reason = "5 bytes are not a serialized message of this type: "
    assert str(caught.value).startswith(f"{by_hand.__qualname__}: {reason}")


def test_without_a_codec_rclpy_is_needed(
    things: SimpleNamespace, by_hand: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rclpy.serialization", None)  # type: ignore[arg-type]
    for call in (lambda: by_hand.to_cdr(things.msg.PartAdapter()), lambda: by_hand.from_cdr(b"")):
        with pytest.raises(RosNotFoundError) as caught:
            call()
        assert str(caught.value) == (
            f"{by_hand.__qualname__}: cannot import rclpy.serialization "
            "(import of rclpy.serialization halted; None in sys.modules); "
            "source a ROS 2 installation that has it, or install it with pip"
        )


def test_methods_written_by_hand_can_use_those_of_the_base(things: SimpleNamespace, by_hand: Any) -> None:
    class Framed(by_hand):  # type: ignore[misc]
        @classmethod
        def to_cdr(cls, source: Any) -> bytes:
            return b"frame " + super().to_cdr(source)

    message = things.msg.PartAdapter(y=1)
    assert Framed.to_cdr(message) == b"frame " + by_hand.to_cdr(message)


def test_each_class_has_the_ros_class_that_it_names(by_hand: Any) -> None:
    from std_msgs.msg import Int16, Int32

    assert by_hand.ros_message_type is Int32
    assert type("Derived", (by_hand,), {}).ros_message_type is Int32  # type: ignore[attr-defined]
    assert type("Other", (by_hand,), {"ros_class": "std_msgs.msg:Int16"}).ros_message_type is Int16  # type: ignore[attr-defined]
    assert type("Given", (by_hand,), {"ros_message_type": Int16}).ros_message_type is Int16  # type: ignore[attr-defined]
