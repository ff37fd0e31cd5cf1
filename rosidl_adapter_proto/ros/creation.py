"""Creates what a node creates: finds the adapter, lets the node create it for the ROS type, and makes it convert.

The functions take a node whose methods know only ROS types, and return what those return if there is no adapter. What
they take besides is told where users look for it, in `node.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.ros.adapters import MESSAGE, SERVICE, resolve
from rosidl_adapter_proto.ros.entities import (
    Client,
    LifecyclePublisher,
    Publisher,
    Service,
    Subscription,
)
from rosidl_adapter_proto.ros.inbound import OnConversionError, Reception, service_callback
from rosidl_adapter_proto.ros.rclpy_internals import convert_in
from rosidl_adapter_proto.ros.type_hash import publishers_of_other_versions

if TYPE_CHECKING:
    from rclpy.node import Node


def create_publisher(node: Node, *arguments: Any, **options: Any) -> Any:
    """Create a publisher."""
    return _create_publisher(node, node.create_publisher, Publisher, *arguments, **options)


def create_lifecycle_publisher(node: Any, *arguments: Any, **options: Any) -> Any:
    """Create a publisher that sends only while its lifecycle node is active."""
    return _create_publisher(node, node.create_lifecycle_publisher, LifecyclePublisher, *arguments, **options)


def _create_publisher(
    node: Node,
    create: Callable[..., Any],
    converting_class: type[Publisher[Any]],
    msg_type: Any,
    topic: str,
    qos_profile: Any,
    **options: Any,
) -> Any:
    ros_type, adapter = resolve(MESSAGE, msg_type, node.get_logger())
    if adapter is None:
        return create(ros_type, topic, qos_profile, **options)
    to_cdr = _codec(adapter).to_cdr  # first, so that nothing is left on the node if it cannot be made
    publisher = create(ros_type, topic, qos_profile, **options)
    return convert_in(
        publisher, converting_class, adapter=adapter, _custom_type=adapter.custom_type, _to_cdr=to_cdr
    )


def _codec(adapter: Any) -> Any:
    """Return what has the methods `to_cdr` and `from_cdr`: the codec, or without one the adapter, which asks rclpy."""
    return adapter.codec or adapter


def create_subscription(
    node: Node,
    msg_type: Any,
    topic: str,
    callback: Callable[..., Any],
    qos_profile: Any,
    *,
    raw: bool = False,
    on_conversion_error: OnConversionError | None = None,
    **options: Any,
) -> Any:
    """Create a subscription."""
    ros_type, adapter = resolve(MESSAGE, msg_type, node.get_logger())
    if adapter is None or raw:
        if on_conversion_error is not None:
            raise TypeError(
                f"the subscription to {topic} converts nothing, so it takes no on_conversion_error; "
                "leave it out, or give an adapter and no `raw`"
            )
        return node.create_subscription(ros_type, topic, callback, qos_profile, raw=raw, **options)

    def explain() -> str:
        others = publishers_of_other_versions(node, topic, adapter)
        return f"; publishers with another version of the type: {', '.join(others)}" if others else ""

    from_cdr = _codec(adapter).from_cdr
    reception = Reception(node.get_logger(), f"topic {topic}", from_cdr, on_conversion_error, explain, bytes)
    subscription = node.create_subscription(
        ros_type, topic, reception.callback(callback), qos_profile, raw=True, **options
    )
    return convert_in(subscription, Subscription, adapter=adapter, _reception=reception)


def create_service(
    node: Node,
    srv_type: Any,
    srv_name: str,
    callback: Callable[[Any, Any], Any],
    *,
    on_conversion_error: OnConversionError | None = None,
    **options: Any,
) -> Any:
    """Create a service."""
    ros_type, adapter = resolve(SERVICE, srv_type, node.get_logger())
    if adapter is None:
        return node.create_service(ros_type, srv_name, callback, **options)
    convert = adapter.request.convert_to_custom
    reception = Reception(node.get_logger(), f"a client of service {srv_name}", convert, on_conversion_error)
    service = node.create_service(
        ros_type, srv_name, service_callback(adapter, callback, reception), **options
    )
    return convert_in(service, Service, adapter=adapter, _reception=reception)


def create_client(node: Node, srv_type: Any, srv_name: str, **options: Any) -> Any:
    """Create a client of a service."""
    ros_type, adapter = resolve(SERVICE, srv_type, node.get_logger())
    client: Any = node.create_client(ros_type, srv_name, **options)
    return client if adapter is None else convert_in(client, Client, adapter=adapter)
