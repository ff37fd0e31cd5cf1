"""Protobuf types of ROS interfaces on a machine without ROS: build, serialize, JSON.

rosidl-proto generate sensor_msgs
PYTHONPATH=generated/python python examples/without_ros.py
"""

from __future__ import annotations

import math

from google.protobuf import json_format
from rosidl_proto.sensor_msgs.msg import LaserScan, LaserScanAdapter

scan = LaserScanAdapter.new(angle_min=-math.pi / 2, angle_max=math.pi / 2, ranges=[1.0, 1.5, 2.0])
scan.header.frame_id = "laser"
scan.header.stamp.sec = 42

data = scan.SerializeToString()
print(f"{len(data)} bytes of protobuf")
assert LaserScan.FromString(data) == scan
print(json_format.MessageToJson(scan, preserving_proto_field_name=True))
print(f"{LaserScanAdapter.type_name} is {LaserScanAdapter.type_hash}")
