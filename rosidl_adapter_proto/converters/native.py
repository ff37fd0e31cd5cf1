"""What the built-in converters share: they go from bytes to bytes, and message objects are made of those."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rosidl_adapter_proto.adapter.base import copy_message
from rosidl_adapter_proto.converters.interfaces import (
    SerializationFormatDeserializer,
    SerializationFormatSerializer,
    SerializedBagMessage,
    with_data,
)
from rosidl_adapter_proto.errors import wrong_message
from rosidl_adapter_proto.transcode import Batch, Transcoder

if TYPE_CHECKING:
    from google.protobuf.message import Message
    from typing_extensions import Buffer

    from rosidl_adapter_proto.converters.interfaces import Result
    from rosidl_adapter_proto.schema.registry import Schema


class _Transcoders(dict["Schema", Transcoder]):
    """The transcoder of each type, made when it is first asked for."""

    def __missing__(self, schema: Schema) -> Transcoder:
        return self.setdefault(schema, Transcoder(schema.type_description, schema.descriptor))


class NativeDeserializer(SerializationFormatDeserializer):
    """Reads with a transcoder: a subclass has `to_protobuf`."""

    def __init__(self) -> None:
        self._transcoders = _Transcoders()

    def deserialize(
        self, serialized_message: SerializedBagMessage, type_support: Schema, ros_message: Message
    ) -> None:
        data = self.to_protobuf(serialized_message, type_support)
        copy_message(type_support.message_class.FromString(bytes(data)), ros_message)


class NativeSerializer(SerializationFormatSerializer):
    """Writes with a transcoder: a subclass has `from_protobuf`."""

    def __init__(self) -> None:
        self._transcoders = _Transcoders()

    def serialize(
        self, ros_message: Message, type_support: Schema, serialized_message: SerializedBagMessage
    ) -> None:
        if not isinstance(ros_message, type_support.message_class):
            raise wrong_message(type_support.type_name, type_support.descriptor.full_name, ros_message)
        data = type(ros_message).SerializeToString(ros_message)
        protobuf_message = with_data(serialized_message, data)
        serialized_message.serialized_data = self.from_protobuf(protobuf_message, type_support)


def data_of(messages: Sequence[SerializedBagMessage]) -> list[Buffer]:
    """Return the bytes of messages."""
    return [each.serialized_data for each in messages]


def results(batch: Batch, values: Batch | Sequence[Buffer]) -> list[Result]:
    """Return the error of each message that has failed in a batch, and the value of each other one."""
    for error in batch.errors.values():
        error.batch_index = None  # its place among the results tells which message it was
    return [batch.errors.get(index) or values[index] for index in range(len(batch))]
