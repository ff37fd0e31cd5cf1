"""Plugins for tests: sound ones, and faulty ones."""

from __future__ import annotations

from pathlib import Path

from google.protobuf import json_format
from google.protobuf.message import Message

from rosidl_adapter_proto.converters import (
    SerializationFormatConverter,
    SerializationFormatDeserializer,
    SerializationFormatSerializer,
    SerializedBagMessage,
)
from rosidl_adapter_proto.schema.registry import Schema


class JsonDeserializer(SerializationFormatDeserializer):
    serialization_format = "json"

    def deserialize(
        self, serialized_message: SerializedBagMessage, type_support: Schema, ros_message: Message
    ) -> None:
        json_format.Parse(bytes(serialized_message.serialized_data), ros_message)


class JsonSerializer(SerializationFormatSerializer):
    serialization_format = "json"

    def serialize(
        self, ros_message: Message, type_support: Schema, serialized_message: SerializedBagMessage
    ) -> None:
        text = json_format.MessageToJson(ros_message, indent=None, preserving_proto_field_name=True)
        serialized_message.serialized_data = text.encode()


class JsonConverter(SerializationFormatConverter):
    serialization_format = "json"
    deserialize = JsonDeserializer.deserialize
    serialize = JsonSerializer.serialize


class Nameless(SerializationFormatDeserializer):
    deserialize = JsonDeserializer.deserialize


class Unfinished(SerializationFormatConverter):
    deserialize = JsonDeserializer.deserialize


class Failing(JsonConverter):
    def __init__(self) -> None:
        raise ValueError("no licence")


NOT_A_CLASS = JsonConverter.deserialize


class NotAConverter:
    pass


def install(folder: Path, distribution: str, /, **plugins: str) -> None:
    """Make a folder of installed distributions have one more, with an entry point for each plugin."""
    information = folder / f"{distribution.replace('-', '_')}-1.0.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n")
    lines = "".join(f"{name} = {reference}\n" for name, reference in plugins.items())
    (information / "entry_points.txt").write_text(f"[rosidl_adapter_proto.converters]\n{lines}")
