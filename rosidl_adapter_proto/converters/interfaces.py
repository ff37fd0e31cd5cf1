"""What a converter plugin is: the interfaces of rosbag2, with Python's words for types and messages.

What rosbag2 calls a ROS message is here a protobuf message of the class that the schema of the type has
(`Schema.message_class`), and what it calls type support is that schema. A plugin turns such messages into the bytes of
its format, or back, or both.

Between two formats messages go as protobuf bytes, so that a plugin that can skip message objects may do so:
`to_protobuf` and `from_protobuf`, for one message or for many, are what callers call. A plugin that has only
`deserialize` or `serialize` gets them from here.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, TypeAlias

if TYPE_CHECKING:
    from google.protobuf.message import Message
    from typing_extensions import Buffer

    from rosidl_adapter_proto.schema.registry import Schema

    Result: TypeAlias = Buffer | Exception
    """What becomes of one message of a batch: its bytes, or why there are none."""


@dataclass
class SerializedBagMessage:
    """One message of a bag (`rosbag2_storage::SerializedBagMessage`).

    Attributes:
        serialized_data: Its bytes.
        topic_name: Its topic, such as `/imu`.
        recv_timestamp: When it was recorded, in nanoseconds since 1970.
        send_timestamp: When it was published, in nanoseconds since 1970; 0 if unknown.
        sequence_number: Its number among those of its publisher; 0 if unknown.
    """

    serialized_data: Buffer = field(default=b"", repr=False)
    topic_name: str = ""
    recv_timestamp: int = 0
    send_timestamp: int = 0
    sequence_number: int = 0


def with_data(message: SerializedBagMessage, data: Buffer) -> SerializedBagMessage:
    """Return a message with other bytes; `dataclasses.replace` takes much longer."""
    times = (message.recv_timestamp, message.send_timestamp, message.sequence_number)
    return SerializedBagMessage(data, message.topic_name, *times)


class SerializationFormatDeserializer(ABC):
    """Reads messages of a serialization format.

    A class has no arguments. Bytes that are no message of the type are a `ConversionError`; whatever else a plugin
    raises is wrapped in one by `Converter`. An object is used by one thread at a time.

    Attributes:
        serialization_format: The name of the format, such as `cdr`. Only a class that is named on the command line
            needs it; an entry point has the name in its own.
    """

    serialization_format: ClassVar[str] = ""

    @abstractmethod
    def deserialize(
        self, serialized_message: SerializedBagMessage, type_support: Schema, ros_message: Message
    ) -> None:
        """Fill a message with what its bytes say.

        Args:
            serialized_message: The message as the bag has it.
            type_support: The type of the message.
            ros_message: A new message of `type_support.message_class`, which is filled.

        Raises:
            ConversionError: The bytes are no message of the type.
        """

    def to_protobuf(self, serialized_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        """Return a message as protobuf bytes; override it if that takes no message object.

        Args:
            serialized_message: The message as the bag has it.
            type_support: The type of the message.

        Raises:
            ConversionError: The bytes are no message of the type.
        """
        ros_message = type_support.message_class()
        self.deserialize(serialized_message, type_support, ros_message)
        return type(ros_message).SerializeToString(ros_message)

    def to_protobuf_batch(
        self, serialized_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        """Return many messages of one type as protobuf bytes; override it if that is faster than one after the other.

        Args:
            serialized_messages: The messages as the bag has them.
            type_support: The type of all of them.

        Returns:
            For each message its bytes, or the error, in their order: one that fails does not fail the others.
        """
        return _each(self.to_protobuf, serialized_messages, type_support)


class SerializationFormatSerializer(ABC):
    """Writes messages of a serialization format; what is said of `SerializationFormatDeserializer` holds here, too."""

    serialization_format: ClassVar[str] = ""

    @abstractmethod
    def serialize(
        self, ros_message: Message, type_support: Schema, serialized_message: SerializedBagMessage
    ) -> None:
        """Fill the bytes of a message.

        Args:
            ros_message: A message of `type_support.message_class`.
            type_support: The type of the message.
            serialized_message: Has topic and times, and gets `serialized_data`.

        Raises:
            ConversionError: The format cannot have such a message.
        """

    def from_protobuf(self, protobuf_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        """Return the bytes of a message that is protobuf; override it if that takes no message object.

        Args:
            protobuf_message: The message, of which `serialized_data` is protobuf.
            type_support: The type of the message.

        Raises:
            ConversionError: The bytes are no message of the type, or the format cannot have it.
        """
        ros_message = type_support.message_class.FromString(bytes(protobuf_message.serialized_data))
        serialized_message = with_data(protobuf_message, b"")
        self.serialize(ros_message, type_support, serialized_message)
        return serialized_message.serialized_data

    def from_protobuf_batch(
        self, protobuf_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        """Return the bytes of many messages of one type; override it if that is faster than one after the other.

        Args:
            protobuf_messages: The messages, of which `serialized_data` is protobuf.
            type_support: The type of all of them.

        Returns:
            For each message its bytes, or the error, in their order: one that fails does not fail the others.
        """
        return _each(self.from_protobuf, protobuf_messages, type_support)


class SerializationFormatConverter(SerializationFormatSerializer, SerializationFormatDeserializer):
    """Reads and writes messages of a serialization format. For each direction there is an object of its own."""


def _each(
    convert: Callable[[SerializedBagMessage, Schema], Buffer],
    messages: Sequence[SerializedBagMessage],
    type_support: Schema,
) -> list[Result]:
    results: list[Result] = []
    for message in messages:
        try:
            results.append(convert(message, type_support))
        except Exception as error:  # whatever a plugin raises is the result of this message alone
            results.append(error)
    return results
