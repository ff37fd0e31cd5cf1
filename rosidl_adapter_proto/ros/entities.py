"""What a node creates: rclpy's own publishers, subscriptions, services and clients, with protobuf messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic

import rclpy.client
import rclpy.lifecycle
import rclpy.publisher
import rclpy.service
import rclpy.subscription
import rclpy.task

from rosidl_adapter_proto.adapter import CustomT, RequestT, ResponseT, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.ros.adapters import RosMessage
from rosidl_adapter_proto.ros.inbound import NO_RESPONSE, Reception, service_callback
from rosidl_adapter_proto.ros.outbound import to_ros_message, wrong_type
from rosidl_adapter_proto.ros.rclpy_internals import (
    callback_of_service,
    convert_result,
    set_callback_of_service,
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
    _custom_type: type[CustomT]
    _to_cdr: Callable[[CustomT], bytes]

    def publish(self, msg: CustomT | RosMessage | bytes) -> None:
        """Send a message.

        Args:
            msg: A protobuf message. A ROS message is sent too, as is one that is serialized already, as bytes.

        Raises:
            ConversionError: A value does not fit the ROS type; nothing is sent.
            TypeError: It is none of these.
        """
        if isinstance(msg, self._custom_type):
            msg = self._to_cdr(msg)
        elif not isinstance(msg, (bytes, self.msg_type)):
            raise wrong_type(self.adapter, msg, f"the publisher of {self.topic_name}")
        super().publish(msg)


class LifecyclePublisher(rclpy.lifecycle.LifecyclePublisher, Publisher[CustomT]):
    """A publisher of protobuf messages that sends only while its lifecycle node is active."""

    def publish(self, msg: CustomT | RosMessage | bytes) -> None:
        """Send a message, as `Publisher.publish` does; while the node is inactive, look at nothing and send nothing."""
        if self.is_activated:
            Publisher.publish(self, msg)


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
        return super().callback

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        rclpy.subscription.Subscription.callback.fset(self, self._reception.callback(value))  # type: ignore[attr-defined]


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
        return callback_of_service(self)

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        set_callback_of_service(self, service_callback(self.adapter, value, self._reception))

    def send_response(self, response: ResponseT | RosMessage, header: Any) -> None:
        """Send a response.

        Args:
            response: A protobuf message, or a ROS message.
            header: The header of the request.

        Raises:
            ConversionError: A value does not fit the ROS type; nothing is sent.
            TypeError: It is neither.
        """
        if response is not NO_RESPONSE:
            what = f"the response of {self.service_name}"
            super().send_response(to_ros_message(self.adapter.response, response, what), header)


class Client(rclpy.client.Client, Generic[RequestT, ResponseT]):
    """A client of a service, with protobuf requests and responses.

    Attributes:
        adapter: Converts requests and responses.
        srv_type: The ROS class of the service.
    """

    adapter: type[ServiceAdapter[RequestT, ResponseT]]

    def call(self, request: RequestT | RosMessage, timeout_sec: float | None = None) -> ResponseT | None:
        """Make a request and wait for the response, as `rclpy.client.Client.call` does.

        Raises:
            ConversionError: A value does not fit on the other side.
            TypeError: The request is neither a protobuf message nor a ROS message of this service.
            TimeoutError: There is no response within the timeout (older rclpy returns None instead).
        """
        response: ResponseT | None = super().call(self._ros_request(request), timeout_sec)
        return response

    def call_async(self, request: RequestT | RosMessage) -> rclpy.task.Future[ResponseT]:
        """Make a request, and return a future of the response.

        A response that cannot be converted is the ConversionError of the future.

        Raises:
            ConversionError: A value of the request does not fit the ROS type; nothing is sent.
            TypeError: The request is neither a protobuf message nor a ROS message of this service.
        """
        future = super().call_async(self._ros_request(request))
        convert_result(future, self.adapter.response)
        return future

    def _ros_request(self, request: RequestT | RosMessage) -> Any:
        return to_ros_message(self.adapter.request, request, f"the client of {self.service_name}")
