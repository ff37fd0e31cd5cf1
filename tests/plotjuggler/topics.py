"""Topics with a schema and messages, as plugins get them."""

from __future__ import annotations

import random
from dataclasses import dataclass
from functools import cache

from reference_cdr import write_cdr
from ros_types import protobuf_message, random_value

from rosidl_adapter_proto.bags.descriptors import descriptor_set
from rosidl_adapter_proto.interfaces.recorded import recorded_text
from rosidl_adapter_proto.schema.registry import TypeRegistry
from tests.bags.recordings import types_of

ENCODINGS = ("protobuf", "ros2msg")
TYPES = (
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/PointCloud2",
    "tf2_msgs/msg/TFMessage",
    "nav_msgs/msg/Path",
    "std_msgs/msg/Empty",
    "diagnostic_msgs/msg/DiagnosticArray",
)


@dataclass(frozen=True)
class Topic:
    """What a recording has of a topic."""

    type_name: str
    schema: bytes
    messages: tuple[bytes, ...]


@cache
def registry() -> TypeRegistry:
    return TypeRegistry()


@cache
def topics(encoding: str, count: int = 5) -> tuple[Topic, ...]:
    """Return topics with random messages, which have the same values in each encoding."""
    return tuple(_topic(encoding, name, count) for name in TYPES)


def _topic(encoding: str, name: str, count: int) -> Topic:
    schema = registry()[name]
    types = types_of(schema)
    rng = random.Random(name)
    values = [random_value(types, name, rng) for _ in range(count)]
    if encoding == "ros2msg":
        _, text = recorded_text(registry().definitions(name))
        return Topic(name, text, tuple(write_cdr(types, name, value) for value in values))
    messages = (protobuf_message(types, name, value, schema.message_class()) for value in values)
    descriptor = schema.descriptor
    return Topic(
        descriptor.full_name, descriptor_set(descriptor), tuple(each.SerializeToString() for each in messages)
    )
