"""What goes out: a protobuf message becomes a ROS message, and anything else is refused."""

from __future__ import annotations

from typing import Any

from rosidl_adapter_proto.adapter import TypeAdapter
from rosidl_adapter_proto.adapter.lazy import name_of


def to_ros_message(adapter: type[TypeAdapter[Any, Any]], message: Any, what: str) -> Any:
    """Return a protobuf message as a ROS message; a ROS message stays as it is.

    As with type adaptation in rclcpp (REP-2007), either may be passed.

    Args:
        adapter: The adapter of the message.
        message: The message that a user passed.
        what: What takes it, for people.

    Raises:
        ConversionError: A value does not fit.
        TypeError: It is neither.
    """
    if isinstance(message, adapter.custom_type):
        return adapter.convert_to_ros_message(message)
    if isinstance(message, adapter.ros_message_type):
        return message
    raise wrong_type(adapter, message, what)


def wrong_type(adapter: type[TypeAdapter[Any, Any]], message: object, what: str) -> TypeError:
    """Return the error for something that is no message of the adapter."""
    expected, found = adapter.custom_type, type(message)
    return TypeError(
        f"{what} takes a protobuf message {expected.__module__}.{expected.__qualname__} "
        f"(or a ROS message {name_of(adapter)}), not {found.__module__}.{found.__qualname__}"
    )
