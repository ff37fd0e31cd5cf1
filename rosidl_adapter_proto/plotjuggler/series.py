"""Time series of bags, as PlotJuggler shows them: what a parser plugin makes of messages, a series for each number."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Any

    import numpy
    import numpy.typing

    from rosidl_adapter_proto.bags.bag import Bag
    from rosidl_adapter_proto.plotjuggler.host import ArrayPolicy, Plugin  # type: ignore[import-not-found]
    from rosidl_adapter_proto.time import Time


@dataclass(frozen=True, eq=False)
class Series:
    """The values that one key has in the messages of a topic.

    Attributes:
        topic: The topic, such as `/imu`.
        key: What it is in the messages, such as `/linear_acceleration/x` or `/ranges[0]`.
        times: When each message was recorded, in nanoseconds since 1970 (int64), in order.
        values: The value in each of these messages: an array of numbers or of bools, of the type that the message has,
            or a list of texts.
    """

    topic: str
    key: str
    times: numpy.typing.NDArray[numpy.int64] = field(repr=False)
    values: numpy.typing.NDArray[Any] | list[str] = field(repr=False)

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


@dataclass(frozen=True)
class BagSeries:
    """The series of a bag.

    Attributes:
        series: Those of a topic stand together, topics by name and keys in the order in which they first came.
        warnings: What is odd, for people: topics that could not be read, messages that were not valid.
    """

    series: tuple[Series, ...]
    warnings: tuple[str, ...]


def read_series(
    bag: Bag,
    topics: Iterable[str] = (),
    fields: Iterable[str] = (),
    plugin: Plugin | None = None,
    start: Time | None = None,
    end: Time | None = None,
    array_policy: ArrayPolicy | None = None,
    progress: Callable[[int], None] | None = None,
) -> BagSeries:
    """Return the time series of a bag.

    Args:
        bag: The bag.
        topics: Only these topics: names, or patterns with `*`; by default all.
        fields: Only these series: names such as `/imu/linear_acceleration/x`, what stands above several, such as
            `/imu/linear_acceleration`, or patterns with `*` and `?`; by default all.
        plugin: What parses the messages; by default our plugins, for protobuf, CDR and ROS 1. A plugin that is given
            parses the topics of its encoding alone.
        start: Only messages that were recorded at this time or later.
        end: Only messages that were recorded before this time.
        array_policy: What becomes of long arrays; by default what the plugin does by itself.
        progress: Called with a number of messages once they are parsed.

    Raises:
        BagError: The bag is damaged, or has no such topic.
        PluginError: The plugin breaks its contract.
        RequestError: No series has one of the names.
    """
    raise NotImplementedError
