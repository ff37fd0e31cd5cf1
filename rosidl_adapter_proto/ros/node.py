"""Nodes that create publishers, subscriptions, services and clients for protobuf messages, and functions that do.

Each takes an adapter, a protobuf class or a ROS type. For a ROS type it does what a node of rclpy does.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, TypedDict, TypeVar, cast, overload

import rclpy.lifecycle
import rclpy.node
import rclpy.publisher

from rosidl_adapter_proto.adapter import (
    CustomT,
    RequestT,
    ResponseT,
    ServiceAdapter,
    TypeAdapter,
)
from rosidl_adapter_proto.ros.adapters import find_adapter
from rosidl_adapter_proto.ros.conversion import (
    OnConversionError,
    Reception,
    combined,
    convert_in,
    deserialize,
)
from rosidl_adapter_proto.ros.entities import (
    Client,
    LifecyclePublisher,
    Publisher,
    Service,
    Subscription,
    service_callback,
)
from rosidl_adapter_proto.ros.type_hash import check_type_hash, publishers_of_other_versions

if TYPE_CHECKING:
    import rclpy.client
    import rclpy.service
    import rclpy.subscription
    from google.protobuf.message import Message
    from rclpy.callback_groups import CallbackGroup
    from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
    from rclpy.qos import QoSProfile
    from rclpy.qos_overriding_options import QoSOverridingOptions
    from rclpy.subscription import MessageInfo
    from rclpy.subscription_content_filter_options import ContentFilterOptions
    from rclpy.type_support import MsgT
    from typing_extensions import Unpack

    MessageT = TypeVar("MessageT", bound=Message)

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


ServiceCallback = Callable[[RequestT, ResponseT], Any]
"""Returns the response, or is a coroutine function that does."""


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
        msg_type: type[TypeAdapter[CustomT, Any]],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[PublisherOptions],
    ) -> Publisher[CustomT]: ...

    @overload
    def create_publisher(
        self: Any,
        msg_type: type[MessageT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[PublisherOptions],
    ) -> Publisher[MessageT]: ...

    @overload
    def create_publisher(
        self: Any,
        msg_type: type[MsgT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[PublisherOptions],
    ) -> rclpy.publisher.Publisher[MsgT]: ...

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
        create = _method_of_base(self, "create_publisher")
        adapter = find_adapter(TypeAdapter, msg_type)
        if adapter is None:
            return create(msg_type, topic, qos_profile, **options)
        check_type_hash(adapter, adapter.ros_message_type, self.get_logger())
        rclpy_class = options.pop("publisher_class", rclpy.publisher.Publisher)
        options["publisher_class"] = combined(Publisher, rclpy_class)
        publisher = create(adapter.ros_message_type, topic, qos_profile, **options)
        publisher.adapter = adapter
        return publisher

    @overload
    def create_lifecycle_publisher(
        self: Any,
        msg_type: type[TypeAdapter[CustomT, Any]],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[LifecyclePublisherOptions],
    ) -> LifecyclePublisher[CustomT]: ...

    @overload
    def create_lifecycle_publisher(
        self: Any,
        msg_type: type[MessageT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[LifecyclePublisherOptions],
    ) -> LifecyclePublisher[MessageT]: ...

    @overload
    def create_lifecycle_publisher(
        self: Any,
        msg_type: type[MsgT],
        topic: str,
        qos_profile: QoSProfile | int,
        **options: Unpack[LifecyclePublisherOptions],
    ) -> rclpy.lifecycle.LifecyclePublisher[MsgT]: ...

    def create_lifecycle_publisher(
        self: Any, msg_type: Any, topic: str, qos_profile: QoSProfile | int, **options: Any
    ) -> Any:
        """Create a publisher that sends only while its lifecycle node is active; else as `create_publisher`."""
        create = _method_of_base(self, "create_lifecycle_publisher")
        adapter = find_adapter(TypeAdapter, msg_type)
        if adapter is None:
            return create(msg_type, topic, qos_profile, **options)
        check_type_hash(adapter, adapter.ros_message_type, self.get_logger())
        publisher = create(adapter.ros_message_type, topic, qos_profile, **options)
        convert_in(publisher, LifecyclePublisher, adapter=adapter)
        return publisher

    @overload
    def create_subscription(
        self: Any,
        msg_type: type[TypeAdapter[CustomT, Any]],
        topic: str,
        callback: Callable[[CustomT], object] | Callable[[CustomT, MessageInfo], object],
        qos_profile: QoSProfile | int,
        *,
        raw: Literal[False] = False,
        on_conversion_error: OnConversionError | None = None,
        **options: Unpack[SubscriptionOptions],
    ) -> Subscription[CustomT]: ...

    @overload
    def create_subscription(
        self: Any,
        msg_type: type[MessageT],
        topic: str,
        callback: Callable[[MessageT], object] | Callable[[MessageT, MessageInfo], object],
        qos_profile: QoSProfile | int,
        *,
        raw: Literal[False] = False,
        on_conversion_error: OnConversionError | None = None,
        **options: Unpack[SubscriptionOptions],
    ) -> Subscription[MessageT]: ...

    @overload
    def create_subscription(
        self: Any,
        msg_type: type[MsgT],
        topic: str,
        callback: Callable[[MsgT], object] | Callable[[MsgT, MessageInfo], object],
        qos_profile: QoSProfile | int,
        *,
        raw: Literal[False] = False,
        **options: Unpack[SubscriptionOptions],
    ) -> rclpy.subscription.Subscription[MsgT]: ...

    @overload
    def create_subscription(
        self: Any,
        msg_type: type[Any],
        topic: str,
        callback: Callable[[bytes], object] | Callable[[bytes, MessageInfo], object],
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
        *,
        raw: bool = False,
        on_conversion_error: OnConversionError | None = None,
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
        node = cast(rclpy.node.Node, self)
        create = _method_of_base(node, "create_subscription")
        adapter = find_adapter(TypeAdapter, msg_type)
        if on_conversion_error is not None and (adapter is None or raw):
            raise TypeError(
                f"the subscription to {topic} converts nothing, so it takes no on_conversion_error; "
                "leave it out, or give an adapter and no `raw`"
            )
        if adapter is None:
            return create(msg_type, topic, callback, qos_profile, raw=raw, **options)
        ros_type = adapter.ros_message_type
        check_type_hash(adapter, ros_type, node.get_logger())
        if raw:
            return create(ros_type, topic, callback, qos_profile, raw=True, **options)

        def explain() -> str:
            others = publishers_of_other_versions(node, topic, adapter.type_hash)
            return f"; publishers with another version of the type: {', '.join(others)}" if others else ""

        reception: Reception[Any] = Reception(
            node, f"topic {topic}", partial(deserialize, adapter), on_conversion_error, explain, bytes
        )
        subscription = create(ros_type, topic, reception.callback(callback), qos_profile, raw=True, **options)
        convert_in(subscription, Subscription, adapter=adapter, _reception=reception)
        return subscription

    @overload
    def create_service(
        self: Any,
        srv_type: type[ServiceAdapter[RequestT, ResponseT]],
        srv_name: str,
        callback: ServiceCallback[RequestT, ResponseT],
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Unpack[ServiceOptions],
    ) -> Service[RequestT, ResponseT]: ...

    @overload
    def create_service(
        self: Any,
        srv_type: type[MessageT],
        srv_name: str,
        callback: ServiceCallback[MessageT, Any],
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Unpack[ServiceOptions],
    ) -> Service[MessageT, Any]: ...

    @overload
    def create_service(
        self: Any,
        srv_type: type[Any],
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        **options: Unpack[ServiceOptions],
    ) -> rclpy.service.Service[Any, Any]: ...

    def create_service(
        self: Any,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        on_conversion_error: OnConversionError | None = None,
        **options: Any,
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
        create = _method_of_base(self, "create_service")
        adapter = find_adapter(ServiceAdapter, srv_type)
        if adapter is None:
            return create(srv_type, srv_name, callback, **options)
        check_type_hash(adapter, adapter.ros_service_type, self.get_logger())
        reception: Reception[Any] = Reception(
            self, f"a client of service {srv_name}", adapter.request.convert_to_custom, on_conversion_error
        )
        service = create(
            adapter.ros_service_type, srv_name, service_callback(adapter, callback, reception), **options
        )
        convert_in(service, Service, adapter=adapter, _reception=reception)
        return service

    @overload
    def create_client(
        self: Any,
        srv_type: type[ServiceAdapter[RequestT, ResponseT]],
        srv_name: str,
        **options: Unpack[ServiceOptions],
    ) -> Client[RequestT, ResponseT]: ...

    @overload
    def create_client(
        self: Any, srv_type: type[MessageT], srv_name: str, **options: Unpack[ServiceOptions]
    ) -> Client[MessageT, Any]: ...

    @overload
    def create_client(
        self: Any, srv_type: type[Any], srv_name: str, **options: Unpack[ServiceOptions]
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
        create = _method_of_base(self, "create_client")
        adapter = find_adapter(ServiceAdapter, srv_type)
        if adapter is None:
            return create(srv_type, srv_name, **options)
        check_type_hash(adapter, adapter.ros_service_type, self.get_logger())
        client = create(adapter.ros_service_type, srv_name, **options)
        convert_in(client, Client, adapter=adapter)
        return client


class Node(NodeMixin, rclpy.node.Node):  # type: ignore[misc]  # takes more types than the methods of rclpy
    """An `rclpy.node.Node` that takes adapters and protobuf classes wherever that takes ROS types."""


create_publisher = NodeMixin.create_publisher
create_lifecycle_publisher = NodeMixin.create_lifecycle_publisher
create_subscription = NodeMixin.create_subscription
create_service = NodeMixin.create_service
create_client = NodeMixin.create_client


def _method_of_base(node: Any, name: str) -> Callable[..., Any]:
    """Return the method of a node that knows only ROS types: if it has the mixin, that of the class behind it."""
    method: Callable[..., Any] = getattr(
        super(NodeMixin, node) if isinstance(node, NodeMixin) else node, name
    )
    return method
