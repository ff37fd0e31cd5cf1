"""The way between protobuf and what rclpy sends and receives, and what happens to messages that cannot go it."""

from __future__ import annotations

import inspect
import threading
import time
from collections.abc import Callable
from functools import cache
from typing import Any, Generic

from rclpy.node import Node

from rosidl_adapter_proto.adapter import CustomT, TypeAdapter
from rosidl_adapter_proto.adapter.lazy import name_of
from rosidl_adapter_proto.errors import ConversionError

OnConversionError = Callable[[ConversionError, Any], object]
"""Is called with the error, and with what could not be converted: bytes from a topic, else a ROS message."""

SECONDS_BETWEEN_REPORTS = 5.0
"""How long a source of messages that cannot be converted is not mentioned in the log again."""


def serialize(adapter: type[TypeAdapter[CustomT, Any]], message: CustomT) -> bytes:
    """Return a protobuf message as ROS sends it: serialized as CDR, with its encapsulation header.

    Raises:
        ConversionError: A value does not fit.
    """
    return (adapter.codec or adapter).to_cdr(message)


def deserialize(adapter: type[TypeAdapter[CustomT, Any]], data: bytes) -> CustomT:
    """Return the protobuf message of a serialized ROS message.

    Raises:
        ConversionError: The bytes are not such a message, or a value does not fit.
    """
    message: CustomT = (adapter.codec or adapter).from_cdr(data)
    return message


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


class Reception(Generic[CustomT]):
    """Converts what arrives from one source. What cannot be converted is reported, counted and dropped.

    Attributes:
        conversion_errors: How many were dropped.
    """

    def __init__(
        self,
        node: Node,
        source: str,
        convert: Callable[[Any], CustomT],
        on_conversion_error: OnConversionError | None = None,
        explain: Callable[[], str] = lambda: "",
        received_type: type = object,
    ) -> None:
        """Make the reception of a source.

        Args:
            node: The node whose logger reports.
            source: Where messages come from, for people.
            convert: Converts one, or raises a ConversionError.
            on_conversion_error: Is called instead of reporting.
            explain: Returns what else there is to say about an error, or nothing.
            received_type: What rclpy passes to a callback; anything else, from a user who calls it, is passed on as it
                is.
        """
        self.conversion_errors = 0
        self._node = node
        self._source = source
        self._convert = convert
        self._on_conversion_error = on_conversion_error
        self._explain = explain
        self._received_type = received_type
        self._next_report = 0.0
        self._lock = threading.Lock()

    def __call__(self, received: Any) -> CustomT | None:
        """Return what was received, converted; None if that is not possible."""
        try:
            return self._convert(received)
        except ConversionError as error:
            self._drop(error, received)
            return None

    def _drop(self, error: ConversionError, received: Any) -> None:
        now = time.monotonic()
        with self._lock:
            self.conversion_errors += 1
            is_reported = self._on_conversion_error is None and now >= self._next_report
            if is_reported:
                self._next_report = now + SECONDS_BETWEEN_REPORTS
        if self._on_conversion_error is not None:
            self._on_conversion_error(error, received)
        elif is_reported:
            self._node.get_logger().error(
                f"dropped what came from {self._source}: {error}{self._explain()} "
                f"({self.conversion_errors} dropped so far)"
            )

    def callback(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """Return the callback for rclpy that converts its first argument and then calls the user's.

        rclpy looks at a callback's signature, to know whether it takes a MessageInfo, and at whether it is a coroutine
        function: this one looks the same.

        Args:
            callback: The user's callback.
        """

        def accept(message: Any) -> Any:
            return self(message) if isinstance(message, self._received_type) else message

        async def await_callback(received: Any, *others: Any) -> Any:
            message = accept(received)
            return None if message is None else await callback(message, *others)

        def call_callback(received: Any, *others: Any) -> Any:
            message = accept(received)
            return None if message is None else callback(message, *others)

        return imitate(callback, await_callback, call_callback)


def imitate(callback: Callable[..., Any], coroutine: Any, function: Any) -> Callable[..., Any]:
    """Return the one of two wrappers that is of the callback's kind, with the callback's signature."""
    wrapper: Callable[..., Any] = coroutine if inspect.iscoroutinefunction(callback) else function
    wrapper.__wrapped__ = callback  # type: ignore[attr-defined]  # inspect.signature follows it
    return wrapper


def convert_in(entity: Any, entity_class: type, **attributes: Any) -> None:
    """Make an object of rclpy one that converts: give it a subclass of its class, and attributes.

    Nodes name the classes of what they create, and executors know these objects by what rclpy put into them. So rclpy
    makes them, whole and registered, and afterwards they learn to convert.

    Args:
        entity: What rclpy made.
        entity_class: The class that converts: a subclass of rclpy's.
        attributes: What that class needs to know.
    """
    vars(entity).update(attributes)
    rclpy_class: type = type(entity)
    entity.__class__ = combined(entity_class, rclpy_class)


@cache
def combined(entity_class: type, rclpy_class: type) -> type:
    """Return a class of rclpy that converts: `entity_class`, unless rclpy's is a subclass of what that builds on."""
    if issubclass(entity_class, rclpy_class):
        return entity_class
    return type(rclpy_class.__name__, (entity_class, rclpy_class), {"__module__": entity_class.__module__})
