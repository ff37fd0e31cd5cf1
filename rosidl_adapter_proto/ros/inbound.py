"""What arrives: it is converted for the callbacks of users, and what cannot be converted is dropped and reported."""

from __future__ import annotations

import inspect
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic

from rosidl_adapter_proto.adapter import CustomT, RequestT, ResponseT, ServiceAdapter
from rosidl_adapter_proto.adapter.lazy import name_of
from rosidl_adapter_proto.errors import ConversionError
from rosidl_adapter_proto.ros.outbound import to_ros_message

if TYPE_CHECKING:
    from rclpy.impl.rcutils_logger import RcutilsLogger

OnConversionError = Callable[[ConversionError, Any], object]
"""Is called with the error, and with what could not be converted: bytes from a topic, else a ROS message."""

SECONDS_BETWEEN_REPORTS = 5.0
"""How long a source of messages that cannot be converted is not mentioned in the log again."""


@dataclass(eq=False)
class Reception(Generic[CustomT]):
    """Converts what arrives from one source. What cannot be converted is reported, counted and dropped.

    Attributes:
        logger: Of the node, for reports.
        source: Where messages come from, for people.
        convert: Converts one, or raises a ConversionError.
        on_conversion_error: Is called instead of reporting.
        explain: Returns what else there is to say about an error, or nothing.
        received_type: What rclpy passes to a callback; anything else, from a user who calls it, is passed on as it is.
        conversion_errors: How many were dropped.
    """

    logger: RcutilsLogger
    source: str
    convert: Callable[[Any], CustomT]
    on_conversion_error: OnConversionError | None = None
    explain: Callable[[], str] = lambda: ""
    received_type: type = object
    conversion_errors: int = field(default=0, init=False)
    next_report: float = field(default=0.0, init=False)
    reporting: threading.Lock = field(default_factory=threading.Lock, init=False)

    def __call__(self, received: Any) -> CustomT | None:
        """Return what was received, converted; None if that is not possible."""
        try:
            return self.convert(received)
        except ConversionError as error:
            self.drop(error, received)
            return None

    def drop(self, error: ConversionError, received: Any) -> None:
        """Count and report something that cannot be converted."""
        now = time.monotonic()
        with self.reporting:
            self.conversion_errors += 1
            is_reported = self.on_conversion_error is None and now >= self.next_report
            if is_reported:
                self.next_report = now + SECONDS_BETWEEN_REPORTS
        if self.on_conversion_error is not None:
            self.on_conversion_error(error, received)
        elif is_reported:
            self.logger.error(
                f"dropped what came from {self.source}: {error}{self.explain()} "
                f"({self.conversion_errors} dropped so far)"
            )

    def callback(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """Return the callback for rclpy that converts its first argument and then calls the user's."""

        def accept(received: Any, *others: Any) -> tuple[Any, ...] | None:
            message = self(received) if isinstance(received, self.received_type) else received
            return None if message is None else (message, *others)

        return converting_callback(callback, accept)


NO_RESPONSE = object()
"""Stands for the response to a request that was dropped."""


def service_callback(
    adapter: type[ServiceAdapter[RequestT, ResponseT]],
    callback: Callable[..., Any],
    reception: Reception[RequestT],
) -> Callable[..., Any]:
    """Return the callback for rclpy that calls a user's callback with a protobuf request and an empty response."""

    def accept(request: Any, _: Any) -> tuple[RequestT, ResponseT] | None:
        custom_request = reception(request)
        return None if custom_request is None else (custom_request, adapter.response.new())

    def finish(response: Any) -> Any:
        return to_ros_message(adapter.response, response, f"the response of {name_of(adapter)}")

    return converting_callback(callback, accept, finish, NO_RESPONSE)


def converting_callback(
    callback: Callable[..., Any],
    accept: Callable[..., tuple[Any, ...] | None],
    finish: Callable[[Any], Any] = lambda result: result,
    dropped: object = None,
) -> Callable[..., Any]:
    """Return the callback for rclpy that converts what a user's callback takes and returns.

    rclpy looks at a callback's signature, to know whether it takes a MessageInfo, and at whether it is a coroutine
    function: this one looks the same.

    Args:
        callback: The user's callback.
        accept: Returns the arguments for it from those of rclpy, or None if it is not to be called.
        finish: Returns the result for rclpy from its result.
        dropped: The result for rclpy if it is not called.
    """

    async def await_callback(*received: Any) -> Any:
        arguments = accept(*received)
        return dropped if arguments is None else finish(await callback(*arguments))

    def call_callback(*received: Any) -> Any:
        arguments = accept(*received)
        return dropped if arguments is None else finish(callback(*arguments))

    wrapper: Any = await_callback if inspect.iscoroutinefunction(callback) else call_callback
    wrapper.__wrapped__ = callback  # inspect.signature follows it
    return wrapper  # type: ignore[no-any-return]
