"""Imports all of `contract_msgs` as some version generated it, and converts each message there and back.

The messages of ROS are imitated, so that this needs no ROS. Every type goes to standard output, a message with its CDR.
Nothing is asked for by name that only a newer version has: older modules do not have it.
"""

from __future__ import annotations

import sys
from array import array
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy
from rosidl_proto.contract_msgs import action, msg, srv

from rosidl_adapter_proto.adapter import ActionAdapter, ServiceAdapter, TypeAdapter


class Part(SimpleNamespace):
    """What ROS has as `contract_msgs.msg.Part`, with default values."""

    def __init__(self) -> None:
        super().__init__(x=3, values=array("f"), pair=numpy.zeros(2))


class Everything(SimpleNamespace):
    """What ROS has as `contract_msgs.msg.Everything`: what conversions need of a new one."""

    def __init__(self) -> None:
        arrays = {"blob": array("B"), "shorts": array("h"), "singles": array("f"), "few": array("I")}
        super().__init__(**arrays, three_shorts=numpy.zeros(3, numpy.int16), two_doubles=numpy.zeros(2))
        self.part, self.nothing = Part(), SimpleNamespace()


def everything() -> Everything:
    """Return a message in which no field is empty."""
    message, part = Everything(), Part()
    part.values.extend([1.5, -2.0])
    part.pair[:] = 0.5, -0.0
    vars(message).update(
        flag=True,
        raw=b"\x07",
        letter="a",
        wide_letter="ä",
        small=-1,
        medium=65535,
        single=1.5,
        double_value=-0.1,
        large=-(2**63),
        name="näme",
        short_name="abc",
        wide="ä𝄞",
        short_wide="ab",
        raws=[b"a", b"\xff"],
        two_raws=[b"\x00", b"b"],
        letters=["a", "b", "c"],
        two_letters=["x", "y"],
        wide_letters=["ä", "z"],
        blob=array("B", [1, 255]),
        shorts=array("h", [-1, 2]),
        three_shorts=numpy.array([1, 2, -3], numpy.int16),
        singles=array("f", [1.0, -2.5]),
        two_doubles=numpy.array([1.0, 2.0]),
        few=array("I", [1, 2**32 - 1]),
        flags=[True, False],
        names=["x", ""],
        two_names=["y", "z"],
        short_names=["abcd"],
        wides=["é", ""],
        part=part,
        parts=[part, Part()],
        two_parts=[Part(), part],
    )
    return message


def converted(adapter: Any, ros_message: Any) -> bytes:
    """Convert a message there and back in every way, or a new one where there is none of ROS, and return its CDR."""
    custom = adapter.new() if ros_message is None else adapter.convert_to_custom(ros_message)
    data: bytes = adapter.codec.to_cdr(custom)
    assert adapter.to_cdr(adapter.from_cdr(data)) == data
    if ros_message is not None:
        assert adapter.convert_to_custom(adapter.convert_to_ros_message(custom)) == custom
        assert adapter.codec.from_cdr(data) == custom
    return data


def main() -> None:
    """Convert, and compare."""
    ros: Any = ModuleType("contract_msgs.msg")
    ros.Part, ros.Everything = Part, Everything
    sys.modules["contract_msgs.msg"] = ros

    filled = {"contract_msgs/msg/Everything": everything(), "contract_msgs/msg/Part": everything().part}
    groups = set()
    for package in (msg, srv, action):
        for found in (getattr(package, name) for name in package.__all__):
            if issubclass(found, (ServiceAdapter, ActionAdapter)):
                groups.add(found.type_name)  # also by the name of the service or action
            elif issubclass(found, TypeAdapter):
                print(found.type_name, converted(found, filled.get(found.type_name)).hex())
    print(*sorted(groups), sep="\n")

    adapter = msg.EverythingAdapter
    custom = adapter.convert_to_custom(everything())
    assert all(getattr(custom, info.name) for info in adapter.fields if info.name != "nothing")
    assert (adapter.new().medium, adapter.new().part.x, adapter.DEBUG, adapter.NAME) == (7, 3, 10, "x")
    assert srv.SetAdapter.request.new().on is True
    assert action.GoAdapter.send_goal.request.custom_type is action.Go_SendGoal_Request


main()
