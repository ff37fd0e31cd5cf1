"""Times and durations: between ROS's messages as protobuf, protobuf's own, `datetime`, and nanoseconds.

All of them are whole nanoseconds on the way, so that nothing is rounded except where `datetime` has only microseconds.
What rclpy and ROS have is read here too, by what it looks like, and without ROS; `ros/time.py` makes rclpy's.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING, Any, Literal, Protocol, SupportsIndex, TypeVar

from google.protobuf.message import Message

from rosidl_adapter_proto.errors import ConversionError

if TYPE_CHECKING:

    class RosForm(Protocol):
        """`builtin_interfaces/msg/Time` or `Duration`: a protobuf message, or one of ROS."""

        @property
        def sec(self) -> int: ...

        @property
        def nanosec(self) -> int: ...

    class GoogleForm(Protocol):
        """`google.protobuf.Timestamp` or `Duration`."""

        @property
        def seconds(self) -> int: ...

        @property
        def nanos(self) -> int: ...

    class RclpyTime(Protocol):
        """`rclpy.time.Time`."""

        @property
        def nanoseconds(self) -> int: ...

        @property
        def clock_type(self) -> Any: ...

    class RclpyDuration(Protocol):
        """`rclpy.duration.Duration`."""

        @property
        def nanoseconds(self) -> int: ...

        def get_c_duration(self) -> Any: ...

    Time = datetime | RosForm | GoogleForm | RclpyTime | SupportsIndex
    """What can be converted as a time; a number is the nanoseconds since 1970 (UTC)."""

    Duration = timedelta | RosForm | GoogleForm | RclpyDuration | SupportsIndex
    """What can be converted as a duration; a number is its nanoseconds."""

MessageT = TypeVar("MessageT", bound="RosForm | GoogleForm")

Quantity = Literal["time", "duration"]


@dataclass(frozen=True)
class Form:
    """How a message has a time or a duration.

    Attributes:
        type_name: The name of the message.
        quantity: What it has.
        seconds: The field of the seconds.
        nanoseconds: The field of the nanoseconds.
        lowest: The fewest seconds there can be.
        highest: The most seconds there can be.
        has_one_sign: Whether nanoseconds are negative where seconds are: -1.7 s is -1 s and -7e8 ns. Otherwise they
            always count up from the seconds, as in ROS: -1.7 s is -2 s and 3e8 ns.
        is_date: Whether it counts from 1970 by definition, which a time of ROS need not.
    """

    type_name: str
    quantity: Quantity
    seconds: str
    nanoseconds: str
    lowest: int
    highest: int
    has_one_sign: bool = False
    is_date: bool = False


FORMS = {
    ("builtin_interfaces", "Time"): Form(
        "builtin_interfaces/msg/Time", "time", "sec", "nanosec", -(2**31), 2**31 - 1
    ),
    ("builtin_interfaces", "Duration"): Form(
        "builtin_interfaces/msg/Duration", "duration", "sec", "nanosec", -(2**31), 2**31 - 1
    ),
    # From 0001-01-01 to 9999-12-31, and 10,000 years: google/protobuf/timestamp.proto and duration.proto.
    ("google", "Timestamp"): Form(
        "google.protobuf.Timestamp", "time", "seconds", "nanos", -62135596800, 253402300799, is_date=True
    ),
    ("google", "Duration"): Form(
        "google.protobuf.Duration",
        "duration",
        "seconds",
        "nanos",
        -315576000000,
        315576000000,
        has_one_sign=True,
    ),
}
"""The messages that have a time or a duration, by their package and name."""

_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
_MICROSECOND = timedelta(microseconds=1)


def to_nanoseconds(value: Time | Duration, quantity: Quantity | None = None) -> int:
    """Return the nanoseconds of a time since 1970, or of a duration.

    Args:
        value: A protobuf message `builtin_interfaces/msg/Time` or `Duration`, generated or made at run time, or that
            message of ROS; a `google.protobuf.Timestamp` or `Duration`; a `datetime` with a time zone, or a
            `timedelta`; an `rclpy.time.Time` or `rclpy.duration.Duration`; or nanoseconds. The parts of messages are
            summed, also where there are more nanoseconds than a second has, as rclpy does.
        quantity: What it has to be.

    Raises:
        ConversionError: A datetime has no time zone.
        TypeError: It is something else.
    """
    form = _form(type(value))
    if form is not None:
        found: Quantity = form.quantity
        nanoseconds: int = getattr(value, form.seconds) * 10**9 + getattr(value, form.nanoseconds)
    elif isinstance(value, datetime):
        if value.utcoffset() is None:
            reason = (
                "has no time zone, so it is no point in time; give it one, as datetime.now(timezone.utc) has"
            )
            raise ConversionError("datetime.datetime", "", reason)
        found, nanoseconds = "time", (value - _EPOCH) // _MICROSECOND * 1000
    elif isinstance(value, timedelta):
        found, nanoseconds = "duration", value // _MICROSECOND * 1000
    elif hasattr(value, "nanoseconds"):
        found, nanoseconds = "time" if hasattr(value, "clock_type") else "duration", value.nanoseconds
    elif isinstance(value, SupportsIndex):
        return value.__index__()
    else:
        raise TypeError(f"expected a {quantity or 'time or duration'}, not {_name(type(value))}")
    if found != (quantity or found):
        raise TypeError(f"expected a {quantity}, not {_name(type(value))}, which is a {found}")
    return nanoseconds


def to_message(value: Time | Duration, message_class: type[MessageT]) -> MessageT:
    """Return a time or a duration as a message.

    Args:
        value: Anything that `to_nanoseconds` takes.
        message_class: The class of the message: `builtin_interfaces/msg/Time` or `Duration` in protobuf or in ROS, or
            `google.protobuf.Timestamp` or `Duration`.

    Raises:
        ConversionError: It does not fit; or it is the time of a steady clock, which counts from no known date, and is
            to be a Timestamp.
        TypeError: It is a duration where a time is needed, the other way round, or something else.
    """
    form = _form(message_class)
    if form is None:
        raise TypeError(
            f"{_name(message_class)} is no message of a time or a duration, "
            "such as Time and Duration of builtin_interfaces, or Timestamp and Duration of google.protobuf"
        )
    if form.is_date:
        _check_date(value)
    seconds, nanoseconds = divmod(to_nanoseconds(value, form.quantity), 10**9)
    if form.has_one_sign and seconds < 0 < nanoseconds:
        seconds, nanoseconds = seconds + 1, nanoseconds - 10**9
    if not form.lowest <= seconds <= form.highest:
        reason = f"{seconds} is not in the range from {form.lowest} to {form.highest}"
        raise ConversionError(form.type_name, form.seconds, reason)
    message: MessageT = message_class(**{form.seconds: seconds, form.nanoseconds: nanoseconds})
    return message


def to_datetime(time: Time) -> datetime:
    """Return a time as a datetime in UTC, of which parts of a microsecond are cut off.

    Raises:
        ConversionError: It is outside the years 1 to 9999, or is of a steady clock, which counts from no known date.
        TypeError: It is no time.
    """
    _check_date(time)
    nanoseconds = to_nanoseconds(time, "time")
    try:
        return _EPOCH + timedelta(microseconds=nanoseconds // 1000)
    except OverflowError:
        reason = f"{nanoseconds} nanoseconds since 1970 are not in the years from 1 to 9999"
        raise ConversionError("datetime.datetime", "", reason) from None


def to_timedelta(duration: Duration) -> timedelta:
    """Return a duration as a timedelta, of which parts of a microsecond are cut off.

    Raises:
        ConversionError: It is longer than a timedelta can be, 999999999 days.
        TypeError: It is no duration.
    """
    nanoseconds = to_nanoseconds(duration, "duration")
    microseconds = abs(nanoseconds) // 1000
    try:
        return timedelta(microseconds=microseconds if nanoseconds >= 0 else -microseconds)
    except OverflowError:
        reason = f"{nanoseconds} nanoseconds are more than 999999999 days"
        raise ConversionError("datetime.timedelta", "", reason) from None


def set_stamp(message: Message, time: Time) -> None:
    """Set the stamp of a protobuf message.

    Args:
        message: A message with a header, such as `sensor_msgs/msg/Imu`, or with a stamp, such as the header itself.
        time: Anything that `to_nanoseconds` takes as a time, such as `node.get_clock().now()`.

    Raises:
        ConversionError: It does not fit; the message is left as it was.
        TypeError: The message has no stamp, or this is no time.
    """
    stamp = getattr(getattr(message, "header", message), "stamp", None)
    if not isinstance(stamp, Message):
        raise TypeError(f"{_name(type(message))} is no protobuf message with a header or a stamp")
    new: Message = to_message(time, type(stamp))  # type: ignore[type-var]
    stamp.CopyFrom(new)


def _form(kind: type) -> Form | None:
    package, _, rest = _name(kind).partition(".")
    return FORMS.get((package, rest.rpartition(".")[2]))


def _name(kind: type) -> str:
    """Return the full name of a class; of a protobuf message, its own, wherever the class comes from."""
    descriptor = getattr(kind, "DESCRIPTOR", None)
    return str(getattr(descriptor, "full_name", None) or f"{kind.__module__}.{kind.__qualname__}")


def _check_date(time: object) -> None:
    """Refuse the time of a steady clock of rclpy."""
    if getattr(getattr(time, "clock_type", None), "name", "") == "STEADY_TIME":
        reason = "is STEADY_TIME, which does not count from 1970; take the time of another clock"
        raise ConversionError("rclpy.time.Time", "clock_type", reason)
