"""What is in a bag, for people and for other programs: plain data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rosidl_adapter_proto.bags.bag import Bag, BagTopic
from rosidl_adapter_proto.bags.labels import label_warnings
from rosidl_adapter_proto.errors import BagError

MISSING = "nowhere"
"""Where the definition of a type is that nobody knows."""


@dataclass(frozen=True)
class BagTopicInformation:
    """What there is of a topic.

    Attributes:
        name: Its name.
        type_name: The ROS type of its messages; where they have none, what the recording calls their type.
        serialization_format: How they are serialized.
        message_count: How many there are.
        types_from: Where the definition of the type comes from, for people; `MISSING` without one.
    """

    name: str
    type_name: str
    serialization_format: str
    message_count: int
    types_from: str


@dataclass(frozen=True)
class BagInformation:
    """What is in a bag.

    Attributes:
        files: The files, in the order in which they were recorded.
        storage: The names of their storages in rosbag2, such as `mcap`.
        compression: What chunks, messages or files are compressed with; none if nothing is.
        size: How many bytes the files have.
        start_time: When the first message was recorded, in nanoseconds since 1970; 0 without messages.
        end_time: When the last message was recorded, likewise.
        message_count: How many messages there are.
        topics: The topics.
        warnings: What is odd about the bag, for people.
    """

    files: Sequence[str]
    storage: Sequence[str]
    compression: Sequence[str]
    size: int
    start_time: int
    end_time: int
    message_count: int
    topics: Sequence[BagTopicInformation]
    warnings: Sequence[str]


def bag_information(bag: Bag) -> BagInformation:
    """Return what is in a bag.

    Raises:
        BagError: It cannot be read. What is wrong with single topics and chunks is a warning.
    """
    compressions: dict[str, None] = {}
    warnings: dict[str, None] = {}
    for index, file in enumerate(bag.files):
        try:
            with bag.open_file(index) as reader:
                compressions[str(bag.recording.compression(index, reader))] = None
                warnings.update(dict.fromkeys(label_warnings(reader, file.topics)))
        except BagError as error:
            warnings[str(error)] = None
    topics = [_topic_information(bag, topic, warnings) for topic in bag.topics.values()]
    return BagInformation(
        files=[file.path for file in bag.files],
        storage=sorted({file.storage for file in bag.files}),
        compression=[each for each in compressions if each],
        size=bag.recording.size,
        start_time=bag.start_time,
        end_time=bag.end_time,
        message_count=bag.message_count,
        topics=topics,
        warnings=list(dict.fromkeys([*bag.warnings, *warnings])),
    )


def _topic_information(bag: Bag, topic: BagTopic, warnings: dict[str, None]) -> BagTopicInformation:
    try:
        types_from = bag.types.origin(topic)
    except BagError as error:
        types_from = MISSING
        warnings[str(error)] = None
    return BagTopicInformation(
        topic.name,
        topic.type_name or topic.schema_name,
        topic.serialization_format,
        topic.message_count,
        types_from,
    )
