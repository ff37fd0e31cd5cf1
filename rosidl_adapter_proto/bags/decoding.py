"""Makes protobuf messages of what a recording has, whatever it is serialized as."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from google.protobuf.message import DecodeError, Message

from rosidl_adapter_proto.bags.model import CDR, PROTOBUF, ROS1, Topic
from rosidl_adapter_proto.bags.types import BagTypes
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.schema.pools import MessageClass
from rosidl_adapter_proto.schema.registry import Schema
from rosidl_adapter_proto.transcode.codec import Codec, Transcoder
from rosidl_adapter_proto.transcode.error import TranscodeError

Decode = Callable[[bytes], Message]
"""Makes a message of its bytes, and raises ConversionError if they are none."""


def decoder(topic: Topic, types: BagTypes, fields: Sequence[str] | None = None) -> Decode:
    """Return what makes messages of those of a topic.

    Args:
        topic: The topic.
        types: The types of its bag.
        fields: Only these fields are in the messages; None for all.

    Raises:
        BagError: The type or the serialization format of the topic is not known.
        SchemaError: The type has no such field.
    """
    if topic.serialization_format == PROTOBUF and fields is None:
        return _parser(types.message_class(topic))
    decoders = {CDR: _from_cdr, PROTOBUF: _fields_from_protobuf, ROS1: _from_ros1}
    if topic.serialization_format not in decoders:
        raise BagError(
            f"topic {topic.name}: its messages are {topic.serialization_format}, which cannot be read as messages; "
            f"{', '.join(decoders)} can"
        )
    return decoders[topic.serialization_format](types.schema(topic), fields)


def _parser(message_class: MessageClass) -> Decode:
    def parse(data: bytes) -> Message:
        try:
            return message_class.FromString(data)
        except DecodeError:
            name = message_class.DESCRIPTOR.full_name
            raise TranscodeError(name, "", 0, "these are no bytes of this protobuf message") from None

    return parse


def _from_cdr(schema: Schema, fields: Sequence[str] | None) -> Decode:
    if fields is None:
        codec: Codec[Any] = Codec(schema.type_description, schema.message_class)
        return codec.from_cdr
    transcoder = Transcoder(schema.type_description, schema.descriptor, fields=fields)
    parse = _parser(schema.message_class)
    return lambda data: parse(transcoder.cdr_to_proto(data))


def _fields_from_protobuf(schema: Schema, fields: Sequence[str] | None) -> Decode:
    transcoder = Transcoder(schema.type_description, schema.descriptor)
    from_cdr = _from_cdr(schema, fields)
    return lambda data: from_cdr(transcoder.proto_to_cdr(data))


def _from_ros1(schema: Schema, fields: Sequence[str] | None) -> Decode:
    transcoder = Transcoder(schema.type_description, schema.descriptor, fields=fields)
    parse = _parser(schema.message_class)
    return lambda data: parse(transcoder.ros1_to_proto(data))
