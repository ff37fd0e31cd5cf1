"""Whole messages: what generated conversions do before and after their fields, and with messages in fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from rosidl_adapter_proto.adapter.base import CustomT, RosT, TypeAdapter, copy_message
from rosidl_adapter_proto.adapter.values import CONVERSION_ERRORS, absent_or_exactly, conversion_error, each
from rosidl_adapter_proto.errors import ConversionError, wrong_message


def check_custom(source: object, adapter: type[TypeAdapter[Any, Any]]) -> None:
    """Refuse to read anything but a message of the adapter's protobuf class."""
    if not isinstance(source, adapter.custom_type):
        raise wrong_message(adapter.type_name, adapter.custom_type.DESCRIPTOR.full_name, source)


def finish_custom(message: CustomT, destination: CustomT | None) -> CustomT:
    """Return a converted message, or overwrite the destination with it."""
    if destination is None:
        return message
    copy_message(message, destination)
    return destination


def finish_ros_message(message: Any, destination: Any, adapter: type[TypeAdapter[Any, Any]]) -> Any:
    """Return a converted ROS message, or overwrite the fields of the destination with its fields."""
    if destination is None:
        return message
    if not isinstance(destination, adapter.ros_message_type):
        raise ConversionError(
            adapter.type_name,
            "",
            f"expected a ROS message as destination, not {type(destination).__qualname__}",
        )
    for info in adapter.fields:
        if hasattr(message, info.name):  # an empty message has no fields in Python
            setattr(destination, info.name, getattr(message, info.name))
    return destination


def fill_each(fill: Callable[[Any, Any], None], values: Iterable[Any], field: Any) -> None:
    """Append a message to a repeated field for each ROS message."""
    try:
        for value in values:
            fill(value, field.add())
    except CONVERSION_ERRORS as error:
        raise conversion_error("", f"[{len(field) - 1}]", error) from None


def ros_messages(adapter: type[TypeAdapter[Any, RosT]], values: Sequence[Any]) -> list[RosT]:
    """Return a new ROS message for each message of a repeated field."""
    make, fill = adapter.ros_message_type, adapter.fill_ros_message

    def convert(value: Any) -> RosT:
        message: RosT = make()
        fill(value, message)
        return message

    return each(convert, values)


def ros_message_array(adapter: type[TypeAdapter[Any, RosT]], values: Sequence[Any], size: int) -> list[RosT]:
    """Return the ROS messages of an array; of zeros, if the field is absent."""
    if len(values) == 0:
        values = [adapter.custom_type()] * size
    return ros_messages(adapter, absent_or_exactly(values, size))
