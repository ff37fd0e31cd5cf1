"""Stands for the package message_filters of ROS, of which there is no wheel.

It has the classes that people use, simpler, and asks of rclpy and of messages exactly what the Python of ROS 2's
message_filters (Humble to Rolling) asks:

- `Subscriber(node, type, topic, ...)` calls `node.create_subscription` with the type, the topic and its own method
  `callback`, by position or by keyword, and what else it got, where `qos_profile` is 10 unless it is given; it has
  `topic` and `getTopic()`, and for all else it is its subscription;
- `TimeSynchronizer` calls `Time.from_msg(msg.header.stamp)`, without looking;
- `Cache` and `ApproximateTimeSynchronizer` do so if the message has a `header`, that a `stamp`, and that no
  `nanoseconds`; otherwise they take the time of arrival, if they may. Times are compared, and made of nanoseconds with
  the `clock_type` of the others.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.clock import ROSClock
from rclpy.duration import Duration
from rclpy.time import Time


class SimpleFilter:
    """Passes messages on to what is registered."""

    def __init__(self) -> None:
        self.callbacks: list[tuple[Callable[..., Any], tuple[Any, ...]]] = []

    def registerCallback(self, callback: Callable[..., Any], *arguments: Any) -> int:
        self.callbacks.append((callback, arguments))
        return len(self.callbacks) - 1

    def signalMessage(self, *messages: Any) -> None:
        for callback, arguments in self.callbacks:
            callback(*messages, *arguments)


class Subscriber(SimpleFilter):
    """A subscription as a filter."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__()
        self.node, self.topic = arguments[0], arguments[2]
        options.setdefault("qos_profile", 10)
        self.sub = self._subscribe(*arguments[1:], **options)

    def _subscribe(self, *arguments: Any, **options: Any) -> Any:
        return self.node.create_subscription(*arguments, self.callback, **options)

    def callback(self, message: Any) -> None:
        self.signalMessage(message)

    def getTopic(self) -> str:
        return str(self.topic)

    def __getattr__(self, name: str) -> Any:
        return self.sub.__getattribute__(name)


class OldSubscriber(Subscriber):
    """As in older versions: the callback is given by keyword."""

    def _subscribe(self, *arguments: Any, **options: Any) -> Any:
        return self.node.create_subscription(*arguments, callback=self.callback, **options)


def stamp_of(message: Any, allow_headerless: bool) -> Any:
    """Return the time of a message, or None."""
    if not hasattr(message, "header") or not hasattr(message.header, "stamp"):
        return ROSClock().now() if allow_headerless else None
    stamp = message.header.stamp
    return stamp if hasattr(stamp, "nanoseconds") else Time.from_msg(stamp)


class Cache(SimpleFilter):
    """Keeps the last messages, in the order of arrival."""

    def __init__(self, source: SimpleFilter, cache_size: int = 1, allow_headerless: bool = False) -> None:
        super().__init__()
        self.size, self.allow_headerless = cache_size, allow_headerless
        self.kept: list[tuple[Any, Any]] = []
        source.registerCallback(self.add)

    def add(self, message: Any) -> None:
        stamp = stamp_of(message, self.allow_headerless)
        if stamp is not None:
            self.kept = [*self.kept, (stamp, message)][-self.size :]
            self.signalMessage(message)

    def getInterval(self, first: Any, last: Any) -> list[Any]:
        return [message for stamp, message in self.kept if first <= stamp <= last]

    def getElemBeforeTime(self, time: Any) -> Any:
        found = [message for stamp, message in self.kept if stamp <= time]
        return found[-1] if found else None


class TimeSynchronizer(SimpleFilter):
    """Passes on messages with the same stamp, one of each filter."""

    def __init__(self, filters: Sequence[SimpleFilter], queue_size: int) -> None:
        super().__init__()
        self.lock, self.queue_size = threading.Lock(), queue_size
        self.queues: list[dict[int, Any]] = [{} for _ in filters]
        for index, each in enumerate(filters):
            each.registerCallback(self.add, self.queues[index], index)

    def add(self, message: Any, queue: dict[int, Any], index: int) -> None:
        with self.lock:
            self.keep(Time.from_msg(message.header.stamp), message, queue)
            for stamp in sorted(set.intersection(*map(set, self.queues))):
                self.signalMessage(*(each.pop(stamp) for each in self.queues))

    def keep(self, stamp: Any, message: Any, queue: dict[int, Any]) -> None:
        queue[stamp.nanoseconds] = message
        while len(queue) > self.queue_size:
            del queue[min(queue)]


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Passes on messages whose stamps differ by less than `slop` seconds, one of each filter."""

    def __init__(
        self, filters: Sequence[SimpleFilter], queue_size: int, slop: float, allow_headerless: bool = False
    ) -> None:
        super().__init__(filters, queue_size)
        self.slop, self.allow_headerless = Duration(seconds=slop), allow_headerless

    def add(self, message: Any, queue: dict[int, Any], index: int) -> None:
        stamp = stamp_of(message, self.allow_headerless)
        if stamp is None:
            return
        with self.lock:
            self.keep(stamp, message, queue)
            queues = [{stamp.nanoseconds: message} if each is queue else each for each in self.queues]
            for stamps in itertools.product(*queues):
                times = [Time(nanoseconds=each, clock_type=stamp.clock_type) for each in stamps]
                if max(times) - min(times) < self.slop:
                    found = zip(self.queues, stamps, strict=True)
                    self.signalMessage(*(each.pop(key) for each, key in found))
                    return
