"""What a time series is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

Values: TypeAlias = "NDArray[Any] | list[str]"


@dataclass(frozen=True, eq=False)
class Series:
    """The values that one key has in the messages of a topic.

    Attributes:
        topic: The topic, such as `/imu`.
        key: What it is in the messages, such as `/linear_acceleration/x` or `/ranges[0]`.
        times: When each message was recorded, in nanoseconds since 1970 (int64), in order.
        values: The value in each of these messages: an array of numbers or of bools, of the type that the message has,
            or a list of texts.
        messages: Which message of the topic each value is of, in the order of time, counted from 0; None if each
            message has one value.
    """

    topic: str
    key: str
    times: NDArray[numpy.int64] = field(repr=False)
    values: Values = field(repr=False)
    messages: NDArray[numpy.int64] | None = field(default=None, repr=False)

    @property
    def name(self) -> str:
        """The name that it has in PlotJuggler: topic and key in one, such as `/imu/linear_acceleration/x`."""
        return self.topic + self.key

    @property
    def type_name(self) -> str:
        """What its values are: a type of numpy, such as `float64`, or `string`."""
        return "string" if isinstance(self.values, list) else str(self.values.dtype)

    def __len__(self) -> int:
        return len(self.times)
