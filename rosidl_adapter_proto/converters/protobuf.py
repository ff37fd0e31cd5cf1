"""`protobuf_converter`: the protobuf messages of the schemas themselves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rosidl_adapter_proto.converters.interfaces import SerializationFormatConverter, SerializedBagMessage
from rosidl_adapter_proto.converters.native import NativeDeserializer, NativeSerializer, data_of, results

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from rosidl_adapter_proto.converters.interfaces import Result
    from rosidl_adapter_proto.schema.registry import Schema


class ProtobufConverter(NativeDeserializer, NativeSerializer, SerializationFormatConverter):
    """Reads and writes serialized protobuf messages of the class that the schema has.

    The bytes stay as they are. Those that ROS could not have, such as an array of another length, are refused in both
    directions: plugins may give anything.
    """

    serialization_format = "protobuf"

    def to_protobuf(self, serialized_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        self._transcoders[type_support].proto_to_cdr(serialized_message.serialized_data)
        return serialized_message.serialized_data

    def from_protobuf(self, protobuf_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return self.to_protobuf(protobuf_message, type_support)

    def to_protobuf_batch(
        self, serialized_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        data = data_of(serialized_messages)
        return results(self._transcoders[type_support].proto_to_cdr_batch(data), data)

    def from_protobuf_batch(
        self, protobuf_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        return self.to_protobuf_batch(protobuf_messages, type_support)
