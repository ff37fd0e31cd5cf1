"""Times and durations of rclpy, against what rclpy makes of ROS's own messages."""

from __future__ import annotations

import re
from datetime import datetime, timedelta, timezone
from typing import Any

import pytest
from google.protobuf.duration_pb2 import Duration as GoogleDuration
from google.protobuf.timestamp_pb2 import Timestamp
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import ConversionError
from rosidl_adapter_proto.time import set_stamp, to_datetime, to_message, to_nanoseconds, to_timedelta
from tests.ros import examples

pytest.importorskip("rclpy", reason="needs rclpy: pip install '.[ros]', or source a ROS 2 installation")

import builtin_interfaces.msg  # type: ignore[import-untyped]
import rclpy.duration
import rclpy.time
from rclpy.clock import Clock
from rclpy.clock_type import ClockType

from rosidl_adapter_proto.ros import to_rclpy_duration, to_rclpy_time

CLOCKS = [ClockType.ROS_TIME, ClockType.SYSTEM_TIME, ClockType.STEADY_TIME]


@pytest.fixture(scope="module")
def messages(ros: None) -> tuple[Any, Any]:
    """The generated protobuf classes Time and Duration."""
    from rosidl_proto.builtin_interfaces.msg import Duration, Time

    return Time, Duration


@given(nanoseconds=st.integers(0, 2**31 * 10**9 - 1))
def test_times(messages: tuple[Any, Any], nanoseconds: int) -> None:
    time_class, _ = messages
    time = rclpy.time.Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME)
    of_ros = time.to_msg()
    message = to_message(time, time_class)
    assert (message.sec, message.nanosec) == (of_ros.sec, of_ros.nanosec)
    assert to_message(of_ros, time_class) == message
    assert to_message(message, builtin_interfaces.msg.Time) == of_ros
    assert to_rclpy_time(message) == to_rclpy_time(to_message(time, Timestamp)) == time
    assert rclpy.time.Time.from_msg(message) == rclpy.time.Time.from_msg(of_ros) == time


@given(nanoseconds=st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1))
def test_durations(messages: tuple[Any, Any], nanoseconds: int) -> None:
    _, duration_class = messages
    duration = rclpy.duration.Duration(nanoseconds=nanoseconds)
    of_ros = duration.to_msg()
    message = to_message(duration, duration_class)
    assert (message.sec, message.nanosec) == (of_ros.sec, of_ros.nanosec)
    assert to_message(of_ros, duration_class) == message
    assert to_message(message, builtin_interfaces.msg.Duration) == of_ros
    assert to_rclpy_duration(message) == duration
    assert to_rclpy_duration(to_message(duration, GoogleDuration)) == duration
    assert rclpy.duration.Duration.from_msg(message) == duration


@pytest.mark.parametrize("clock_type", CLOCKS, ids=lambda each: each.name)
def test_clocks(messages: tuple[Any, Any], clock_type: Any) -> None:
    now = Clock(clock_type=clock_type).now()
    stamp = to_message(now, messages[0])
    assert to_rclpy_time(stamp, clock_type) == now
    assert rclpy.time.Time.from_msg(stamp, clock_type=clock_type) == now
    assert (
        rclpy.time.Time.from_msg(msg=stamp).clock_type
        == to_rclpy_time(stamp).clock_type
        == ClockType.ROS_TIME
    )
    if clock_type == ClockType.STEADY_TIME:
        with pytest.raises(ConversionError, match="STEADY_TIME, which does not count from 1970"):
            to_datetime(now)
    else:
        assert to_datetime(now) == to_datetime(stamp) == to_datetime(now.nanoseconds)


def test_datetimes() -> None:
    time = datetime(2026, 1, 2, tzinfo=timezone.utc)
    assert to_rclpy_time(time).nanoseconds == to_nanoseconds(time)
    assert to_rclpy_duration(timedelta(seconds=-1.5)) == rclpy.duration.Duration(nanoseconds=-1_500_000_000)
    assert to_timedelta(rclpy.duration.Duration(nanoseconds=-1_500)) == timedelta(microseconds=-1)


def test_stamps(node: Any) -> None:
    now = node.get_clock().now()
    for type_name in ("sensor_msgs/msg/Imu", "std_msgs/msg/Header"):
        adapter = examples.adapter(type_name)
        message = adapter.new()
        set_stamp(message, now)
        header = getattr(adapter.convert_to_ros_message(message), "header", None) or message
        assert to_rclpy_time(header.stamp) == now
        set_stamp(message, now.to_msg())
        assert to_rclpy_time(header.stamp) == now


@pytest.mark.parametrize(
    ("convert", "value", "message"),
    [
        (to_rclpy_time, -1, "rclpy.time.Time: -1 nanoseconds since 1970 are not in the range from 0 to {}"),
        (
            to_rclpy_time,
            2**63,
            "rclpy.time.Time: {1} nanoseconds since 1970 are not in the range from 0 to {0}",
        ),
        (
            to_rclpy_duration,
            2**63,
            "rclpy.duration.Duration: {1} nanoseconds are not in the range from -{1} to {0}",
        ),
    ],
)
def test_what_rclpy_cannot_hold(convert: Any, value: int, message: str) -> None:
    with pytest.raises(ConversionError, match=f"^{re.escape(message.format(2**63 - 1, 2**63))}$"):
        convert(value)


def test_from_msg_takes_what_it_took_and_times_of_protobuf(messages: tuple[Any, Any]) -> None:
    time_class, duration_class = messages
    for value in (None, 1, object()):
        with pytest.raises(TypeError, match=r"^Must pass a builtin_interfaces\.msg\.Time object$"):
            rclpy.time.Time.from_msg(value)
    with pytest.raises(TypeError, match=r"^expected a time, not .*\.Duration, which is a duration$"):
        rclpy.time.Time.from_msg(duration_class())
    with pytest.raises(TypeError, match=r"^expected a duration, not .*\.Time, which is a time$"):
        rclpy.duration.Duration.from_msg(time_class())

    class Mine(rclpy.time.Time):
        pass

    assert type(Mine.from_msg(time_class(sec=1))) is Mine
