"""Times and durations of rclpy, made of all that `rosidl_adapter_proto.time` knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.time import Time

from rosidl_adapter_proto.errors import ConversionError
from rosidl_adapter_proto.time import to_nanoseconds

if TYPE_CHECKING:
    from rosidl_adapter_proto import time


def to_rclpy_time(time: time.Time, clock_type: ClockType = ClockType.ROS_TIME) -> Time:
    """Return a time as rclpy has it.

    Args:
        time: Anything that `rosidl_adapter_proto.time.to_nanoseconds` takes as a time.
        clock_type: The clock it is a time of; rclpy compares only times of the same clock. As with
            `rclpy.time.Time.from_msg`, that is by default the one of nodes, `ROS_TIME`.

    Raises:
        ConversionError: It is before 1970, which rclpy has no times for, or after 2262.
        TypeError: It is no time.
    """
    nanoseconds = to_nanoseconds(time, "time")
    if not 0 <= nanoseconds < 2**63:
        reason = f"{nanoseconds} nanoseconds since 1970 are not in the range from 0 to {2**63 - 1}"
        raise ConversionError("rclpy.time.Time", "", reason)
    return Time(nanoseconds=nanoseconds, clock_type=clock_type)


def to_rclpy_duration(duration: time.Duration) -> Duration:
    """Return a duration as rclpy has it.

    Args:
        duration: Anything that `rosidl_adapter_proto.time.to_nanoseconds` takes as a duration.

    Raises:
        ConversionError: It is longer than 292 years.
        TypeError: It is no duration.
    """
    nanoseconds = to_nanoseconds(duration, "duration")
    if not -(2**63) <= nanoseconds < 2**63:
        reason = f"{nanoseconds} nanoseconds are not in the range from {-(2**63)} to {2**63 - 1}"
        raise ConversionError("rclpy.duration.Duration", "", reason)
    return Duration(nanoseconds=nanoseconds)
