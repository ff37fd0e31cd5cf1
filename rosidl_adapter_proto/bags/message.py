"""A message of a bag: what was recorded, and the protobuf message that it is."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import count
from typing import Any

from google.protobuf.message import Message

from rosidl_adapter_proto.bags.decoding import Decode, decoder
from rosidl_adapter_proto.bags.model import PROTOBUF, Topic, message_place
from rosidl_adapter_proto.bags.types import BagTypes
from rosidl_adapter_proto.errors import BagError, ConversionError


@dataclass
class MessageSource:
    """Where messages come from: a topic in a file. Pickled, it has the definition of its type and no bag.

    Attributes:
        path: The file, for people.
        topic: The topic.
        types: Returns the types of the bag; asked when the first message is wanted.
        fields: Only these fields are in the messages; None for all.
        numbers: Counts the messages.
    """

    path: str
    topic: Topic
    types: Callable[[], BagTypes]
    fields: Sequence[str] | None = None
    numbers: Iterator[int] = field(default_factory=lambda: count(1))

    @cached_property
    def decode(self) -> Decode:
        """Makes messages of bytes."""
        return decoder(self.topic, self.types(), self.fields)

    def __reduce__(self) -> tuple[Callable[..., MessageSource], tuple[Any, ...]]:
        topic = self.topic
        name = "ros_definition" if topic.serialization_format == PROTOBUF else "definition"
        if not getattr(topic, name).encoding:
            with contextlib.suppress(BagError):  # then its messages cannot be decoded there either
                found: dict[str, Any] = {name: self.types().ros_definition(topic)}
                topic = replace(topic, **found)
        values = (getattr(topic, each) for each in _DECISIVE)
        return _source, (self.path, None if self.fields is None else tuple(self.fields), *values)


_DECISIVE = (
    "name",
    "type_name",
    "serialization_format",
    "definition",
    "ros_definition",
    "schema_name",
    "type_hash",
)
"""What of a topic decides its type: all but what the recording says besides."""


@lru_cache(maxsize=1000)
def _source(path: str, fields: Sequence[str] | None, *values: Any) -> MessageSource:
    """Return the source of messages that were pickled: the same one for all that come one by one."""
    topic = Topic(**dict(zip(_DECISIVE, values, strict=True)))
    return MessageSource(path, topic, lambda: BagTypes([topic]), fields)


class BagMessage:
    """A message of a bag. It unpacks as `topic, message, log_time`.

    Pickled, it has what was recorded and the definition of its type, of which `message` is made where it is loaded.

    Attributes:
        topic: The topic that it was sent to.
        log_time: When it was recorded, in nanoseconds since 1970.
        publish_time: When it was sent, in nanoseconds since 1970; where the recorder did not know, `log_time`.
        sequence: Its number among those of its sender; 0 where the recorder did not count.
        data: The message as it was recorded, serialized.
    """

    __slots__ = ("_message", "_number", "_source", "data", "log_time", "publish_time", "sequence", "topic")

    def __init__(
        self,
        topic: str,
        log_time: int,
        publish_time: int,
        sequence: int,
        data: bytes,
        source: MessageSource,
        number: int,
    ) -> None:
        self.topic = topic
        self.log_time = log_time
        self.publish_time = publish_time
        self.sequence = sequence
        self.data = data
        self._source = source
        self._number = number
        self._message: Message | None = None

    @property
    def message(self) -> Any:
        """The protobuf message, which is made when it is first asked for.

        Raises:
            BagError: The bytes are no valid message of the type.
        """
        if self._message is None:
            decode = self._source.decode
            try:
                self._message = decode(self.data)
            except ConversionError as error:
                place = message_place(self._source.path, self._number, self.topic, self.log_time)
                raise BagError(f"{place}: {error}") from error
        return self._message

    def __iter__(self) -> Iterator[Any]:
        return iter((self.topic, self.message, self.log_time))

    def __reduce__(self) -> tuple[type[BagMessage], tuple[Any, ...]]:
        recorded = (self.topic, self.log_time, self.publish_time, self.sequence, self.data)
        return BagMessage, (*recorded, self._source, self._number)

    def __repr__(self) -> str:
        return f"<BagMessage of {self.topic}, recorded at {self.log_time}, {len(self.data)} bytes>"
