"""Describes recordings as rosbag2 does, in metadata.yaml and in their files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rosidl_adapter_proto.bags.metadata import BagMetadata, FileInformation, TopicInformation
from rosidl_adapter_proto.bags.model import Statistics, Topic


@dataclass(frozen=True)
class WrittenFile:
    """A file of a recording that was written.

    Attributes:
        name: Its name in the folder of the recording.
        topics: Its topics by their ids.
        statistics: How much is in it.
    """

    name: str
    topics: Mapping[int, Topic]
    statistics: Statistics


def describe(storage: str, files: Sequence[WrittenFile], source: BagMetadata | None) -> BagMetadata:
    """Return what rosbag2 says of a recording.

    Args:
        storage: The storage of the files.
        files: The files in their order.
        source: What was said of the recording that this was made of: what a recorder was told to keep is kept.
    """
    counts: dict[tuple[str, str], TopicInformation] = {}
    for file in files:
        for topic_id, topic in file.topics.items():
            key = topic.name, topic.serialization_format
            so_far = counts.get(key, TopicInformation(topic, 0))
            count = file.statistics.message_counts.get(topic_id, 0)
            counts[key] = TopicInformation(so_far.topic, so_far.message_count + count)
    filled = [file.statistics for file in files if file.statistics.message_count]
    start = min((each.start_time for each in filled), default=0)
    return BagMetadata(
        storage=storage,
        paths=tuple(file.name for file in files),
        topics=tuple(counts.values()),
        files=tuple(_file(file) for file in files),
        start_time=start,
        duration=max((each.end_time for each in filled), default=0) - start,
        message_count=sum(each.message_count for each in filled),
        custom_data=source.custom_data if source else {},
        ros_distro=source.ros_distro if source else "",
    )


def _file(file: WrittenFile) -> FileInformation:
    statistics = file.statistics
    return FileInformation(
        file.name,
        statistics.start_time,
        statistics.end_time - statistics.start_time,
        statistics.message_count,
    )
