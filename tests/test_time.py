"""Times and durations, against what protobuf itself makes of them."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from types import SimpleNamespace
from typing import Any

import pytest
from google.protobuf.duration_pb2 import Duration as GoogleDuration
from google.protobuf.timestamp_pb2 import Timestamp
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import ConversionError
from rosidl_adapter_proto.schema.registry import TypeRegistry
from rosidl_adapter_proto.time import set_stamp, to_datetime, to_message, to_nanoseconds, to_timedelta

REGISTRY = (
    TypeRegistry()
)  # what is installed, as for all that tests generate: a process has one version of a type
Time = REGISTRY["builtin_interfaces/msg/Time"].message_class
Duration = REGISTRY["builtin_interfaces/msg/Duration"].message_class
Header = REGISTRY["std_msgs/msg/Header"].message_class
Imu = REGISTRY["sensor_msgs/msg/Imu"].message_class
String = REGISTRY["std_msgs/msg/String"].message_class

NANOSECONDS = st.integers(-(2**31) * 10**9, (2**31) * 10**9 - 1)
"""What 32 bits of seconds can hold."""

INDIA = timezone(timedelta(hours=5, minutes=30))


@pytest.mark.parametrize(
    ("nanoseconds", "ros", "google"),
    [
        (0, (0, 0), (0, 0)),
        (1_700_000_000, (1, 700_000_000), (1, 700_000_000)),
        (-1_700_000_000, (-2, 300_000_000), (-1, -700_000_000)),
        (-1, (-1, 999_999_999), (0, -1)),
        (-1_000_000_000, (-1, 0), (-1, 0)),
        (2**31 * 10**9 - 1, (2**31 - 1, 999_999_999), (2**31 - 1, 999_999_999)),
        (-(2**31) * 10**9, (-(2**31), 0), (-(2**31), 0)),
    ],
)
def test_signs(nanoseconds: int, ros: tuple[int, int], google: tuple[int, int]) -> None:
    duration = to_message(nanoseconds, Duration)
    assert (duration.sec, duration.nanosec) == ros
    time = to_message(nanoseconds, Time)
    assert (time.sec, time.nanosec) == ros
    of_google = to_message(duration, GoogleDuration)
    assert (of_google.seconds, of_google.nanos) == google
    timestamp = to_message(time, Timestamp)  # which counts up, as ROS does
    assert (timestamp.seconds, timestamp.nanos) == ros


@given(NANOSECONDS)
def test_nothing_is_lost(nanoseconds: int) -> None:
    for message_class in (Time, Timestamp, Duration, GoogleDuration):
        assert to_nanoseconds(to_message(nanoseconds, message_class)) == nanoseconds
    assert to_message(to_message(nanoseconds, Time), Timestamp).ToNanoseconds() == nanoseconds
    assert to_message(to_message(nanoseconds, Duration), GoogleDuration).ToNanoseconds() == nanoseconds
    assert to_message(to_message(nanoseconds, Timestamp), Time) == to_message(nanoseconds, Time)
    assert to_message(to_message(nanoseconds, GoogleDuration), Duration) == to_message(nanoseconds, Duration)


@given(NANOSECONDS)
def test_datetime_and_timedelta_are_as_protobuf_makes_them(nanoseconds: int) -> None:
    timestamp, duration = Timestamp(), GoogleDuration()
    timestamp.FromNanoseconds(nanoseconds)
    duration.FromNanoseconds(nanoseconds)
    assert to_datetime(to_message(nanoseconds, Time)) == timestamp.ToDatetime(tzinfo=timezone.utc)
    assert to_timedelta(to_message(nanoseconds, Duration)) == duration.ToTimedelta()


@given(
    st.datetimes(datetime(1, 1, 2), datetime(9999, 12, 30), timezones=st.sampled_from([timezone.utc, INDIA]))
)
def test_datetimes_come_back(time: datetime) -> None:
    timestamp = to_message(time, Timestamp)
    expected = Timestamp()
    expected.FromDatetime(time)
    assert timestamp == expected
    assert to_datetime(timestamp) == time
    assert to_datetime(timestamp).tzinfo is timezone.utc


@given(st.timedeltas(timedelta(days=-3_652_000), timedelta(days=3_652_000)))
def test_timedeltas_come_back(duration: timedelta) -> None:
    expected = GoogleDuration()
    expected.FromTimedelta(duration)
    assert to_message(duration, GoogleDuration) == expected
    assert to_timedelta(expected) == duration


def of_ros(name: str, **fields: int) -> Any:
    """Return what looks like a message of ROS."""
    return type(name, (SimpleNamespace,), {"__module__": "builtin_interfaces.msg._x"})(**fields)


class Index:
    """An integer of another library, such as numpy's."""

    def __index__(self) -> int:
        return 1_500_000_000


@pytest.mark.parametrize(
    "time",
    [
        Time(sec=1, nanosec=500_000_000),
        Time(nanosec=1_500_000_000),
        of_ros("Time", sec=1, nanosec=500_000_000),
        Timestamp(seconds=1, nanos=500_000_000),
        datetime(1970, 1, 1, 5, 30, 1, 500_000, tzinfo=INDIA),
        SimpleNamespace(nanoseconds=1_500_000_000, clock_type=None),
        1_500_000_000,
        Index(),
    ],
    ids=repr,
)
def test_times(time: Any) -> None:
    assert to_nanoseconds(time, "time") == to_nanoseconds(time) == 1_500_000_000
    assert to_message(time, Time) == Time(sec=1, nanosec=500_000_000)
    if not isinstance(time, (int, Index)):
        with pytest.raises(TypeError, match=r"^expected a duration, not [\w.]+, which is a time$"):
            to_timedelta(time)


@pytest.mark.parametrize(
    "duration",
    [
        Duration(sec=-2, nanosec=300_000_000),
        Duration(sec=-4, nanosec=2_300_000_000),
        of_ros("Duration", sec=-2, nanosec=300_000_000),
        GoogleDuration(seconds=-1, nanos=-700_000_000),
        timedelta(seconds=-2, microseconds=300_000),
        SimpleNamespace(nanoseconds=-1_700_000_000),
        -1_700_000_000,
    ],
    ids=repr,
)
def test_durations(duration: Any) -> None:
    assert to_nanoseconds(duration, "duration") == to_nanoseconds(duration) == -1_700_000_000
    assert to_message(duration, Duration) == Duration(sec=-2, nanosec=300_000_000)
    if not isinstance(duration, int):
        with pytest.raises(TypeError, match=r"^expected a time, not [\w.]+, which is a duration$"):
            to_datetime(duration)


@pytest.mark.parametrize("value", [1.5, "1", None, String(), of_ros("Point", x=1), object()], ids=repr)
def test_what_is_no_time(value: Any) -> None:
    for convert in (to_datetime, to_timedelta, to_nanoseconds, lambda value: to_message(value, Time)):
        with pytest.raises(TypeError, match=r"^expected a (time|duration|time or duration), not [\w.]+$"):
            convert(value)


STEADY = SimpleNamespace(nanoseconds=5, clock_type=SimpleNamespace(name="STEADY_TIME"))


@pytest.mark.parametrize(
    ("convert", "error", "message"),
    [
        (
            lambda: to_message(datetime(2038, 1, 19, 3, 14, 8, tzinfo=timezone.utc), Time),
            ConversionError,
            "builtin_interfaces/msg/Time.sec: 2147483648 is not in the range from -2147483648 to 2147483647",
        ),
        (
            lambda: to_message(timedelta(days=-30_000), Duration),
            ConversionError,
            "builtin_interfaces/msg/Duration.sec: -2592000000 is not in the range from -2147483648 to 2147483647",
        ),
        (
            lambda: to_message(-(10**21), Timestamp),
            ConversionError,
            "google.protobuf.Timestamp.seconds: -1000000000000 is not in the range "
            "from -62135596800 to 253402300799",
        ),
        (
            lambda: to_message(-(10**21), GoogleDuration),
            ConversionError,
            "google.protobuf.Duration.seconds: -1000000000000 is not in the range "
            "from -315576000000 to 315576000000",
        ),
        (
            lambda: to_datetime(10**21),
            ConversionError,
            "datetime.datetime: 1000000000000000000000 nanoseconds since 1970 are not in the years from 1 to 9999",
        ),
        (
            lambda: to_timedelta(10**24),
            ConversionError,
            "datetime.timedelta: 1000000000000000000000000 nanoseconds are more than 999999999 days",
        ),
        (
            lambda: to_nanoseconds(datetime(2026, 1, 1)),
            ConversionError,
            "datetime.datetime: has no time zone, so it is no point in time; "
            "give it one, as datetime.now(timezone.utc) has",
        ),
        (
            lambda: to_datetime(STEADY),
            ConversionError,
            "rclpy.time.Time.clock_type: is STEADY_TIME, which does not count from 1970; "
            "take the time of another clock",
        ),
        (
            lambda: to_message(STEADY, Timestamp),
            ConversionError,
            "rclpy.time.Time.clock_type: is STEADY_TIME, which does not count from 1970; "
            "take the time of another clock",
        ),
        (
            lambda: to_message(1, String),
            TypeError,
            "std_msgs.msg.pb.String is no message of a time or a duration, "
            "such as Time and Duration of builtin_interfaces, or Timestamp and Duration of google.protobuf",
        ),
        (
            lambda: set_stamp(String(), 1),
            TypeError,
            "std_msgs.msg.pb.String is no protobuf message with a header or a stamp",
        ),
        (
            lambda: set_stamp(of_ros("Header", stamp=None), 1),
            TypeError,
            "builtin_interfaces.msg._x.Header is no protobuf message with a header or a stamp",
        ),
    ],
)
def test_errors(convert: Callable[[], Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=f"^{re.escape(message)}$"):
        convert()


def test_steady_times_are_messages_of_ros() -> None:
    """As with rclpy: what such a message counts from is agreed on by those who exchange it."""
    assert to_message(STEADY, Time) == Time(nanosec=5)


def test_stamps() -> None:
    imu, header = Imu(), Header(frame_id="map")
    set_stamp(imu, 1_500_000_000)
    set_stamp(header, datetime(1970, 1, 1, tzinfo=timezone.utc))
    assert imu == Imu(header={"stamp": {"sec": 1, "nanosec": 500_000_000}})
    assert header.HasField("stamp")
    assert header == Header(stamp=Time(), frame_id="map")
    with pytest.raises(ConversionError):
        set_stamp(imu, 10**30)
    assert imu.header.stamp.sec == 1
