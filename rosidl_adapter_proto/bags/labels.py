"""Whether messages are what a recording says: `ros2 bag` has labelled messages of any format `cdr`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import islice
from typing import TYPE_CHECKING

from rosidl_adapter_proto.bags.compression import read_chunk
from rosidl_adapter_proto.bags.model import CDR, PROTOBUF, Selection, Topic
from rosidl_adapter_proto.bags.storage import StorageReader
from rosidl_adapter_proto.errors import BagError

if TYPE_CHECKING:
    from typing_extensions import Buffer

_LOOKED_AT = 10
"""How many messages of a topic are looked at: if none of them is what the label says, the label is wrong."""

_CHUNKS_LOOKED_AT = 16
_MESSAGES_LOOKED_THROUGH = 10_000
"""How much is looked through for a topic: in a file without an index every chunk may have it."""

# The second byte of CDR, behind a zero (DDS-XTypes 1.3, 7.6.3.1.2): plain and parameter lists, XCDR 1 and 2.
_CDR_REPRESENTATIONS = frozenset((0, 1, 2, 3, 6, 7, 8, 9, 10, 11))


def begins_as_cdr(data: Buffer) -> bool:
    """Tell whether bytes begin with the encapsulation header that all CDR has, and no protobuf."""
    first = bytes(memoryview(data)[:4])
    return len(first) == 4 and first[0] == 0 and first[1] in _CDR_REPRESENTATIONS


def begins_as_protobuf(data: Buffer) -> bool:
    """Tell whether bytes do not begin with a zero: no field of protobuf has the number 0."""
    return bytes(memoryview(data)[:1]) != b"\0"


_CHECKS = {CDR: (begins_as_cdr, PROTOBUF), PROTOBUF: (begins_as_protobuf, CDR)}
"""How messages of a format begin, and what they may be if they do not."""


def label_warnings(reader: StorageReader, topics: Mapping[int, Topic]) -> list[str]:
    """Return what to say of topics whose messages do not begin as their serialization format wants it.

    Args:
        reader: The file.
        topics: The topics to look at, by their ids.
    """
    warnings = []
    waiting = {topic_id for topic_id, topic in topics.items() if topic.serialization_format in _CHECKS} & {
        topic_id for topic_id, count in reader.statistics.message_counts.items() if count
    }
    while waiting:
        # The chunk that has one of them most likely has others too.
        found = _first_messages(reader, waiting) or {each: [] for each in waiting}
        waiting -= found.keys()
        for topic_id, messages in found.items():
            topic = topics[topic_id]
            begins, other = _CHECKS[topic.serialization_format]
            if messages and not any(map(begins, messages)):
                warnings.append(
                    f"topic {topic.name} says {topic.serialization_format}, but its messages do not look like it; "
                    f"if they are {other}, `--from {other}` says so"
                )
    return warnings


def _first_messages(reader: StorageReader, topic_ids: Iterable[int]) -> dict[int, list[memoryview]]:
    """Return the first messages of those topics that are in the first chunk that has any; empty if none has."""
    selection = Selection(frozenset(topic_ids))
    found: dict[int, list[memoryview]] = {}
    try:
        for chunk in islice(reader.chunks(selection), _CHUNKS_LOOKED_AT):
            records = read_chunk(chunk, selection)
            for index, topic_id in enumerate(islice(records.topic_ids, _MESSAGES_LOOKED_THROUGH)):
                messages = found.setdefault(topic_id, [])
                if len(messages) < _LOOKED_AT:
                    messages.append(records[index])
            if found:
                break
    except BagError:  # the file is damaged, which those say who read it as a whole
        pass
    return found
