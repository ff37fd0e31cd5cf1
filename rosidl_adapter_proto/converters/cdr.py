"""`cdr_converter`: CDR, the serialization format of DDS and of nearly every ROS 2 middleware."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.adapter.base import copy_message
from rosidl_adapter_proto.converters.interfaces import SerializationFormatConverter, SerializedBagMessage
from rosidl_adapter_proto.transcode import Batch, Codec

if TYPE_CHECKING:
    from google.protobuf.message import Message
    from typing_extensions import Buffer

    from rosidl_adapter_proto.converters.interfaces import Result
    from rosidl_adapter_proto.schema.registry import Schema


class CdrConverter(SerializationFormatConverter):
    """Reads plain CDR of either byte order, and writes it in little-endian order as rclpy does."""

    serialization_format = "cdr"

    def __init__(self) -> None:
        self._codecs = _Codecs()

    def deserialize(
        self, serialized_message: SerializedBagMessage, type_support: Schema, ros_message: Message
    ) -> None:
        copy_message(self._codecs[type_support].from_cdr(serialized_message.serialized_data), ros_message)

    def serialize(
        self, ros_message: Message, type_support: Schema, serialized_message: SerializedBagMessage
    ) -> None:
        serialized_message.serialized_data = self._codecs[type_support].to_cdr(ros_message)

    def to_protobuf(self, serialized_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return self._codecs[type_support].transcoder.cdr_to_proto(serialized_message.serialized_data)

    def from_protobuf(self, protobuf_message: SerializedBagMessage, type_support: Schema) -> Buffer:
        return self._codecs[type_support].transcoder.proto_to_cdr(protobuf_message.serialized_data)

    def to_protobuf_batch(
        self, serialized_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        transcoder = self._codecs[type_support].transcoder
        return _results(transcoder.cdr_to_proto_batch([each.serialized_data for each in serialized_messages]))

    def from_protobuf_batch(
        self, protobuf_messages: Sequence[SerializedBagMessage], type_support: Schema
    ) -> Sequence[Result]:
        transcoder = self._codecs[type_support].transcoder
        return _results(transcoder.proto_to_cdr_batch([each.serialized_data for each in protobuf_messages]))


class _Codecs(dict["Schema", Codec[Any]]):
    """The codec of each type, made when it is first asked for."""

    def __missing__(self, schema: Schema) -> Codec[Any]:
        return self.setdefault(schema, Codec(schema.type_description, schema.message_class))


def _results(batch: Batch) -> list[Result]:
    for error in batch.errors.values():
        error.batch_index = None  # its place among the results tells which message it was
    return [batch.errors.get(index) or batch[index] for index in range(len(batch))]
