"""The order of time: chunks hold messages in the order in which they arrived, and overlap where some came late."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count

from rosidl_adapter_proto.bags.model import StoredChunk
from rosidl_adapter_proto.transcode.records import Records


@dataclass(frozen=True)
class Run:
    """Messages of one chunk that follow each other in time.

    Attributes:
        records: The chunk.
        indexes: Which of its messages they are, in their order.
    """

    records: Records
    indexes: Sequence[int]


class _Open:
    """A chunk of which some messages are left.

    Attributes:
        position: Where it is in its file: of messages of the same time, those of the first chunk come first.
        times: When its messages were recorded, in nanoseconds, in order.
        done: How many of them were taken.
    """

    def __init__(self, position: tuple[int, int], records: Records) -> None:
        times = records.log_times.tolist()
        self.position = position
        self.records = records
        self.times = sorted(times)
        in_order = self.times == times
        self.indexes = range(len(times)) if in_order else sorted(range(len(times)), key=times.__getitem__)
        self.done = 0

    @property
    def next_time(self) -> int:
        """When its next message was recorded, in nanoseconds."""
        return self.times[self.done]

    def __lt__(self, other: _Open) -> bool:
        return (self.next_time, self.position) < (other.next_time, other.position)

    def run(self, last: _Open | None, end_time: int | None) -> Run:
        """Take the messages that come before those of another chunk, and before a time."""
        stop = len(self.times)
        if last is not None:
            bisect = bisect_right if self.position < last.position else bisect_left
            stop = bisect(self.times, last.next_time, self.done)
        if end_time is not None:
            stop = min(stop, bisect_left(self.times, end_time, self.done))
        run = Run(self.records, self.indexes[self.done : stop])
        self.done = stop
        return run


def in_time_order(chunks: Iterable[StoredChunk], read: Callable[[StoredChunk], Records]) -> Iterator[Run]:
    """Yield the messages of a file in the order in which they were recorded; those of the same time as in the file.

    Only chunks that overlap in time are in memory together.

    Args:
        chunks: The chunks, in the order of their first messages.
        read: Returns the messages of a chunk.
    """
    waiting = iter(chunks)
    pending = next(waiting, None)
    heap: list[_Open] = []
    number = count()
    while pending is not None or heap:
        while pending is not None and (not heap or pending.start_time <= heap[0].next_time):
            records = read(pending)
            if len(records):
                heappush(heap, _Open((pending.position, next(number)), records))
            pending = next(waiting, None)
        if heap:
            first = heappop(heap)
            yield first.run(heap[0] if heap else None, None if pending is None else pending.start_time)
            if first.done < len(first.times):
                heappush(heap, first)
