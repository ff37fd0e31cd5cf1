"""Protobuf messages in rclpy nodes: topics, services and actions.

`Node` takes the place of `rclpy.node.Node`. Where it cannot, `NodeMixin` goes in front of another node class, and
`create_publisher(node, ...)` and the like work with every node.
"""

from __future__ import annotations

try:
    import rclpy  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"rosidl_adapter_proto.ros needs rclpy ({error}); source a ROS 2 installation, "
        "or install it with pip install 'ros-rclpy[fastrtps]'",
        name=error.name,
    ) from error

from rosidl_adapter_proto.ros.action import (
    ActionClient,
    ActionServer,
    ClientGoalHandle,
    ServerGoalHandle,
)
from rosidl_adapter_proto.ros.adapters import AdapterNotFoundError
from rosidl_adapter_proto.ros.entities import (
    Client,
    LifecyclePublisher,
    Publisher,
    Service,
    Subscription,
)
from rosidl_adapter_proto.ros.node import (
    Node,
    NodeMixin,
    create_client,
    create_lifecycle_publisher,
    create_publisher,
    create_service,
    create_subscription,
)
from rosidl_adapter_proto.ros.rclpy_internals import accept_protobuf_stamps
from rosidl_adapter_proto.ros.time import to_rclpy_duration, to_rclpy_time
from rosidl_adapter_proto.ros.type_hash import TypeHashError
from rosidl_adapter_proto.time import set_stamp, to_datetime, to_message, to_nanoseconds, to_timedelta

__all__ = (
    "ActionClient",
    "ActionServer",
    "AdapterNotFoundError",
    "Client",
    "ClientGoalHandle",
    "LifecyclePublisher",
    "Node",
    "NodeMixin",
    "Publisher",
    "ServerGoalHandle",
    "Service",
    "Subscription",
    "TypeHashError",
    "create_client",
    "create_lifecycle_publisher",
    "create_publisher",
    "create_service",
    "create_subscription",
    "set_stamp",
    "to_datetime",
    "to_message",
    "to_nanoseconds",
    "to_rclpy_duration",
    "to_rclpy_time",
    "to_timedelta",
)

accept_protobuf_stamps()
