"""Damaged bags that are read all the same: what is whole is what a conversion with `--on-error skip` has."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from mcap.opcode import Opcode
from mcap.writer import CompressionType

from rosidl_adapter_proto.bags.bag import Bag, open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.errors import BagError
from tests.bags.databases import Row, database
from tests.bags.recordings import START, contents, mcap_bytes, string_cdr, strings
from tests.bags.test_mcap_damage import change, places
from tests.bags.test_ros1 import BAG

pytestmark = pytest.mark.usefixtures("folder")

Message = tuple[str, int, bytes]
"""Topic, log time and data."""

MESSAGES = strings("/a", 40) + strings("/b", 40)


def salvaged(path: str, topics: str | None = None) -> tuple[list[Message], Bag]:
    """Return the messages that can be read."""
    bag = open_bag(path, salvage=True)
    return [(each.topic, each.log_time, each.data) for each in bag.messages(topics)], bag


def check(path: str) -> tuple[int, Bag]:
    """Compare what can be read with what a conversion has; return how many messages that is."""
    result = convert_bag(path, "out.mcap", target_format="cdr", on_error="skip")
    converted = contents(Path("out.mcap")).messages
    Path("out.mcap").unlink()

    messages, bag = salvaged(path)

    assert messages == sorted(
        ((each.topic, each.log_time, each.data) for each in converted), key=lambda each: each[1]
    )
    assert bag.is_damaged == result.is_damaged
    if bag.is_damaged:
        assert set(bag.warnings) & set(result.warnings)
        with pytest.raises(BagError):
            list(open_bag(path).messages())
    return len(messages), bag


@pytest.mark.parametrize(
    "options",
    [{}, {"compression": CompressionType.NONE}, {"use_chunking": False}],
    ids=["zstd", "plain", "without chunks"],
)
def test_a_recording_that_was_cut_off_anywhere(options: Mapping[str, Any]) -> None:
    whole = mcap_bytes(sorted(MESSAGES, key=lambda each: each.log_time), **options)
    counts = []
    for size in [*range(150, len(whole), 397), len(whole)]:
        Path("in.mcap").write_bytes(whole[:size])
        counts.append(check("in.mcap")[0])
    assert counts == sorted(counts) and counts[0] < 3 and counts[-1] == 80 and len(set(counts)) > 8


def damaged_chunk() -> bytes:
    """Return a recording with some bytes of a chunk in its middle changed."""
    whole = mcap_bytes(MESSAGES)
    chunk = places(whole, Opcode.CHUNK)[5]
    return change(whole, chunk.end - 40, b"damaged")


@pytest.mark.parametrize("threads", [1, 3])
def test_a_damaged_chunk(threads: int) -> None:
    Path("in.mcap").write_bytes(damaged_chunk())
    count, bag = check("in.mcap")
    assert 70 < count < 80

    assert sum(len(run.indexes) for _, run in bag.runs(["/a", "/b"], threads=threads)) == count
    damage, lost = bag.warnings
    assert "the chunk is damaged: " in damage
    assert lost == f"in.mcap: it says that there are 80 messages of these topics, but {count} were found"
    # What was not read is not told.
    assert salvaged("in.mcap", "/b")[1].is_damaged is False
    with pytest.raises(BagError) as caught:
        list(open_bag("in.mcap").messages())
    assert (
        str(caught.value)
        == f"{damage}; `bag convert --on-error skip`, elsewhere `--salvage`, reads what is whole"
    )


def test_some_of_the_messages() -> None:
    """What was found so far is told at once."""
    Path("in.mcap").write_bytes(damaged_chunk())
    with open_bag("in.mcap", salvage=True) as bag:
        messages = bag.messages("/a")
        assert next(messages) and not bag.is_damaged
        for _ in range(32):
            next(messages)
        assert bag.is_damaged and len(bag.warnings) == 1


def test_messages_that_are_not_there() -> None:
    whole = mcap_bytes(MESSAGES)
    start = int.from_bytes(whole[-28:-20], "little")
    index = places(whole, Opcode.MESSAGE_INDEX)[5]
    Path("in.mcap").write_bytes(change(whole, index.start, bytes([0x91])))
    assert start > index.end
    check("in.mcap")


def pages(*numbers: int) -> Callable[[bytes], bytes]:
    """Return what overwrites pages of a database."""

    def damage(data: bytes) -> bytes:
        for number in numbers:
            data = change(data, 4096 * number, b"\xff" * 4096)
        return data

    return damage


@pytest.mark.parametrize(
    "damage",
    [
        pages(),
        pages(10),
        pages(20, 21, 40),
        lambda data: data[: len(data) // 2 + 100],
        lambda data: data[: 4096 * 13],
    ],
)
def test_sqlite3(damage: Callable[[bytes], bytes]) -> None:
    """In the order of time, also where that is not the order of the table."""
    times = [START + i * 10 - i % 7 * 25 + i % 2 * 3_000_000 for i in range(600)]
    texts = [string_cdr(f"{i} " * 100) for i in range(600)]
    rows = [
        Row(("/a", "/b")[i % 2], time, text) for i, (time, text) in enumerate(zip(times, texts, strict=True))
    ]
    path = database(Path("in.db3"), rows=rows)
    path.write_bytes(damage(path.read_bytes()))
    check("in.db3")


def test_ros1() -> None:
    for cut in range(5000, len(BAG), 61):
        Path("in.bag").write_bytes(BAG[:cut])
        result = convert_bag("in.bag", "out.mcap", source_format="cdr", target_format="cdr", on_error="skip")
        Path("out.mcap").unlink()
        messages, bag = salvaged("in.bag")
        assert len(messages) == result.total.copied and bag.is_damaged
