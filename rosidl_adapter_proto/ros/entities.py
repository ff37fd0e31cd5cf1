"""What a node creates: rclpy's own publishers, subscriptions, services and clients, with protobuf messages."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Generic

import rclpy.client
import rclpy.lifecycle
import rclpy.publisher
import rclpy.service
import rclpy.subscription
import rclpy.task

from rosidl_adapter_proto.adapter import CustomT, RequestT, ResponseT, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.errors import ConversionError
from rosidl_adapter_proto.ros.conversion import (
    Reception,
    convert_in,
    imitate,
    serialize,
    to_ros_message,
    wrong_type,
)

# rclpy's classes are generic in newer versions only, and then in the ROS type.
# mypy: disable-error-code="type-arg, unused-ignore"


class Publisher(rclpy.publisher.Publisher, Generic[CustomT]):
    """A publisher of protobuf messages.

    Attributes:
        adapter: Converts the messages.
        msg_type: The ROS class of the messages.
    """

    adapter: type[TypeAdapter[CustomT, Any]]

    def publish(self, msg: CustomT | Any) -> None:
        """Send a message.

        Args:
            msg: A protobuf message. A ROS message is sent too, as is one that is serialized already, as bytes.

        Raises:
            ConversionError: A value does not fit the ROS type; nothing is sent.
            TypeError: It is none of these.
        """
        # An inactive lifecycle publisher sends nothing, so there is nothing to convert.
        if not getattr(self, "is_activated", True):
            return
        if isinstance(msg, self.adapter.custom_type):
            msg = serialize(self.adapter, msg)
        elif not isinstance(msg, (bytes, self.msg_type)):
            raise wrong_type(self.adapter, msg, f"the publisher of {self.topic_name}")
        super().publish(msg)


class LifecyclePublisher(rclpy.lifecycle.LifecyclePublisher, Publisher[CustomT]):
    """A publisher of protobuf messages that sends only while its lifecycle node is active."""

    publish = Publisher.publish


class Subscription(rclpy.subscription.Subscription, Generic[CustomT]):
    """A subscription to protobuf messages.

    The executor hands `callback` serialized messages (so `raw` is true), which it converts for the user's callback:
    `callback.__wrapped__`. Called with a protobuf message, it passes that on, and so a callback can be tried by hand.

    Attributes:
        adapter: Converts the messages.
        msg_type: The ROS class of the messages.
    """

    adapter: type[TypeAdapter[CustomT, Any]]
    _reception: Reception[CustomT]

    @property
    def conversion_errors(self) -> int:
        """How many messages were dropped, since they could not be converted."""
        return self._reception.conversion_errors

    @property
    def callback(self) -> Callable[..., Any]:
        """What the executor calls; set to a callback for protobuf messages."""
        return self._callback

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        rclpy.subscription.Subscription.callback.fset(self, self._reception.callback(value))  # type: ignore[attr-defined]


class _NoResponse:
    """Stands for the response to a request that was dropped."""


class Service(rclpy.service.Service, Generic[RequestT, ResponseT]):
    """A service with protobuf requests and responses.

    A request that cannot be converted is dropped: its client waits as for a service that has gone.

    Attributes:
        adapter: Converts requests and responses.
        srv_type: The ROS class of the service.
    """

    adapter: type[ServiceAdapter[RequestT, ResponseT]]
    _reception: Reception[RequestT]

    @property
    def conversion_errors(self) -> int:
        """How many requests were dropped, since they could not be converted."""
        return self._reception.conversion_errors

    @property
    def callback(self) -> Callable[..., Any]:  # type: ignore[override]
        """What the executor calls; set to a callback for protobuf messages."""
        callback: Callable[..., Any] = vars(self)["callback"]
        return callback

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        vars(self)["callback"] = service_callback(self.adapter, value, self._reception)

    def send_response(self, response: ResponseT | Any, header: Any) -> None:
        """Send a response.

        Args:
            response: A protobuf message, or a ROS message.
            header: The header of the request.

        Raises:
            ConversionError: A value does not fit the ROS type; nothing is sent.
            TypeError: It is neither.
        """
        if not isinstance(response, _NoResponse):
            what = f"the response of {self.service_name}"
            super().send_response(to_ros_message(self.adapter.response, response, what), header)


def service_callback(
    adapter: type[ServiceAdapter[RequestT, ResponseT]],
    callback: Callable[..., Any],
    reception: Reception[RequestT],
) -> Callable[..., Any]:
    """Return the callback for rclpy that calls a user's callback with a protobuf request and an empty response."""
    what = f"the response of {adapter.type_name}"

    async def await_callback(request: Any, response: Any) -> Any:
        custom_request = reception(request)
        if custom_request is None:
            return _NoResponse()
        return to_ros_message(adapter.response, await callback(custom_request, adapter.response.new()), what)

    def call_callback(request: Any, response: Any) -> Any:
        custom_request = reception(request)
        if custom_request is None:
            return _NoResponse()
        return to_ros_message(adapter.response, callback(custom_request, adapter.response.new()), what)

    return imitate(callback, await_callback, call_callback)


class Client(rclpy.client.Client, Generic[RequestT, ResponseT]):
    """A client of a service, with protobuf requests and responses.

    Attributes:
        adapter: Converts requests and responses.
        srv_type: The ROS class of the service.
    """

    adapter: type[ServiceAdapter[RequestT, ResponseT]]

    def call(self, request: RequestT | Any, timeout_sec: float | None = None) -> ResponseT | None:
        """Make a request and wait for the response, as `rclpy.client.Client.call` does.

        Raises:
            ConversionError: A value does not fit on the other side.
            TypeError: The request is neither a protobuf message nor a ROS message of this service.
            TimeoutError: There is no response within the timeout (older rclpy returns None instead).
        """
        response: ResponseT | None = super().call(self._ros_request(request), timeout_sec)
        return response

    def call_async(self, request: RequestT | Any) -> rclpy.task.Future[ResponseT]:
        """Make a request, and return a future of the response.

        A response that cannot be converted is the ConversionError of the future.

        Raises:
            ConversionError: A value of the request does not fit the ROS type; nothing is sent.
            TypeError: The request is neither a protobuf message nor a ROS message of this service.
        """
        future = super().call_async(self._ros_request(request))
        convert_result(future, self.adapter.response)
        return future

    def _ros_request(self, request: RequestT | Any) -> Any:
        return to_ros_message(self.adapter.request, request, f"the client of {self.service_name}")


class ConvertedFuture(rclpy.task.Future):
    """A future whose result is converted when it is first asked for, in the thread that asks."""

    _adapter: type[TypeAdapter[Any, Any]] | None
    _conversion_lock: threading.Lock

    def result(self) -> Any:
        """Return the protobuf message, None while there is none, or raise what went wrong."""
        self._convert()
        return super().result()

    def exception(self) -> Exception | None:
        """Return what went wrong, if anything."""
        self._convert()
        return super().exception()

    def _convert(self) -> None:
        with self._conversion_lock:
            if self._adapter is None or self._result is None:
                return
            try:
                self._result = self._adapter.convert_to_custom(self._result)
            except ConversionError as error:
                self._exception = error
            self._adapter = None


def convert_result(future: rclpy.task.Future[Any], adapter: type[TypeAdapter[Any, Any]]) -> None:
    """Make the result of a future a protobuf message; it may be done already."""
    convert_in(future, ConvertedFuture, _adapter=adapter, _conversion_lock=threading.Lock())
