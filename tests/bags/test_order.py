"""The order of time, against a stable sort of all messages, and how many chunks are in memory for it."""

from __future__ import annotations

from array import array

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.bags.model import StoredChunk
from rosidl_adapter_proto.bags.order import in_time_order
from rosidl_adapter_proto.transcode.records import Records, pack_records, read_records

Chunks = list[list[int]]
"""The log times of each chunk of a file, in the order of the file."""


def stored(times: list[int], position: int, start_time: int | None = None) -> StoredChunk:
    """Return a chunk whose messages are told apart by their data: where the chunk is, and which of it they are."""
    data = [f"{position}.{index}".encode() for index in range(len(times))]
    numbers = array("Q", times)
    zeros = array("I", bytes(4 * len(times)))
    packed = pack_records(array("H", zeros), zeros, numbers, numbers, data)
    start = min(times, default=0) if start_time is None else start_time
    return StoredChunk("", packed, "", len(packed), 0, start, max(times, default=0), position=position)


def merged(chunks: list[StoredChunk]) -> list[tuple[int, str]]:
    """Return the log times and the data of messages in the order of time."""
    runs = in_time_order(
        sorted(chunks, key=lambda chunk: chunk.start_time), lambda chunk: read_records(chunk.data)
    )
    return [
        (run.records.log_times[index], bytes(run.records[index]).decode())
        for run in runs
        for index in run.indexes
    ]


def in_file_order(chunks: Chunks) -> list[tuple[int, str]]:
    return [
        (time, f"{position}.{index}")
        for position, times in enumerate(chunks)
        for index, time in enumerate(times)
    ]


@given(st.lists(st.lists(st.integers(0, 20), max_size=6), max_size=6))
def test_messages_are_sorted_by_time_and_then_as_in_the_file(chunks: Chunks) -> None:
    result = merged([stored(times, position) for position, times in enumerate(chunks)])

    assert result == sorted(in_file_order(chunks), key=lambda message: message[0])


@given(st.lists(st.lists(st.integers(0, 2**64 - 1), max_size=4), max_size=4))
def test_all_times_there_are(chunks: Chunks) -> None:
    result = merged([stored(times, position) for position, times in enumerate(chunks)])

    assert result == sorted(in_file_order(chunks), key=lambda message: message[0])


@given(st.lists(st.tuples(st.lists(st.integers(0, 9), max_size=4), st.integers(0, 9)), max_size=5))
def test_nothing_is_lost_where_chunks_lie_about_their_start(chunks: list[tuple[list[int], int]]) -> None:
    result = merged([stored(times, position, start) for position, (times, start) in enumerate(chunks)])

    assert sorted(result) == sorted(in_file_order([times for times, _ in chunks]))


@pytest.mark.parametrize(
    ("chunks", "most"),
    [
        ([[0, 1], [2, 3], [4, 5]], 1),
        ([[0, 2], [2, 4], [4, 6]], 2),
        ([[0, 9], [1, 2], [3, 4], [5, 6]], 2),
        ([[0, 9], [1, 9], [2, 9]], 3),
    ],
)
def test_only_chunks_that_overlap_are_in_memory(chunks: Chunks, most: int) -> None:
    opened: list[StoredChunk] = []

    def read(chunk: StoredChunk) -> Records:
        opened.append(chunk)
        return read_records(chunk.data)

    left = {position: len(times) for position, times in enumerate(chunks)}
    for run in in_time_order([stored(times, position) for position, times in enumerate(chunks)], read):
        assert sum(left[chunk.position] > 0 for chunk in opened) <= most
        for index in run.indexes:
            left[int(bytes(run.records[index]).split(b".")[0])] -= 1

    assert set(left.values()) == {0}


def test_a_chunk_in_order_is_one_run() -> None:
    runs = list(in_time_order([stored([1, 1, 2, 3], 0)], lambda chunk: read_records(chunk.data)))

    assert [run.indexes for run in runs] == [range(4)]
