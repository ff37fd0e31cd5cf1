"""MCAP files for tests, written by the mcap library, and messages read from them in any way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from io import BytesIO
from typing import Any, NamedTuple

from mcap.reader import NonSeekingReader, SeekingReader
from mcap.writer import CompressionType, IndexType, Writer

from rosidl_adapter_proto.bags.compression import records_of
from rosidl_adapter_proto.bags.mcap_reader import McapReader
from rosidl_adapter_proto.bags.model import EVERYTHING, Selection
from rosidl_adapter_proto.transcode.error import RecordsError
from rosidl_adapter_proto.transcode.records import read_records

PATH = "a.mcap"
STRING = b"string data\n"
QOS = "- history: 10"
RIHS = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


class Recorded(NamedTuple):
    """A message of a recording."""

    topic: str
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


MESSAGES = tuple(
    Recorded(("/a", "/b")[i % 3 == 2], i, 1000 + i * 10 - i % 4 * 15, 900 + i, bytes([i]) * (10 + i))
    for i in range(40)
)
"""Messages of two topics that are not quite in the order of time."""

# Chunks of about 8 messages.
CHUNKED: dict[str, Any] = {"chunk_size": 400, "compression": CompressionType.NONE}
NO_SUMMARY: dict[str, Any] = {
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
}


def mcap_file(
    messages: Iterable[Recorded] = MESSAGES,
    *,
    profile: str = "ros2",
    more: Callable[[Writer], object] = lambda writer: None,
    **options: Any,
) -> bytes:
    """Return a file of the official writer.

    Args:
        messages: Its messages.
        profile: Its profile.
        more: What else to write, behind the messages.
        options: Options of the writer.
    """
    file = BytesIO()
    writer = Writer(file, **{**CHUNKED, **options})
    writer.start(profile=profile, library="test")
    schema_id = writer.register_schema("std_msgs/msg/String", "ros2msg", STRING)
    channels: dict[str, int] = {}
    for message in messages:
        if message.topic not in channels:
            metadata = {"offered_qos_profiles": QOS, "topic_type_hash": RIHS, "color": "blue"}
            channels[message.topic] = writer.register_channel(message.topic, "cdr", schema_id, metadata)
        writer.add_message(
            channels[message.topic], message.log_time, message.data, message.publish_time, message.sequence
        )
    more(writer)
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


def reader_of(data: bytes, *, salvage: bool = False) -> McapReader:
    """Return a reader of a file in memory."""
    return McapReader(BytesIO(data), PATH, salvage=salvage)


def messages_of(reader: McapReader, selection: Selection = EVERYTHING) -> Iterator[Recorded]:
    """Yield the messages that our reader has, in the order of the file."""
    for chunk in reader.chunks(selection):
        records = read_records(
            records_of(chunk), selection.topic_ids, selection.start_time, selection.end_time
        )
        for index in range(len(records)):
            if records.topic_ids[index] not in reader.topics:
                raise RecordsError(0, "a message of a topic that is not there")
            yield Recorded(
                reader.topics[records.topic_ids[index]].name,
                records.sequences[index],
                records.log_times[index],
                records.publish_times[index],
                bytes(records[index]),
            )


def messages_of_library(
    data: bytes, kind: type[SeekingReader | NonSeekingReader] = NonSeekingReader
) -> list[Recorded]:
    """Return the messages that the mcap library reads, with all checksums compared, in the order of log times."""
    reader = kind(BytesIO(data), validate_crcs=True)
    return [
        Recorded(channel.topic, message.sequence, message.log_time, message.publish_time, message.data)
        for _, channel, message in reader.iter_messages()
    ]
