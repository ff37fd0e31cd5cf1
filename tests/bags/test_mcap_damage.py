"""Damaged MCAP files: what is said of them, and what can still be read."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.writer import CompressionType

from rosidl_adapter_proto.bags.compression import records_of
from rosidl_adapter_proto.bags.mcap_reader import McapReader
from rosidl_adapter_proto.bags.mcap_records import MAGIC, McapFile, RecordPlace
from rosidl_adapter_proto.bags.model import Selection
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.error import RecordsError
from rosidl_adapter_proto.transcode.records import read_records
from tests.bags.mcap_files import MESSAGES, NO_SUMMARY, mcap_file, messages_of, reader_of


def places(data: bytes, opcode: Opcode) -> list[RecordPlace]:
    """Return where the records of a kind are in a file that is whole."""
    found = McapFile(BytesIO(data), "").places(8, len(data) - 8)
    return [place for place in found if place.opcode == opcode]


def change(data: bytes, offset: int, new: bytes) -> bytes:
    """Return a file with some of its bytes replaced."""
    return data[:offset] + new + data[offset + len(new) :]


def insert(data: bytes, offset: int, new: bytes) -> bytes:
    """Return a file with some more bytes."""
    return data[:offset] + new + data[offset:]


def whole(data: bytes) -> bytes:
    """Return a file whose summary has its right checksum again."""
    start = int.from_bytes(data[-28:-20], "little")
    return data[:-12] + struct.pack("<I", zlib.crc32(data[start:-12])) + data[-8:]


def salvaged(data: bytes) -> tuple[int, list[str]]:
    """Return how many messages can still be read, and what is said of the others."""
    reader = reader_of(data, salvage=True)
    count, errors = 0, []
    for chunk in reader.chunks():
        try:
            count += len(read_records(records_of(chunk)))
        except (BagError, RecordsError) as error:
            errors.append(str(error))
    list(reader.attachments())
    return count, [*reader.warnings, *errors]


FILE = mcap_file()
LOOSE = mcap_file(use_chunking=False)
CHUNKS = places(FILE, Opcode.CHUNK)
FOURTH = CHUNKS[3]
TENTH = places(LOOSE, Opcode.MESSAGE)[9]
STATISTICS = places(FILE, Opcode.STATISTICS)[0]
NO_END = "the recording was not finished: it has no end; it was searched, and"
NOT_USED = "the summary is not used; it was searched, and"
SKIP = "`bag convert --on-error skip`, elsewhere `--salvage`, reads what is whole"


@pytest.mark.parametrize(
    "data",
    [FILE[: FOURTH.start], LOOSE[: TENTH.start], FILE[:-1], FILE[:-8], FILE[:-100], LOOSE[:-1], LOOSE[:-100]],
)
def test_a_recording_that_was_not_finished_is_no_error(data: bytes) -> None:
    reader = reader_of(data)
    found = list(messages_of(reader))
    assert found == list(MESSAGES[: len(found)]) and len(found) >= 9
    assert reader.warnings == [f"a.mcap: {NO_END} {len(found)} messages were found"]


def renamed(data: bytes) -> bytes:
    """Return a file whose summary has another topic for channel 2 than its data."""
    start = int.from_bytes(data[-28:-20], "little")
    return whole(data[:start] + data[start:].replace(b"/b", b"/c"))


UNSURE = mcap_file(enable_crcs=False)
SCHEMALESS = mcap_file([], more=lambda writer: writer.register_channel("/c", "cdr", 9))
ATTACHED = mcap_file(more=lambda writer: writer.add_attachment(1, 2, "map.png", "image/png", b"pixels"))


@dataclass(frozen=True)
class Damage:
    """A damaged file, and what becomes of it.

    Attributes:
        data: The file.
        reason: What is wrong with it.
        advice: What else is said where reading stops.
        count: How many messages can be read.
        before: What is said in front of the reason where reading goes on.
        after: What is said behind it.
    """

    data: bytes
    reason: str
    advice: str = f"; {SKIP}"
    count: int = 40
    before: Sequence[str] = ()
    after: Sequence[str] = ()


DAMAGES = {
    "cut in a chunk": Damage(
        FILE[: FOURTH.start + 50],
        "a.mcap at byte 1934: a Chunk record has 481 bytes, of which only 41 are there",
        advice="; 19 messages are whole, and `bag convert --on-error skip`, elsewhere `--salvage`, reads them",
        count=19,
        before=[f"a.mcap: {NO_END} 19 messages were found"],
    ),
    "cut in the head of a record": Damage(
        FILE[: FOURTH.start + 5],
        "a.mcap at byte 1934: 5 bytes are too few for a record",
        advice="; 19 messages are whole, and `bag convert --on-error skip`, elsewhere `--salvage`, reads them",
        count=19,
        before=[f"a.mcap: {NO_END} 19 messages were found"],
    ),
    "cut in a message": Damage(
        LOOSE[: TENTH.start + 20],
        "a.mcap at byte 863: a Message record has 41 bytes, of which only 11 are there",
        advice="; 9 messages are whole, and `bag convert --on-error skip`, elsewhere `--salvage`, reads them",
        count=9,
        before=[f"a.mcap: {NO_END} 9 messages were found"],
    ),
    "cut in the header": Damage(
        FILE[:20],
        "a.mcap at byte 8: a Header record has 16 bytes, of which only 3 are there",
        count=0,
        after=[f"a.mcap: {NO_END} 0 messages were found"],
    ),
    "zeros behind the end": Damage(
        FILE + bytes(5000), "a.mcap at byte 5403: the recording ends here, and 5000 bytes follow"
    ),
    "another recording behind the end": Damage(
        FILE + LOOSE, "a.mcap at byte 5403: the recording ends here, and 3584 bytes follow"
    ),
    "zeros instead of the end": Damage(
        FILE[: FOURTH.start] + bytes(5000),
        "a.mcap at byte 1934: there is no record, its first byte is 0",
        advice="; 19 messages are whole, and `bag convert --on-error skip`, elsewhere `--salvage`, reads them",
        count=19,
        before=[f"a.mcap: {NO_END} 19 messages were found"],
    ),
    "zeros instead of a chunk": Damage(
        change(FILE, FOURTH.start, bytes(FOURTH.end - FOURTH.start)),
        "a.mcap at byte 1934: there is no record, its first byte is 0",
        count=33,
        after=[
            "a.mcap: the summary counts 7 chunks, and there are 6",
            "a.mcap: the summary counts 40 messages, and there are 33",
        ],
    ),
    "garbage between records": Damage(
        insert(FILE, FOURTH.start, b"garbage" * 20),
        "a.mcap at byte 4069: the summary is damaged: its checksum is 0x7d50d2de and should be" " 0xeefdb284",
        after=[
            f"a.mcap: {NOT_USED} 40 messages were found",
            "a.mcap at byte 1934: a record of the unknown kind 0x67 has 7018690038970085985 bytes, of"
            " which only 3600 are there",
        ],
    ),
    "garbage between messages": Damage(
        insert(LOOSE, TENTH.start, b"garbage" * 20)[:-400],
        "a.mcap at byte 863: a record of the unknown kind 0x67 has 7018690038970085985 bytes, of"
        " which only 2452 are there",
        advice="; 40 messages are whole, and `bag convert --on-error skip`, elsewhere `--salvage`, reads them",
        before=[f"a.mcap: {NO_END} 40 messages were found"],
    ),
    "a length that points outside": Damage(
        change(FILE, FOURTH.start + 1, struct.pack("<Q", 2**60)),
        "a.mcap at byte 1934: a Chunk record has 1152921504606846976 bytes, of which only 3460 are" " there",
        after=["a.mcap: the summary counts 7 chunks, and there are 6"],
    ),
    "a length that is too large": Damage(
        change(FILE, FOURTH.start + 1, struct.pack("<Q", 600)),
        "a.mcap at byte 1934: a Chunk record is damaged: it has 560 bytes of data and says 441",
        after=["a.mcap: the summary counts 7 chunks, and there are 6"],
    ),
    "a length that is too small": Damage(
        change(FILE, FOURTH.start + 1, struct.pack("<Q", 20)),
        "a.mcap at byte 1934: a Chunk record is damaged: a length in it points behind its end",
        after=["a.mcap: the summary counts 7 chunks, and there are 6"],
    ),
    "a checksum of a chunk": Damage(
        change(FILE, FOURTH.content + 24, b"\1\2\3\4"),
        "a.mcap at byte 1934: the chunk is damaged: its checksum is 0x7d97c1f8 and should be" " 0x04030201",
        advice="",
        count=33,
    ),
    "a size of a chunk": Damage(
        change(FILE, FOURTH.content + 16, struct.pack("<Q", 2**60)),
        "a.mcap at byte 1934: the chunk is damaged: it says that its 441 bytes become"
        " 1152921504606846976, which is impossible",
        advice="",
        count=33,
    ),
    "a compression that is too long": Damage(
        change(FILE, FOURTH.content + 28, struct.pack("<I", 2**31)),
        "a.mcap at byte 1934: a Chunk record is damaged: a length in it points behind its end",
        after=["a.mcap: the summary counts 7 chunks, and there are 6"],
    ),
    "a record inside a chunk": Damage(
        change(UNSURE, FOURTH.content + 40 + 1, struct.pack("<Q", 2**60)),
        "byte 0 of the chunk: a record of 1152921504606846976 bytes is announced and 432 are left;"
        " the chunk is cut off or damaged",
        advice="",
        count=33,
    ),
    "a message that is too short": Damage(
        change(LOOSE, TENTH.start + 1, struct.pack("<Q", 5)),
        "a.mcap at byte 863: a Message record is damaged: it is too short for a message",
        count=39,
        after=["a.mcap: the summary counts 40 messages, and there are 39"],
    ),
    "a summary nowhere": Damage(
        change(FILE, len(FILE) - 28, struct.pack("<Q", 2**60)),
        "a.mcap at byte 5366: the summary should begin at byte 1152921504606846976, where it cannot",
        after=[f"a.mcap: {NOT_USED} 40 messages were found"],
    ),
    "a summary in the header": Damage(
        change(FILE, len(FILE) - 28, struct.pack("<Q", 1)),
        "a.mcap at byte 5366: the summary should begin at byte 1, where it cannot",
        after=[f"a.mcap: {NOT_USED} 40 messages were found"],
    ),
    "a checksum of the summary": Damage(
        change(FILE, len(FILE) - 12, b"\1\2\3\4"),
        "a.mcap at byte 4069: the summary is damaged: its checksum is 0xeefdb284 and should be" " 0x04030201",
        after=[f"a.mcap: {NOT_USED} 40 messages were found"],
    ),
    "a count of messages": Damage(
        whole(change(FILE, STATISTICS.content, struct.pack("<Q", 41))),
        "a.mcap at byte 4069: the summary counts 41 messages, and 40 in the sum of its topics",
        after=[f"a.mcap: {NOT_USED} 40 messages were found"],
    ),
    "a count of chunks": Damage(
        whole(change(FILE, STATISTICS.content + 22, struct.pack("<I", 8))),
        "a.mcap: the summary counts 8 chunks, and there are 7",
    ),
    "counts that agree and are wrong": Damage(
        whole(
            change(
                change(FILE, STATISTICS.content, struct.pack("<Q", 41)),
                STATISTICS.content + 48,
                struct.pack("<Q", 28),
            )
        ),
        "a.mcap: the summary counts 41 messages, and there are 40",
    ),
    "letters that are none": Damage(
        whole(FILE.replace(b"/b", b"/\xff")),
        "a.mcap at byte 4312: a Channel record is damaged: a text in it is not UTF-8",
        count=38,
        after=[
            f"a.mcap: {NOT_USED} 38 messages were found",
            "a.mcap at byte 33: the chunk is damaged: its checksum is 0x3b63d351 and should be 0xb6846884",
            "a.mcap: 13 messages are of channel 2, which is not there",
            "a.mcap at byte 33: the chunk is damaged: its checksum is 0x3b63d351 and should be 0xb6846884",
        ],
    ),
    "two channels with one id": Damage(
        renamed(LOOSE), "a.mcap at byte 359: channel 2 is `/b` here, and another `/c` elsewhere"
    ),
    "a schema that is missing": Damage(
        SCHEMALESS, "a.mcap: channel 1 (`/c`) has schema 9, which is not there", count=0
    ),
    "an attachment that is not what it was": Damage(
        ATTACHED.replace(b"pixels", b"pixies"),
        "a.mcap at byte 3786: an Attachment record is damaged: its checksum is 0xbebe7a4b and"
        " should be 0x66663866",
    ),
    "a length in an attachment": Damage(
        change(ATTACHED, places(ATTACHED, Opcode.ATTACHMENT)[0].content + 40, b"\xff" * 8),
        "a.mcap at byte 3786: an Attachment record is damaged: a length in it points behind its end",
    ),
    "an index of an attachment that points elsewhere": Damage(
        whole(change(ATTACHED, places(ATTACHED, Opcode.ATTACHMENT_INDEX)[0].content, struct.pack("<Q", 8))),
        "a.mcap at byte 5277: an AttachmentIndex record is damaged: an Attachment record should be"
        " at byte 8 and is not",
        after=[f"a.mcap: {NOT_USED} 40 messages were found"],
    ),
    "an index of an attachment that points outside": Damage(
        whole(
            change(ATTACHED, places(ATTACHED, Opcode.ATTACHMENT_INDEX)[0].content, struct.pack("<Q", 2**60))
        ),
        "a.mcap at byte 5277: an AttachmentIndex record is damaged: an Attachment record should be"
        " at byte 1152921504606846976 and is not",
        after=[f"a.mcap: {NOT_USED} 40 messages were found"],
    ),
    "a chunk that calls itself an index": Damage(
        change(FILE, FOURTH.start, bytes([Opcode.MESSAGE_INDEX])),
        "a.mcap at byte 1934: a MessageIndex record is damaged: its last entry is not whole",
        after=["a.mcap: the summary counts 7 chunks, and there are 6"],
    ),
    "an end in the middle": Damage(
        change(FILE, FOURTH.start, bytes([Opcode.DATA_END])),
        "a.mcap at byte 1934: a DataEnd record is damaged: it should have 4 bytes",
        after=["a.mcap: the summary counts 7 chunks, and there are 6"],
    ),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_damage_is_named(damage: Damage) -> None:
    with pytest.raises((BagError, RecordsError)) as caught:
        reader = reader_of(damage.data)
        list(messages_of(reader))
        list(reader.attachments())
    assert str(caught.value) == damage.reason + damage.advice


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_what_is_whole_can_be_read(damage: Damage) -> None:
    assert salvaged(damage.data) == (damage.count, [*damage.before, damage.reason, *damage.after])


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "it is empty"),
        (b"\x89MCAP", r"it begins with b'\x89MCAP'"),
        (b"#ROSBAG V2.0\n", "it begins with b'#ROSBAG '"),
    ],
)
@pytest.mark.parametrize("salvage", [False, True])
def test_a_file_that_is_no_mcap_file(data: bytes, reason: str, salvage: bool) -> None:
    with pytest.raises(BagError) as caught:
        reader_of(data, salvage=salvage)
    assert str(caught.value) == f"a.mcap: this is no MCAP file: {reason}"


def test_records_of_unknown_kinds_are_left_out() -> None:
    record = b"\x83" + struct.pack("<Q", 4) + b"what"
    data = mcap_file(**NO_SUMMARY)
    place = places(data, Opcode.CHUNK)[2].start
    reader = reader_of(insert(data, place, record * 3))
    assert tuple(messages_of(reader)) == MESSAGES
    assert reader.warnings[1:] == [
        f"a.mcap at byte {place}: a record of the unknown kind 0x83 is left out, and so are all others of it"
    ]


class Broken(BytesIO):
    """A file on a disk with a byte that cannot be read."""

    def read(self, size: int | None = -1) -> bytes:
        if size is None or self.tell() <= 2200 < self.tell() + size:
            raise OSError(5, "Input/output error")
        return super().read(size)


def test_a_disk_that_cannot_be_read() -> None:
    reason = "a.mcap at byte 1983: it cannot be read: Input/output error"
    with pytest.raises(BagError) as caught:
        list(McapReader(Broken(FILE), "a.mcap").chunks())
    assert str(caught.value) == f"{reason}; {SKIP}"
    reader = McapReader(Broken(FILE), "a.mcap", salvage=True)
    assert len(list(messages_of(reader))) == 33
    assert reader.warnings == [reason]


def test_no_more_memory_is_taken_than_a_record_may_need(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(FILE[: CHUNKS[0].start] + b"\x04" + struct.pack("<Q", 2**27))
    os.truncate(path, 2**28)
    with path.open("rb") as file, pytest.raises(BagError) as caught:
        McapReader(file, "a.mcap")
    assert str(caught.value) == (
        "a.mcap at byte 33: a Channel record has 134217728 bytes; up to 67108864 are read;"
        " 0 messages are whole, and `bag convert --on-error skip`, elsewhere `--salvage`, reads them"
    )


def test_a_file_that_becomes_shorter() -> None:
    file = McapFile(BytesIO(FILE), "a.mcap")
    with pytest.raises(BagError) as caught:
        file.read(5000, 6000)
    assert str(caught.value) == "a.mcap at byte 5000: the file became shorter while it was read"


def test_what_is_indexed_twice_is_there_once() -> None:
    index = places(ATTACHED, Opcode.ATTACHMENT_INDEX)[0]
    reader = reader_of(whole(insert(ATTACHED, index.start, ATTACHED[index.start : index.end])))
    assert [attachment.name for attachment in reader.attachments()] == ["map.png"]


def test_a_channel_that_the_summary_does_not_have() -> None:
    data = mcap_file(use_chunking=False, more=lambda writer: writer.register_channel("/c", "cdr", 1))
    channel = places(data, Opcode.CHANNEL)[-1]
    statistics = places(data, Opcode.STATISTICS)[0]
    hidden = change(data, channel.start, b"\x83")
    hidden = whole(change(hidden, statistics.content + 10, struct.pack("<I", 2)))
    place = f"a.mcap at byte {channel.start}"
    unknown = f"{place}: a record of the unknown kind 0x83 is left out, and so are all others of it"
    assert salvaged(hidden) == (40, ["a.mcap: channel 3 (`/c`) is not in the summary", unknown])


FILES = [
    FILE,
    LOOSE,
    ATTACHED,
    mcap_file(compression=CompressionType.ZSTD),
    mcap_file(compression=CompressionType.LZ4),
]
UNFINISHED = [*FILES, mcap_file(**NO_SUMMARY)]


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(UNFINISHED), st.floats(0, 1))
def test_a_file_cut_anywhere(data: bytes, part: float) -> None:
    size = int(len(data) * part)
    chunks = [place for place in places(data, Opcode.CHUNK) if place.end <= size]
    last = reader_of(data).chunks()
    expected = sum(chunk.message_count or 0 for chunk, _ in zip(last, chunks, strict=False))
    if size < len(MAGIC):
        with pytest.raises(BagError):
            reader_of(data[:size], salvage=True)
        return
    reader = reader_of(data[:size], salvage=True)
    found = list(messages_of(reader, Selection(frozenset(reader.topics))))
    assert found == list(MESSAGES[: len(found)])
    assert len(found) >= expected
    try:
        assert list(messages_of(reader_of(data[:size]))) == found
    except BagError as error:
        assert str(error).endswith(
            ("and `bag convert --on-error skip`, elsewhere `--salvage`, reads them", SKIP)
        )


CHANGES = st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(1, 255)), min_size=1, max_size=5)


def changed(data: bytes, changes: list[tuple[float, int]]) -> bytes:
    """Return a file with some bytes changed."""
    new = bytearray(data)
    for part, difference in changes:
        new[int(len(data) * part)] ^= difference
    return bytes(new)


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(FILES), CHANGES)
def test_a_file_with_changed_bytes(data: bytes, changes: list[tuple[float, int]]) -> None:
    try:
        reader = reader_of(changed(data, changes))
        found = tuple(messages_of(reader))
        list(reader.attachments())
    except (BagError, RecordsError):
        return
    if data is not LOOSE:  # its messages have no checksum
        assert found == MESSAGES


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(UNFINISHED), CHANGES)
def test_whatever_can_be_read_of_a_file_with_changed_bytes(
    data: bytes, changes: list[tuple[float, int]]
) -> None:
    try:
        salvaged(changed(data, changes))
    except BagError as error:
        assert "this is no MCAP file" in str(error)
