"""Nodes that create publishers, subscriptions, services and clients for protobuf messages, and functions that do.

Each takes an adapter, a protobuf class or a ROS type. This file says to type checkers which of these makes what, and to
people what it does; `creation.py` does it.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, Literal, TypedDict, TypeVar, overload

import rclpy.lifecycle
import rclpy.node

from rosidl_adapter_proto.adapter import CustomT, RequestT, ResponseT, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.ros import creation
from rosidl_adapter_proto.ros.adapters import RosMessage, RosService
from rosidl_adapter_proto.ros.entities import (
    Client,
    LifecyclePublisher,
    Publisher,
    Service,
    Subscription,
)
from rosidl_adapter_proto.ros.inbound import OnConversionError

if TYPE_CHECKING:
    import rclpy.client
    import rclpy.publisher
    import rclpy.service
    import rclpy.subscription
    from rclpy.callback_groups import CallbackGroup
    from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
    from rclpy.qos import QoSProfile
    from rclpy.qos_overriding_options import QoSOverridingOptions
    from rclpy.subscription import MessageInfo
    from rclpy.subscription_content_filter_options import ContentFilterOptions
    from typing_extensions import Unpack

    RosMessageT = TypeVar("RosMessageT", bound=RosMessage)
    MessageT = TypeVar("MessageT")

    MessageType = type[TypeAdapter[CustomT, Any]] | type[CustomT]
    """An adapter, or a protobuf class that has one."""

    Callback = Callable[[MessageT], object] | Callable[[MessageT, MessageInfo], object]
    """Takes a message, and its MessageInfo if it wants to."""

    ServiceCallback = Callable[
        [RequestT, ResponseT], ResponseT | RosMessage | Coroutine[Any, Any, ResponseT | RosMessage]
    ]
    """Takes a request and an empty response, and returns the response; or is a coroutine function that does."""

    class PublisherOptions(TypedDict, total=False):
        """What `rclpy.node.Node.create_publisher` takes besides."""

        callback_group: CallbackGroup | None
        event_callbacks: PublisherEventCallbacks | None
        qos_overriding_options: QoSOverridingOptions | None
        publisher_class: type[rclpy.publisher.Publisher[Any]]

    class LifecyclePublisherOptions(TypedDict, total=False):
        """What `rclpy.lifecycle.LifecycleNode.create_lifecycle_publisher` takes besides."""

        callback_group: CallbackGroup | None
        event_callbacks: PublisherEventCallbacks | None
        qos_overriding_options: QoSOverridingOptions | None

    class SubscriptionOptions(TypedDict, total=False):
        """What `rclpy.node.Node.create_subscription` takes besides."""

        callback_group: CallbackGroup | None
        event_callbacks: SubscriptionEventCallbacks | None
        qos_overriding_options: QoSOverridingOptions | None
        content_filter_options: ContentFilterOptions | None

    class ServiceOptions(TypedDict, total=False):
        """What `rclpy.node.Node.create_service` and `create_client` take besides."""

        qos_profile: QoSProfile
        callback_group: CallbackGroup | None


class NodeMixin:
    """Makes another node class create things for protobuf messages too, as in `class Camera(NodeMixin, LifecycleNode)`.

    Its methods are also functions of this module, which take any node as their first argument.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        """Check the order of base classes.

        Raises:
            TypeError: The methods of a node class hide those of the mixin.
        """
        super().__init_subclass__(**options)
        bases = cls.__mro__
        if rclpy.node.Node in bases and bases.index(rclpy.node.Node) < bases.index(NodeMixin):
            raise TypeError(
                f"class {cls.__name__}: NodeMixin has no effect behind a node class; put it first"
            )

    @overload
    def create_publisher(
        self: Any,
        msg_type: MessageType[CustomT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[PublisherOptions],
    ) -> Publisher[CustomT]: ...

    @overload
    def create_publisher(
        self: Any,
        msg_type: type[RosMessageT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[PublisherOptions],
    ) -> rclpy.publisher.Publisher[RosMessageT]: ...

    def create_publisher(
        self: Any, msg_type: Any, topic: str, qos_profile: QoSProfile | int, **options: Any
    ) -> Any:
        """Create a publisher.

        Args:
            msg_type: An adapter, a protobuf class that has one, or a ROS message class.
            topic: The name of the topic.
            qos_profile: The quality of service, or the depth of the history.
            options: As of `rclpy.node.Node.create_publisher`.

        Returns:
            A `Publisher` of protobuf messages; rclpy's own for a ROS message class.

        Raises:
            AdapterNotFoundError: The protobuf class has no adapter.
            RosNotFoundError: The ROS message class cannot be imported.
            TypeHashError: The adapter was generated for another version of the type than the installed one.
        """
        return creation.create_publisher(_node_of_rclpy(self), msg_type, topic, qos_profile, **options)

    @overload
    def create_lifecycle_publisher(
        self: Any,
        msg_type: MessageType[CustomT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[LifecyclePublisherOptions],
    ) -> LifecyclePublisher[CustomT]: ...

    @overload
    def create_lifecycle_publisher(
        self: Any,
        msg_type: type[RosMessageT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[LifecyclePublisherOptions],
    ) -> rclpy.lifecycle.LifecyclePublisher[RosMessageT]: ...

    def create_lifecycle_publisher(
        self: Any, msg_type: Any, topic: str, qos_profile: QoSProfile | int, **options: Any
    ) -> Any:
        """Create a publisher that sends only while its lifecycle node is active; else as `create_publisher`."""
        return creation.create_lifecycle_publisher(
            _node_of_rclpy(self), msg_type, topic, qos_profile, **options
        )

    @overload
    def create_subscription(
        self: Any,
        msg_type: MessageType[CustomT],
        topic: str,
        callback: Callback[CustomT],
        qos_profile: QoSProfile | int,
        *,
        raw: Literal[False] = False,
        on_conversion_error: OnConversionError | None = None,
        **options: Unpack[SubscriptionOptions],
    ) -> Subscription[CustomT]: ...

    @overload
    def create_subscription(
        self: Any,
        msg_type: type[RosMessageT],
        topic: str,
        callback: Callback[RosMessageT],
        qos_profile: QoSProfile | int,
        *,
        raw: Literal[False] = False,
        **options: Unpack[SubscriptionOptions],
    ) -> rclpy.subscription.Subscription[RosMessageT]: ...

    @overload
    def create_subscription(
        self: Any,
        msg_type: MessageType[Any] | type[RosMessage],
        topic: str,
        callback: Callback[bytes],
        qos_profile: QoSProfile | int,
        *,
        raw: Literal[True],
        **options: Unpack[SubscriptionOptions],
    ) -> rclpy.subscription.Subscription[Any]: ...

    def create_subscription(
        self: Any,
        msg_type: Any,
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile | int,
        **options: Any,
    ) -> Any:
        """Create a subscription.

        Args:
            msg_type: An adapter, a protobuf class that has one, or a ROS message class.
            topic: The name of the topic.
            callback: Is called with a message, and with its MessageInfo if it takes two arguments.
            qos_profile: The quality of service, or the depth of the history.
            raw: Whether the callback gets serialized messages as they are.
            on_conversion_error: Is called for a message that cannot be converted, with the ConversionError and the
                serialized message. Without it an error is logged, at most every five seconds. The message is dropped.
            options: As of `rclpy.node.Node.create_subscription`.

        Returns:
            A `Subscription` to protobuf messages; rclpy's own for a ROS message class or if `raw` is true.

        Raises:
            AdapterNotFoundError: The protobuf class has no adapter.
            RosNotFoundError: The ROS message class cannot be imported.
            TypeHashError: The adapter was generated for another version of the type than the installed one.
            TypeError: `on_conversion_error` is given, and nothing is to be converted.
        """
        return creation.create_subscription(
            _node_of_rclpy(self), msg_type, topic, callback, qos_profile, **options
        )

    @overload
    def create_service(
        self: Any,
        srv_type: type[ServiceAdapter[RequestT, ResponseT]] | type[RequestT],
        srv_name: str,
        callback: ServiceCallback[RequestT, ResponseT],
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Unpack[ServiceOptions],
    ) -> Service[RequestT, ResponseT]: ...

    @overload
    def create_service(
        self: Any,
        srv_type: type[RosService],
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        **options: Unpack[ServiceOptions],
    ) -> rclpy.service.Service[Any, Any]: ...

    def create_service(
        self: Any, srv_type: Any, srv_name: str, callback: Callable[..., Any], **options: Any
    ) -> Any:
        """Create a service.

        Args:
            srv_type: An adapter, the protobuf class of the request, or a ROS service class.
            srv_name: The name of the service.
            callback: Is called with a request and a response that has the default values, and returns the response.
            on_conversion_error: Is called for a request that cannot be converted, with the ConversionError and the ROS
                request. Without it an error is logged, at most every five seconds. The request is not answered.
            options: As of `rclpy.node.Node.create_service`.

        Returns:
            A `Service` with protobuf messages; rclpy's own for a ROS service class.

        Raises:
            AdapterNotFoundError: The protobuf class has no adapter.
            RosNotFoundError: The ROS service class cannot be imported.
            TypeHashError: The adapter was generated for another version of the type than the installed one.
        """
        return creation.create_service(_node_of_rclpy(self), srv_type, srv_name, callback, **options)

    @overload
    def create_client(
        self: Any,
        srv_type: type[ServiceAdapter[RequestT, ResponseT]],
        srv_name: str,
        **options: Unpack[ServiceOptions],
    ) -> Client[RequestT, ResponseT]: ...

    @overload
    def create_client(
        self: Any,
        srv_type: type[RequestT],
        srv_name: str,
        **options: Unpack[ServiceOptions],
    ) -> Client[RequestT, Any]: ...

    @overload
    def create_client(
        self: Any,
        srv_type: type[RosService],
        srv_name: str,
        **options: Unpack[ServiceOptions],
    ) -> rclpy.client.Client[Any, Any]: ...

    def create_client(self: Any, srv_type: Any, srv_name: str, **options: Any) -> Any:
        """Create a client of a service.

        Args:
            srv_type: An adapter, the protobuf class of the request, or a ROS service class.
            srv_name: The name of the service.
            options: As of `rclpy.node.Node.create_client`.

        Returns:
            A `Client` with protobuf messages; rclpy's own for a ROS service class.

        Raises:
            AdapterNotFoundError: The protobuf class has no adapter.
            RosNotFoundError: The ROS service class cannot be imported.
            TypeHashError: The adapter was generated for another version of the type than the installed one.
        """
        return creation.create_client(_node_of_rclpy(self), srv_type, srv_name, **options)


class Node(NodeMixin, rclpy.node.Node):  # type: ignore[misc]  # takes more types than the methods of rclpy
    """An `rclpy.node.Node` that takes adapters and protobuf classes wherever that takes ROS types."""


create_publisher = NodeMixin.create_publisher
create_lifecycle_publisher = NodeMixin.create_lifecycle_publisher
create_subscription = NodeMixin.create_subscription
create_service = NodeMixin.create_service
create_client = NodeMixin.create_client


def _node_of_rclpy(node: Any) -> Any:
    """Return a node whose methods take only ROS types: if it has the mixin, what is behind that."""
    return super(NodeMixin, node) if isinstance(node, NodeMixin) else node
