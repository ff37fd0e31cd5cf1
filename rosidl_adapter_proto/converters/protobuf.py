"""`protobuf_converter`: the protobuf messages of the schemas themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from google.protobuf.message import DecodeError

from rosidl_adapter_proto.adapter.base import copy_message
from rosidl_adapter_proto.converters.interfaces import SerializationFormatConverter, SerializedBagMessage
from rosidl_adapter_proto.errors import ConversionError, wrong_message

if TYPE_CHECKING:
    from google.protobuf.message import Message
    from typing_extensions import Buffer

    from rosidl_adapter_proto.schema.registry import Schema


class ProtobufConverter(SerializationFormatConverter):
    """Reads and writes serialized protobuf messages of the class that the schema has."""

    serialization_format = "protobuf"

    def deserialize(
        self, serialized_message: SerializedBagMessage, type_support: Schema, ros_message: Message
    ) -> None:
        try:
            message = type_support.message_class.FromString(bytes(serialized_message.serialized_data))
        except DecodeError as error:
            raise ConversionError(type_support.type_name, "", f"it is no protobuf message: {error}") from None
        copy_message(message, ros_message)

    def serialize(
        self, ros_message: Message, type_support: Schema, serialized_message: SerializedBagMessage
    ) -> None:
        if not isinstance(ros_message, type_support.message_class):
            raise wrong_message(type_support.type_name, type_support.descriptor.full_name, ros_message)
        serialized_message.serialized_data = type(ros_message).SerializeToString(ros_message)

    def to_protobuf(self, serialized_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return serialized_message.serialized_data

    def from_protobuf(self, protobuf_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return protobuf_message.serialized_data
