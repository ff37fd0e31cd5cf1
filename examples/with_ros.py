"""Converts between protobuf and ROS messages, in a ROS 2 environment.

rosidl-proto generate sensor_msgs
PYTHONPATH=generated/python python examples/with_ros.py
"""

from __future__ import annotations

from rosidl_proto.sensor_msgs.msg import Imu, ImuAdapter
from sensor_msgs.msg import Imu as RosImu

from rosidl_adapter_proto import ConversionError

imu = Imu(orientation_covariance=[0.1] * 9)
imu.header.frame_id = "imu"
imu.linear_acceleration.z = 9.81

message = ImuAdapter.convert_to_ros_message(imu)
assert isinstance(message, RosImu)
print(f"ROS: {message.header.frame_id}, z = {message.linear_acceleration.z}")

again = ImuAdapter.convert_to_custom(message)
print(f"protobuf: {again.header.frame_id}, z = {again.linear_acceleration.z}")

imu.orientation_covariance.append(0.1)  # ten of nine
try:
    ImuAdapter.convert_to_ros_message(imu)
except ConversionError as error:
    print(f"refused: {error}")
