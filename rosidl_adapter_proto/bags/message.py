"""A message of a bag: what was recorded, and the protobuf message that it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count
from typing import Any

from google.protobuf.message import Message

from rosidl_adapter_proto.bags.decoding import Decode
from rosidl_adapter_proto.bags.model import Topic, message_place
from rosidl_adapter_proto.errors import BagError, ConversionError


@dataclass
class MessageSource:
    """Where messages come from: a topic in a file.

    Attributes:
        path: The file, for people.
        topic: The topic.
        decoder: Returns what makes messages of bytes; asked once, when the first message is wanted.
        numbers: Counts the messages.
    """

    path: str
    topic: Topic
    decoder: Callable[[], Decode]
    numbers: Iterator[int] = field(default_factory=lambda: count(1))

    @cached_property
    def decode(self) -> Decode:
        """Makes messages of bytes."""
        return self.decoder()


class BagMessage:
    """A message of a bag. It unpacks as `topic, message, log_time`.

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

    def __repr__(self) -> str:
        return f"<BagMessage of {self.topic}, recorded at {self.log_time}, {len(self.data)} bytes>"
