"""Converter plugins, after those of rosbag2: what turns messages of one serialization format into those of another."""

from __future__ import annotations

from rosidl_adapter_proto.converters.converter import Converter
from rosidl_adapter_proto.converters.interfaces import (
    SerializationFormatConverter,
    SerializationFormatDeserializer,
    SerializationFormatSerializer,
    SerializedBagMessage,
)
from rosidl_adapter_proto.converters.registry import ConverterRegistry, Plugin, PluginStatus

__all__ = [
    "Converter",
    "ConverterRegistry",
    "Plugin",
    "PluginStatus",
    "SerializationFormatConverter",
    "SerializationFormatDeserializer",
    "SerializationFormatSerializer",
    "SerializedBagMessage",
]
