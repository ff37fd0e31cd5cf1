"""Reads messages that are JSON, in the form that protobuf gives it (https://protobuf.dev/programming-guides/json)."""

from __future__ import annotations

from google.protobuf import json_format
from google.protobuf.message import Message

from rosidl_adapter_proto import ConversionError, Schema
from rosidl_adapter_proto.converters import SerializationFormatDeserializer, SerializedBagMessage


class JsonDeserializer(SerializationFormatDeserializer):
    """Such as `{"header": {"frame_id": "map"}}`: fields by their ROS names, and those that are absent are zero."""

    serialization_format = "json"

    def deserialize(
        self, serialized_message: SerializedBagMessage, type_support: Schema, ros_message: Message
    ) -> None:
        try:
            json_format.Parse(bytes(serialized_message.serialized_data), ros_message)
        except (json_format.ParseError, UnicodeDecodeError) as error:
            raise ConversionError(type_support.type_name, "", f"it is no such JSON: {error}") from None
