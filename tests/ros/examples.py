"""Messages to send: the official fixtures of `test_msgs`, and sensor data; as ROS messages and as protobuf.

The protobuf messages are made by reflection, not by the adapters that are tested.
"""

from __future__ import annotations

import importlib
from array import array
from typing import Any

SENSOR_MESSAGES = (
    *(
        "std_msgs/msg/String",
        "sensor_msgs/msg/Image",
        "sensor_msgs/msg/PointCloud2",
        "sensor_msgs/msg/LaserScan",
    ),
    *(
        "sensor_msgs/msg/Imu",
        "visualization_msgs/msg/MarkerArray",
        "trajectory_msgs/msg/MultiDOFJointTrajectory",
    ),
)
SERVICES = (
    *("std_srvs/srv/Empty", "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"),
    *("test_msgs/srv/Arrays", "test_msgs/srv/BasicTypes", "test_msgs/srv/Empty"),
)


def message_types() -> list[str]:
    """Return the types of all examples: sensor data, and all of `test_msgs`; newer versions have more of them."""
    import test_msgs.msg

    names = [name for name in dir(test_msgs.msg) if name[0].isupper()]
    return [*SENSOR_MESSAGES, *(f"test_msgs/msg/{name}" for name in names)]


def ros_class(type_name: str) -> Any:
    """Import the ROS class of a message, service or action."""
    package, namespace, name = type_name.split("/")
    return getattr(importlib.import_module(f"{package}.{namespace}"), name)


def adapter(type_name: str) -> Any:
    """Import the adapter of a message, service or action."""
    package, namespace, name = type_name.split("/")
    return getattr(importlib.import_module(f"rosidl_proto.{package}.{namespace}"), f"{name}Adapter")


def messages(type_name: str) -> list[Any]:
    """Return examples of a type, as ROS messages."""
    package, _, name = type_name.split("/")
    if package == "test_msgs":
        from test_msgs.message_fixtures import get_test_msg

        fixtures: list[Any] = get_test_msg(name)
        return fixtures
    return [ros_class(type_name)(), _filled(name, ros_class(type_name)())]


def exchanges(type_name: str) -> list[tuple[Any, Any]]:
    """Return examples of a service, as pairs of a ROS request and a ROS response."""
    package, _, name = type_name.split("/")
    if package == "test_msgs":
        from test_msgs.service_fixtures import get_test_srv

        return [(request, response) for request, response in get_test_srv(name)]
    service = ros_class(type_name)
    if name == "SetBool":
        return [
            (service.Request(data=data), service.Response(success=data, message=f"set to {data} ✓"))
            for data in (True, False)
        ]
    if name == "Trigger":
        return [(service.Request(), service.Response(success=True, message="done"))]
    return [(service.Request(), service.Response())]


def _filled(name: str, message: Any) -> Any:
    if name == "String":
        message.data = "grüße, 世界 🤖"
        return message
    if name == "MarkerArray":
        message.markers = [_marker(number) for number in range(3)]
        return message
    message.header.frame_id = "map"
    message.header.stamp.sec, message.header.stamp.nanosec = -1, 999_999_999
    fill = {
        "Image": _fill_image,
        "PointCloud2": _fill_cloud,
        "LaserScan": _fill_scan,
        "Imu": _fill_imu,
        "MultiDOFJointTrajectory": _fill_trajectory,
    }
    fill[name](message)
    return message


def _fill_image(image: Any) -> None:
    image.height, image.width, image.step, image.encoding = 48, 64, 192, "rgb8"
    image.data = bytes(number * 7 & 255 for number in range(48 * 192))


def _fill_cloud(cloud: Any) -> None:
    from sensor_msgs.msg import PointField

    cloud.fields = [
        PointField(name=name, offset=4 * number, datatype=PointField.FLOAT32, count=1)
        for number, name in enumerate("xyz")
    ]
    cloud.height, cloud.width, cloud.point_step, cloud.row_step, cloud.is_dense = 1, 100, 12, 1200, True
    cloud.data = array("f", (number / 4 for number in range(300))).tobytes()


def _fill_scan(scan: Any) -> None:
    scan.angle_min, scan.angle_max, scan.angle_increment, scan.range_max = -1.5, 1.5, 0.25, 30.0
    scan.ranges = [float("inf"), *(number / 8 for number in range(719))]
    scan.intensities = [float(number) for number in range(720)]


def _fill_imu(imu: Any) -> None:
    imu.orientation.w, imu.orientation.x = 0.5, -0.0
    imu.angular_velocity.z, imu.linear_acceleration.y = 1e-300, 9.81
    imu.orientation_covariance = [number / 3 for number in range(9)]
    imu.linear_acceleration_covariance[0] = -1.0


def _marker(number: int) -> Any:
    from geometry_msgs.msg import Point
    from std_msgs.msg import ColorRGBA
    from visualization_msgs.msg import Marker

    marker = Marker(ns="lines", id=number, type=Marker.LINE_STRIP, text="x" * number)
    marker.header.frame_id = f"frame_{number}"
    marker.lifetime.sec = -2
    marker.points = [Point(x=float(each), y=-1.5) for each in range(number)]
    marker.colors = [ColorRGBA(r=0.5, a=1.0)] * number
    marker.mesh_file.data = bytes(range(number))
    return marker


def _fill_trajectory(trajectory: Any) -> None:
    """Arrays of points with arrays of transforms: nested like tf2_msgs/msg/TFMessage, and once more."""
    from geometry_msgs.msg import Transform, Twist, Vector3
    from trajectory_msgs.msg import MultiDOFJointTrajectoryPoint

    trajectory.joint_names = ["base", "", "tool"]
    trajectory.points = [
        MultiDOFJointTrajectoryPoint(
            transforms=[Transform(translation=Vector3(x=float(joint))) for joint in range(length)],
            velocities=[Twist()] * length,
        )
        for length in (0, 3, 1)
    ]


def as_protobuf(message: Any, custom_type: Any) -> Any:
    """Return the protobuf message of a ROS message, made field by field from the descriptor and the ROS field types."""
    custom = custom_type()
    ros_types = message.get_fields_and_field_types()
    for field in custom_type.DESCRIPTOR.fields:
        if field.name not in ros_types:  # what an empty message has instead of nothing
            continue
        value, ros_type = getattr(message, field.name), ros_types[field.name]
        is_array = ros_type.startswith("sequence") or ros_type.endswith("]")
        if field.message_type is not None:
            nested = field.message_type._concrete_class
            if is_array:
                getattr(custom, field.name).extend(as_protobuf(each, nested) for each in value)
            else:
                getattr(custom, field.name).CopyFrom(as_protobuf(value, nested))
        elif is_array and field.type == field.TYPE_BYTES and "wstring" not in ros_type:
            setattr(custom, field.name, bytes(_number(each) & 255 for each in value))
        elif is_array:
            getattr(custom, field.name).extend(_single(each, ros_type) for each in value)
        else:
            setattr(custom, field.name, _single(value, ros_type))
    return custom


def exchanges_as_protobuf(exchanges: list[tuple[Any, Any]], adapter: Any) -> list[tuple[Any, Any]]:
    """Return requests and responses of a service as protobuf messages."""
    request_type, response_type = adapter.request.custom_type, adapter.response.custom_type
    return [(as_protobuf(each, request_type), as_protobuf(other, response_type)) for each, other in exchanges]


def _single(value: Any, ros_type: str) -> Any:
    if isinstance(value, str):
        return value.encode("utf-16-le") if "wstring" in ros_type else value
    return _number(value) if isinstance(value, bytes) else getattr(value, "item", lambda: value)()


def _number(value: Any) -> int:
    return value[0] if isinstance(value, bytes) else int(value)
