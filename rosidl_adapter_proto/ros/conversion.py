"""The way between protobuf messages and what rclpy sends and receives."""

from __future__ import annotations

from functools import cache
from typing import Any, Generic

from rclpy.serialization import deserialize_message, serialize_message

from rosidl_adapter_proto.adapter import CustomT, TypeAdapter
from rosidl_adapter_proto.errors import ConversionError


class RosCodec(Generic[CustomT]):
    """Serializes with rclpy what an adapter converts, since only the adapter knows how: somebody wrote it by hand.

    It has the methods of the codecs of generated adapters.
    """

    def __init__(self, adapter: type[TypeAdapter[CustomT, Any]]) -> None:
        self._adapter = adapter

    def to_cdr(self, message: CustomT) -> bytes:
        """Return a protobuf message as ROS sends it: serialized as CDR, with its encapsulation header.

        Raises:
            ConversionError: A value does not fit.
        """
        return serialize_message(self._adapter.convert_to_ros_message(message))

    def from_cdr(self, data: bytes) -> CustomT:
        """Return the protobuf message of a serialized ROS message.

        Raises:
            ConversionError: The bytes are not such a message, or a value does not fit.
        """
        try:
            message: Any = deserialize_message(data, self._adapter.ros_message_type)
        except Exception as error:  # rclpy raises errors of several kinds
            reason = f"{len(data)} bytes are not a serialized message of this type: {error}"
            raise ConversionError(_type_name(self._adapter), "", reason) from error
        custom: CustomT = self._adapter.convert_to_custom(message)
        return custom


def codec_of(adapter: type[TypeAdapter[CustomT, Any]]) -> RosCodec[CustomT] | type[TypeAdapter[CustomT, Any]]:
    """Return what has the methods `to_cdr` and `from_cdr` for an adapter."""
    return adapter if _is_generated(adapter) else RosCodec(adapter)  # type: ignore[arg-type]  # mypy takes classes for unhashable


@cache
def _is_generated(adapter: type) -> bool:
    """Return whether the conversions of an adapter belong to its fields, so that the transcoder does the same.

    A user may write an adapter for another protobuf class, with conversions of its own.
    """
    names = ("fields", "custom_type", "convert_to_ros_message", "convert_to_custom")
    owners = {next((base for base in adapter.__mro__ if name in vars(base)), None) for name in names}
    return len(owners) == 1


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
        f"(or a ROS message {_type_name(adapter)}), not {found.__module__}.{found.__qualname__}"
    )


def _type_name(adapter: Any) -> str:
    """Return the ROS name of what an adapter converts; one that was written by hand may not say it."""
    return getattr(adapter, "type_name", None) or str(adapter.__qualname__)
