"""Publishes protobuf messages of types that were built in this workspace."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rosidl_proto.rosgraph_msgs.msg import Clock
from rosidl_proto.scene_msgs.msg import Scene, SceneAdapter
from rosidl_proto.track_msgs.msg import TrackAdapter

from rosidl_adapter_proto.ros import Node


class Talker(Node):
    def __init__(self) -> None:
        super().__init__("talker")
        self.publisher = self.create_publisher(SceneAdapter, "scene", 10)
        self.timer = self.create_timer(0.1, self.publish)
        self.count = 0

    def publish(self) -> None:
        self.count += 1
        track = TrackAdapter.new(id=self.count, label="robot", scores=[0.5, 0.25])
        track.header.stamp.CopyFrom(self.now().clock)
        self.publisher.publish(Scene(tracks=[track]))

    def now(self) -> Clock:
        seconds, nanoseconds = self.get_clock().now().seconds_nanoseconds()
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = seconds, nanoseconds
        return clock


def main() -> None:
    rclpy.init()
    try:
        rclpy.spin(Talker())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
