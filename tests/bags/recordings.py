"""Recordings for tests of conversions: written by the mcap library and by rosbags, and read by the mcap library."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from reference_cdr import CdrWriter
from ros_types import Types

from rosidl_adapter_proto import Schema
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import type_closure
from rosidl_adapter_proto.interfaces.model import TypeName

QOS = "- history: 1\n  depth: 10"
SECOND = 10**9
START = 1_700_000_000 * SECOND

STRING = "std_msgs/msg/String"
DEFINITIONS = {STRING: "string data\n", "std_msgs/msg/Int32": "int32 data\n"}


class Recorded(NamedTuple):
    """A message of a recording."""

    topic: str
    log_time: int
    data: bytes
    publish_time: int = 0
    sequence: int = 0


def string_cdr(text: str) -> bytes:
    """Return a `std_msgs/msg/String` in CDR."""
    data = text.encode() + b"\0"
    return b"\0\1\0\0" + len(data).to_bytes(4, "little") + data


def strings(topic: str, count: int, first: int = 0, step: int = SECOND) -> list[Recorded]:
    """Return texts, one each second, that say which they are."""
    return [
        Recorded(topic, START + i * step, string_cdr(f"{topic} {i}"), START + i * step - 5, i + 7)
        for i in range(first, first + count)
    ]


def mcap_bytes(
    messages: Iterable[Recorded],
    types: Mapping[str, str] = {},
    definitions: Mapping[str, str] = DEFINITIONS,
    *,
    hashes: Mapping[str, str] = {},
    formats: Mapping[str, str] = {},
    attachments: Sequence[tuple[str, bytes]] = (),
    metadata: Sequence[tuple[str, dict[str, str]]] = (),
    profile: str = "ros2",
    **options: Any,
) -> bytes:
    """Return an MCAP file.

    Args:
        messages: Its messages.
        types: The types of topics that have other ones than `std_msgs/msg/String`; topics without messages are there.
        definitions: The definitions of types; a type without one has no schema data.
        hashes: The hashes of types that are known.
        formats: The serialization formats of topics that have other ones than `cdr`.
        attachments: Names and contents.
        metadata: Names and values.
        profile: Its profile.
        options: Options of the writer.
    """
    file = BytesIO()
    writer = Writer(file, **{"chunk_size": 300, "compression": CompressionType.ZSTD, **options})
    writer.start(profile=profile, library="test")
    channels: dict[str, int] = {}

    def channel(topic: str) -> int:
        if topic not in channels:
            name = types.get(topic, STRING)
            encoding = "ros2msg" if name in definitions else ""
            schema = writer.register_schema(name, encoding, definitions.get(name, "").encode())
            keys = {"offered_qos_profiles": QOS, "note": f"of {topic}"}
            if name in hashes:
                keys["topic_type_hash"] = hashes[name]
            channels[topic] = writer.register_channel(topic, formats.get(topic, "cdr"), schema, keys)
        return channels[topic]

    for topic in types:
        channel(topic)
    for each in messages:
        writer.add_message(
            channel(each.topic), each.log_time, each.data, each.publish_time or each.log_time, each.sequence
        )
    for name, data in attachments:
        writer.add_attachment(START, START + 1, name, "text/plain", data)
    for name, values in metadata:
        writer.add_metadata(name, values)
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


class Contents(NamedTuple):
    """All that is in an MCAP file, in a form that is equal where the files are."""

    profile: str
    messages: list[Recorded]
    topics: dict[tuple[str, str], tuple[str, str, bytes, dict[str, str]]]
    attachments: list[tuple[str, bytes]]
    metadata: list[tuple[str, dict[str, str]]]
    compressions: set[str]


def contents(file: Path) -> Contents:
    """Return what the mcap library finds in a file, in the order of the file."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        topics = {}
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            about = (schema.name, schema.encoding, schema.data) if schema else ("", "", b"")
            topics[channel.topic, channel.message_encoding] = (*about, channel.metadata)
        messages = [
            Recorded(channel.topic, each.log_time, each.data, each.publish_time, each.sequence)
            for _, channel, each in reader.iter_messages(log_time_order=False)
        ]
        assert summary.statistics is not None and summary.statistics.message_count == len(messages)
        return Contents(
            reader.get_header().profile,
            messages,
            topics,
            [(each.name, each.data) for each in reader.iter_attachments()],
            [(each.name, each.metadata) for each in reader.iter_metadata()],
            {each.compression for each in summary.chunk_indexes},
        )


def rows(file: Path) -> list[tuple[str, str, str, int, bytes]]:
    """Return the messages of a sqlite3 file: topic, type, format, time and data."""
    connection = sqlite3.connect(file)
    query = (
        "SELECT name, type, serialization_format, timestamp, data FROM messages JOIN topics"
        " ON topics.id = topic_id ORDER BY messages.id"
    )
    found = list(connection.execute(query))
    connection.close()
    return found


def types_of(schema: Schema) -> Types:
    """Return the type of a schema and all that it refers to, as samples take them."""
    description = schema.type_description
    structs = (description["type_description"], *description["referenced_type_descriptions"])
    return {each["type_name"]: dict(each) for each in structs}


def cdr(schema: Schema, value: dict[str, Any]) -> bytes:
    """Return a value in CDR, as the reference writes it."""
    return bytes(CdrWriter(types_of(schema)).message(schema.type_name, value).bytes())


def definition_text(catalog: Catalog, name: str) -> str:
    """Return the definition of a type and all that it refers to, in the form of recordings (`ros2msg`)."""
    *others, own = type_closure(catalog, TypeName.parse(name))
    texts = [catalog.definition(own).text]
    for each in others:
        texts.append(f"{'=' * 80}\nMSG: {each.package}/{each.name}\n{catalog.definition(each).text}")
    return "\n".join(texts)
