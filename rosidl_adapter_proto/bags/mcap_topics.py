"""How topics of ROS are written as channels and schemas of MCAP, and read from them.

The profile `ros2` (https://mcap.dev/spec/registry#ros2) is for CDR alone. A file with protobuf has no profile; the ROS
type of a channel, and ROS's definition of it, are kept beside the descriptors, for the way back.
"""

from __future__ import annotations

import re
from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from mcap.records import Channel, Metadata, Schema

from rosidl_adapter_proto.bags.metadata import ROSBAG2, SERIALIZED_METADATA, read_metadata
from rosidl_adapter_proto.bags.model import CDR, ROS1, RecordedDefinition, Topic
from rosidl_adapter_proto.bags.qos import numbered_qos
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.schema.typemap import type_of_proto_name

QOS_PROFILES = "offered_qos_profiles"
TYPE_HASH = "topic_type_hash"
ROS_TYPE = "ros_type"
ROS_DEFINITIONS = "rosidl_adapter_proto.ros_definitions"
"""The metadata record with ROS's definitions: by the name of the type, its encoding, a newline, and the text.

Where a file has several definitions of a type, as merged recordings may, the others have the id of the schema behind
the name of the type: `pkg/msg/Type 2`. Behind the encoding ` base64` says how a text is written that is not UTF-8.
"""

_BASE64 = " base64"

_ROS_NAME = re.compile(r"\w+/(msg|srv|action)/\w+", re.ASCII)


def read_topics(
    channels: Mapping[int, Channel], schemas: Mapping[int, Schema], metadata: Sequence[Metadata], path: str
) -> dict[int, Topic]:
    """Return the topics of a file, by the ids of their channels.

    Args:
        channels: All channels, by their ids.
        schemas: All schemas, by their ids; a channel may be without.
        metadata: All metadata records, in the order of the file.
        path: The file, for people.

    Raises:
        BagError: The description of rosbag2 is needed and damaged, or a definition of ROS is.
    """
    topics = {
        topic_id: _read_topic(channel, schemas.get(channel.schema_id))
        for topic_id, channel in channels.items()
    }
    if not all(topic.type_name for topic in topics.values()):
        types = _rosbag2_types(metadata, path)
        topics = {
            topic_id: topic if topic.type_name else replace(topic, type_name=types.get(topic.name, ""))
            for topic_id, topic in topics.items()
        }
    definitions = _ros_definitions(metadata, path)
    return {
        topic_id: _with_ros_definition(topic, channels[topic_id].schema_id, definitions)
        for topic_id, topic in topics.items()
    }


def _with_ros_definition(
    topic: Topic, schema_id: int, definitions: Mapping[str, RecordedDefinition]
) -> Topic:
    name = topic.type_name
    found = definitions.get(other_definition_name(name, schema_id)) or definitions.get(name)
    return replace(topic, ros_definition=found) if found and topic.serialization_format != CDR else topic


def other_definition_name(type_name: str, schema_id: int) -> str:
    """Return the name in `ROS_DEFINITIONS` for a definition that is not the first of its type."""
    return f"{type_name} {schema_id}"


def write_schema(topic: Topic) -> Schema:
    """Return the schema of a topic, whose id is still 0."""
    name = topic.type_name if topic.serialization_format == CDR else topic.schema_name or topic.type_name
    return Schema(id=0, name=name, encoding=topic.definition.encoding, data=topic.definition.data)


def write_channel(topic: Topic, topic_id: int, schema_id: int) -> Channel:
    """Return the channel of a topic."""
    metadata = {QOS_PROFILES: topic.qos_profiles, TYPE_HASH: topic.type_hash}
    if topic.serialization_format != CDR:
        metadata[ROS_TYPE] = topic.type_name
    metadata = {name: value for name, value in metadata.items() if value}
    return Channel(
        id=topic_id,
        topic=topic.name,
        message_encoding=topic.serialization_format,
        metadata={**metadata, **topic.metadata},
        schema_id=schema_id,
    )


def write_ros_definition(definition: RecordedDefinition) -> str:
    """Return ROS's definition of a type as a value of the metadata record."""
    try:
        return f"{definition.encoding}\n{definition.data.decode()}"
    except UnicodeDecodeError:  # in the comments of old packages
        return f"{definition.encoding}{_BASE64}\n{b64encode(definition.data).decode()}"


def _ros_name(serialization_format: str, schema_name: str) -> str:
    """Return the ROS type that the name of a schema says; empty if it says none."""
    if serialization_format == CDR:
        return schema_name
    if serialization_format == ROS1:
        return "/msg/".join(schema_name.split("/")) if schema_name.count("/") == 1 else schema_name
    if found := type_of_proto_name(schema_name):
        return str(found)
    return schema_name if _ROS_NAME.fullmatch(schema_name) else ""


def _read_topic(channel: Channel, schema: Schema | None) -> Topic:
    """Return what a channel and its schema alone say of a topic."""
    rest = dict(channel.metadata)
    qos_profiles, type_hash = rest.pop(QOS_PROFILES, ""), rest.pop(TYPE_HASH, "")
    said = rest.pop(ROS_TYPE, "")
    schema_name = schema.name if schema else ""
    return Topic(
        name=channel.topic,
        type_name=said or _ros_name(channel.message_encoding, schema_name),
        serialization_format=channel.message_encoding,
        definition=RecordedDefinition(schema.encoding, schema.data) if schema else RecordedDefinition(),
        schema_name=schema_name,
        type_hash=type_hash,
        qos_profiles=numbered_qos(qos_profiles),
        metadata=rest,
    )


def _ros_definitions(metadata: Iterable[Metadata], path: str) -> dict[str, RecordedDefinition]:
    """Return ROS's definitions by the names of the types."""
    definitions = {}
    for record in metadata:
        if record.name == ROS_DEFINITIONS:
            for type_name, value in record.metadata.items():
                encoding, _, text = value.partition("\n")
                is_base64 = encoding.endswith(_BASE64)
                try:
                    data = b64decode(text, validate=True) if is_base64 else text.encode()
                except ValueError as error:
                    raise BagError(f"{path}: the ROS definition of {type_name} is damaged: {error}") from None
                definitions[type_name] = RecordedDefinition(encoding.removesuffix(_BASE64), data)
    return definitions


def _rosbag2_types(metadata: Iterable[Metadata], path: str) -> dict[str, str]:
    """Return the types by the names of the topics, as rosbag2's own description has them; the last one counts."""
    texts = [record.metadata.get(SERIALIZED_METADATA, "") for record in metadata if record.name == ROSBAG2]
    if not texts:
        return {}
    description = read_metadata(texts[-1].encode(), f"{path}, the metadata in it")
    return {information.topic.name: information.topic.type_name for information in description.topics}
