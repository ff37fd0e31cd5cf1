"""`cdr_converter`: CDR, the serialization format of DDS and of nearly every ROS 2 middleware."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rosidl_adapter_proto.converters.interfaces import SerializationFormatConverter, SerializedBagMessage
from rosidl_adapter_proto.converters.native import NativeDeserializer, NativeSerializer, data_of, results

if TYPE_CHECKING:
    from typing_extensions import Buffer

    from rosidl_adapter_proto.converters.interfaces import Result
    from rosidl_adapter_proto.schema.registry import Schema


class CdrConverter(NativeDeserializer, NativeSerializer, SerializationFormatConverter):
    """Reads plain CDR of either byte order, and writes it in little-endian order as rclpy does."""

    serialization_format = "cdr"

    def to_protobuf(self, serialized_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return self._transcoders[type_support].cdr_to_proto(serialized_message.serialized_data)

    def from_protobuf(self, protobuf_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return self._transcoders[type_support].proto_to_cdr(protobuf_message.serialized_data)

    def to_protobuf_batch(
        self, serialized_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        batch = self._transcoders[type_support].cdr_to_proto_batch(data_of(serialized_messages))
        return results(batch, batch)

    def from_protobuf_batch(
        self, protobuf_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        batch = self._transcoders[type_support].proto_to_cdr_batch(data_of(protobuf_messages))
        return results(batch, batch)
