"""What becomes of each topic of a file that is converted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from rosidl_adapter_proto.bags.conversion import DEFAULT_FORMATS, OnError, Settings
from rosidl_adapter_proto.bags.model import CDR, PROTOBUF, RecordedDefinition, Statistics, Topic
from rosidl_adapter_proto.bags.topic_names import is_named
from rosidl_adapter_proto.bags.types import BagTypes, protobuf_definition
from rosidl_adapter_proto.converters.ros1 import check_ros2_type
from rosidl_adapter_proto.errors import BagError, ConverterError
from rosidl_adapter_proto.interfaces.recorded import ROS1MSG
from rosidl_adapter_proto.schema.registry import Schema

MIXED_FORMATS = (
    "Topics with different rmw serialization format have been found. "
    "All topics must have the same serialization format."
)
"""What rosbag2 says of a bag whose topics differ (`rosbag2_cpp::SequentialReader`)."""


class Fate(Enum):
    """What becomes of the messages of a topic.

    Attributes:
        CONVERTED: They are converted.
        COPIED: They are copied as they are.
        SKIPPED: They are left out, since nothing is known of their type.
        NOT_SELECTED: They are left out, since nobody asked for them.
    """

    CONVERTED = "converted"
    COPIED = "copied"
    SKIPPED = "skipped"
    NOT_SELECTED = "not selected"


@dataclass(frozen=True)
class TopicRoute:
    """What becomes of one topic.

    Attributes:
        topic: The topic in the source, with the serialization format that the user says it has.
        fate: What becomes of its messages.
        result: The topic in the result; None if it is not there.
        schema: The type of the messages, if they are converted.
        result_schema: The type of what they become.
        reason: Why they are not converted, though they should be.
    """

    topic: Topic
    fate: Fate
    result: Topic | None = None
    schema: Schema | None = None
    result_schema: Schema | None = None
    reason: str = ""


def selected_topics(topics: Mapping[int, Topic], settings: Settings) -> dict[int, Topic]:
    """Return the topics that are to be converted, with the serialization format that the user says they have."""
    return {
        topic_id: replace(topic, serialization_format=settings.source_format or topic.serialization_format)
        for topic_id, topic in topics.items()
        if (not settings.topics or is_named(topic.name, settings.topics))
        and not is_named(topic.name, settings.excluded_topics)
    }


def formats(topics: Sequence[Topic], settings: Settings) -> tuple[str, str]:
    """Return the one serialization format that the topics of a bag have, and the one that they get.

    Raises:
        BagError: They have different ones, or there are no topics.
    """
    found = {topic.serialization_format for topic in topics}
    if len(found) > 1:
        by_format = "; ".join(
            f"{each}: {', '.join(sorted({topic.name for topic in topics if topic.serialization_format == each}))}"
            for each in sorted(found)
        )
        raise BagError(f"{MIXED_FORMATS} ({by_format}; `--topic` chooses some)")
    source_format = found.pop() if found else settings.source_format or CDR
    return source_format, settings.target_format or DEFAULT_FORMATS.get(source_format, PROTOBUF)


def plan_routes(
    topics: Mapping[int, Topic],
    selected: Mapping[int, Topic],
    statistics: Statistics,
    on_error: OnError,
    target_format: str,
    types: BagTypes,
    elsewhere: BagTypes,
) -> dict[int, TopicRoute]:
    """Return what becomes of each topic of a file, by its id.

    Args:
        topics: All topics of the file.
        selected: Those that are to be converted (`selected_topics`).
        statistics: How many messages they have: nothing need be known of the type of a topic without any.
        on_error: What becomes of those that cannot be converted.
        target_format: What to convert to.
        types: The types of the topics.
        elsewhere: The types that are found where the bag is not, of which those of ROS 2 are for topics of ROS 1.

    Raises:
        BagError: Nothing is known of the type of a topic that has messages.
    """
    routes = {topic_id: TopicRoute(topic, Fate.NOT_SELECTED) for topic_id, topic in topics.items()}
    for topic_id, topic in selected.items():
        if topic.serialization_format == target_format:
            routes[topic_id] = TopicRoute(topic, Fate.COPIED, topic)
            continue
        try:
            routes[topic_id] = _converted(topic, target_format, types, elsewhere)
        except (BagError, ConverterError) as error:
            if not statistics.message_counts.get(topic_id):
                routes[topic_id] = TopicRoute(topic, Fate.COPIED, _without_definition(topic, target_format))
            elif on_error is OnError.STOP:
                raise
            elif on_error is OnError.COPY:
                routes[topic_id] = TopicRoute(topic, Fate.COPIED, topic, reason=str(error))
            else:
                routes[topic_id] = TopicRoute(topic, Fate.SKIPPED, reason=str(error))
    return routes


def _ros2_type(topic: Topic, ros1: Schema, elsewhere: BagTypes) -> tuple[Schema, RecordedDefinition]:
    """Return the type of ROS 2 that messages of ROS 1 get, and its definition.

    Raises:
        BagError: ROS 2 has no such type.
        ConverterError: It has not all that the type of ROS 1 has.
    """
    ros2 = Topic(topic.name, topic.type_name, CDR)
    found = elsewhere.schema(ros2)
    check_ros2_type(ros1, found)
    return found, elsewhere.ros_definition(ros2)


def _converted(topic: Topic, target_format: str, types: BagTypes, elsewhere: BagTypes) -> TopicRoute:
    """Return the route of a topic whose messages are converted.

    Raises:
        BagError: Its type is not known.
        ConverterError: It is a type of ROS 1, and ROS 2 has not all of it.
    """
    schema, ros_definition = types.schema(topic), types.ros_definition(topic)
    result_schema = schema
    if ros_definition.encoding == ROS1MSG and target_format != PROTOBUF:
        result_schema, ros_definition = _ros2_type(topic, schema, elsewhere)
    result = _result(topic, target_format, result_schema, ros_definition)
    return TopicRoute(topic, Fate.CONVERTED, result, schema, result_schema)


def _result(topic: Topic, target_format: str, schema: Schema, ros_definition: RecordedDefinition) -> Topic:
    """Return what a topic becomes."""
    if target_format == PROTOBUF:
        return replace(
            topic,
            serialization_format=target_format,
            definition=protobuf_definition(schema),
            ros_definition=ros_definition,
            schema_name=schema.descriptor.full_name,
        )
    return replace(
        topic,
        serialization_format=target_format,
        definition=ros_definition,
        ros_definition=RecordedDefinition(),
        schema_name=topic.type_name,
    )


def _without_definition(topic: Topic, target_format: str) -> Topic:
    """Return a topic whose type nobody knows in another format: it has no messages, and so needs none."""
    return replace(
        topic,
        serialization_format=target_format,
        definition=RecordedDefinition(),
        schema_name=topic.type_name,
    )
