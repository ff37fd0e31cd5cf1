"""What conversions do besides converting good values: errors, absent values, destinations, defaults."""

from __future__ import annotations

import array
import math
import pickle
import sys
from types import SimpleNamespace
from typing import Any

import numpy
import pytest

from rosidl_adapter_proto.adapter import RosNotFoundError
from rosidl_adapter_proto.errors import ConversionError


def ros_everything(**fields: Any) -> SimpleNamespace:
    """Return an object with the fields of the ROS message; any object will do."""
    part = SimpleNamespace(x=1, header=SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=2), frame_id="f"))
    values = {
        "flag": True,
        "raw": b"\x07",
        "letter": 65,
        "small": -1,
        "medium": 1,
        "single": 1.5,
        "double_value": 2.5,
        "large": -(2**63),
        "name": "n",
        "short": "abc",
        "wide": "ä𝄞",
        "short_wide": "",
        "raws": [b"a", b"b"],
        "blob": array.array("B", [1, 2]),
        "shorts": array.array("h", [-1]),
        "three_shorts": numpy.array([1, 2, 3], numpy.int16),
        "singles": array.array("f", [1.0]),
        "two_doubles": numpy.array([1.0, 2.0]),
        "few": [1, 2],
        "flags": [True, False],
        "names": ["x"],
        "wides": ["é"],
        "part": part,
        "parts": [part],
        "two_parts": [part, part],
        "few_parts": [part],
    }
    return SimpleNamespace(**{**values, **fields})


def bad_part(**header: Any) -> SimpleNamespace:
    values = {"stamp": SimpleNamespace(sec=1, nanosec=2), "frame_id": "f", **header}
    return SimpleNamespace(x=1, header=SimpleNamespace(**values))


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"flag": 2}, "flag: expected bool, not 2"),
        ({"raw": b""}, "raw: ord() expected a character, but string of length 0 found"),
        ({"letter": 256}, "letter: 256 is not in the range from 0 to 255"),
        ({"small": -129}, "small: -129 is not in the range from -128 to 127"),
        ({"medium": 1.5}, "medium: *"),
        ({"medium": 65536}, "medium: 65536 is not in the range from 0 to 65535"),
        ({"single": 3.5e38}, "single: 3.5e+38 is too large for a float32"),
        ({"large": 2**63}, "large: Value out of range: 9223372036854775808"),
        ({"name": 1}, "name: expected str, not int"),
        ({"name": "\ud800"}, "name: 'utf-8' codec can't encode *"),
        ({"short": "abcd"}, "short: 4 characters, more than the bound of 3"),
        ({"short_wide": "abc"}, "short_wide: 3 characters, more than the bound of 2"),
        ({"raws": [b"a", b"bc"]}, "raws[1]: ord() expected a character, but string of length 2 found"),
        ({"blob": [1] * 5}, "blob: 5 elements, more than the bound of 4"),
        ({"blob": [1, 256]}, "blob[1]: 256 is not in the range from 0 to 255"),
        ({"shorts": [1, 2, 40000]}, "shorts[2]: 40000 is not in the range from -32768 to 32767"),
        ({"shorts": numpy.array([70000])}, "shorts[0]: 70000 is not in the range from -32768 to 32767"),
        ({"three_shorts": [1, 2]}, "three_shorts: 2 elements, but the array has 3"),
        ({"singles": [1.0, 1e39]}, "singles[1]: 1e+39 is too large for a float32"),
        ({"singles": b"abcd"}, "singles: expected a sequence of numbers, not bytes"),
        ({"singles": ["a"]}, "singles[0]: *"),
        ({"two_doubles": [1.0, 2.0, 3.0]}, "two_doubles: 3 elements, but the array has 2"),
        ({"few": [1, -1]}, "few[1]: -1 is not in the range from 0 to 4294967295"),
        ({"few": [1, 2, 3]}, "few: 3 elements, more than the bound of 2"),
        ({"flags": [True]}, "flags: 1 element, but the array has 2"),
        ({"flags": [True, 3]}, "flags[1]: expected bool, not 3"),
        ({"names": "ab"}, "names: expected a sequence, not str"),
        ({"two_doubles": {1.0, 2.0}}, "two_doubles: expected a sequence of numbers, not set"),
        ({"singles": numpy.ones(2, complex)}, "singles: expected real numbers, not complex ones"),
        ({"names": ["a", None]}, "names[1]: expected str, not NoneType"),
        ({"wides": ["a", b"b"]}, "wides[1]: expected str, not bytes"),
        ({"part": None}, "part.x: 'NoneType' object has no attribute 'x'"),
        ({"part": bad_part(frame_id=b"\xff")}, "part.header.frame_id: expected str, not bytes"),
        (
            {"parts": [bad_part(), bad_part(stamp=SimpleNamespace(sec=2**31, nanosec=0))]},
            "parts[1].header.stamp.sec: Value out of range: 2147483648",
        ),
        ({"two_parts": []}, "two_parts: 0 elements, but the array has 2"),
        ({"few_parts": [None, None]}, "few_parts: 2 elements, more than the bound of 1"),
    ],
)
def test_bad_ros_values(things: SimpleNamespace, fields: dict[str, Any], text: str) -> None:
    adapter = things.msg.EverythingAdapter
    destination = adapter.convert_to_custom(ros_everything())
    before = destination.SerializeToString()
    with pytest.raises(ConversionError) as caught:
        adapter.convert_to_custom(ros_everything(**fields), destination)
    expected = f"things/msg/Everything.{text}"
    if expected.endswith("*"):  # the rest is the words of Python or protobuf, which differ between versions
        assert str(caught.value).startswith(expected[:-1])
    else:
        assert str(caught.value) == expected
    assert destination.SerializeToString() == before
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


class FakeEverything:
    """A ROS message class: what `fill_ros_message` needs of one."""

    def __init__(self, **fields: Any) -> None:
        values = ros_everything(
            blob=array.array("B"),
            shorts=array.array("h", [5]),
            singles=array.array("f"),
            few=array.array("I"),
        )
        vars(self).update({**vars(values), **fields})
        self.part = FakePart()


class FakePart:
    def __init__(self) -> None:
        self.x = 0
        self.header = SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id="")


@pytest.fixture
def fake_ros(things: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> Any:
    ros_module = SimpleNamespace(Everything=FakeEverything, Part=FakePart)
    monkeypatch.setitem(sys.modules, "things.msg", ros_module)  # type: ignore[arg-type]
    return things.msg.EverythingAdapter


def test_round_trip_with_any_class(things: SimpleNamespace, fake_ros: Any) -> None:
    custom = fake_ros.convert_to_custom(ros_everything())
    assert fake_ros.convert_to_custom(fake_ros.convert_to_ros_message(custom)) == custom


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"raw": 256}, "raw: 256 is not in the range from 0 to 255"),
        ({"small": 128}, "small: 128 is not in the range from -128 to 127"),
        ({"short": "abcd"}, "short: 4 characters, more than the bound of 3"),
        ({"wide": b"a"}, "wide: 'utf-16-le' codec can't decode byte 0x61 in position 0: truncated data"),
        ({"short_wide": b"a\0b\0c\0"}, "short_wide: 3 characters, more than the bound of 2"),
        ({"blob": b"12345"}, "blob: 5 elements, more than the bound of 4"),
        ({"shorts": [1, -32769]}, "shorts[1]: -32769 is not in the range from -32768 to 32767"),
        ({"three_shorts": [1]}, "three_shorts: 1 element, but the array has 3 (or none, for zeros)"),
        (
            {"three_shorts": [1, 2, 1 << 16]},
            "three_shorts[2]: 65536 is not in the range from -32768 to 32767",
        ),
        ({"two_doubles": [1]}, "two_doubles: 1 element, but the array has 2 (or none, for zeros)"),
        ({"few": [1, 2, 3]}, "few: 3 elements, more than the bound of 2"),
        ({"flags": [True]}, "flags: 1 element, but the array has 2 (or none, for zeros)"),
        (
            {"wides": [b"", b"x"]},
            "wides[1]: 'utf-16-le' codec can't decode byte 0x78 in position 0: truncated data",
        ),
        ({"two_parts": [{}]}, "two_parts: 1 element, but the array has 2 (or none, for zeros)"),
        ({"few_parts": [{}, {}]}, "few_parts: 2 elements, more than the bound of 1"),
    ],
)
def test_bad_protobuf_values(
    things: SimpleNamespace, fake_ros: Any, fields: dict[str, Any], text: str
) -> None:
    destination = FakeEverything(name="before")
    with pytest.raises(ConversionError) as caught:
        fake_ros.convert_to_ros_message(things.msg.Everything(name="after", **fields), destination)
    assert str(caught.value) == f"things/msg/Everything.{text}"
    assert destination.name == "before"


def test_surrogates_that_stand_alone(things: SimpleNamespace, fake_ros: Any) -> None:
    """ROS passes on any code units; only a bound counts them, a pair as one."""
    wide, short_wide = "\udc00a\ud83d\U0001f600\ud800", "\ud800\U0001f600"
    custom = fake_ros.convert_to_custom(ros_everything(wide=wide, short_wide=short_wide, wides=["\ud800"]))
    assert custom.wide == b"\x00\xdca\0\x3d\xd8\x3d\xd8\x00\xde\x00\xd8"
    again = fake_ros.convert_to_ros_message(custom)
    assert (again.wide, again.short_wide, again.wides) == (wide, short_wide, ["\ud800"])
    assert fake_ros.from_cdr(fake_ros.to_cdr(custom)) == custom


def test_absent_arrays_are_zeros(things: SimpleNamespace, fake_ros: Any) -> None:
    message = fake_ros.convert_to_ros_message(things.msg.Everything())
    assert message.three_shorts.tolist() == [0, 0, 0]
    assert message.two_doubles.tolist() == [0.0, 0.0]
    assert message.flags == [False, False]
    assert [part.x for part in message.two_parts] == [0, 0]


def test_not_a_number_and_infinity(things: SimpleNamespace, fake_ros: Any) -> None:
    values = array.array("f", [math.nan, math.inf, -math.inf, -0.0])
    custom = fake_ros.convert_to_custom(ros_everything(single=math.nan, singles=values))
    message = fake_ros.convert_to_ros_message(custom)
    assert math.isnan(message.single)
    assert message.singles.tobytes() == values.tobytes()


def test_destination_is_overwritten(things: SimpleNamespace, fake_ros: Any) -> None:
    custom = things.msg.Everything(names=["old"], blob=b"old")
    assert fake_ros.convert_to_custom(ros_everything(), custom) is custom
    assert custom == fake_ros.convert_to_custom(ros_everything())
    message = FakeEverything()
    assert fake_ros.convert_to_ros_message(custom, message) is message
    assert message.names == ["x"]


def test_wrong_objects(things: SimpleNamespace, fake_ros: Any) -> None:
    with pytest.raises(ConversionError) as caught:
        fake_ros.convert_to_ros_message(things.msg.Part())
    assert str(caught.value) == (
        "things/msg/Everything: expected a protobuf message things.msg.pb.Everything, "
        "not things_root.things.msg.Part_pb2.Part"
    )
    with pytest.raises(ConversionError) as caught:
        fake_ros.convert_to_ros_message(things.msg.Everything(), object())
    assert str(caught.value) == "things/msg/Everything: expected a ROS message as destination, not object"


def test_ros_class_that_is_not_installed(things: SimpleNamespace) -> None:
    with pytest.raises(RosNotFoundError) as caught:
        things.msg.TypeAdapter.convert_to_ros_message(things.msg.Type())
    assert str(caught.value) == (
        "things/msg/Type: cannot import things.msg (No module named 'things'); "
        "source a ROS 2 installation that has it, or install it with pip"
    )


def test_new_applies_default_values(things: SimpleNamespace) -> None:
    message = things.msg.EverythingAdapter.new(flag=True, name="me")
    assert (message.flag, message.raw, message.name, message.single) == (True, 7, "me", 1.5)
    assert message.wide.decode("utf-16-le") == "ä"
    assert message.raws == b"\1\2"
    assert list(message.three_shorts) == [1, 2, 3]
    assert list(message.names) == ["a", "b"]
    assert message.part.x == 3
    assert [part.x for part in message.two_parts] == [3, 3]
    assert not message.parts
    assert things.msg.EverythingAdapter.new(part=things.msg.Part()).part.x == 0
    assert things.srv.Set_RequestAdapter.new().a == 1
