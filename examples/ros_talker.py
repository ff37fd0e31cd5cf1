"""Publishes a protobuf message twice a second, as std_msgs/msg/String: python examples/ros_talker.py"""

import rclpy
from rclpy.executors import ExternalShutdownException
from rosidl_proto.std_msgs.msg import String

from rosidl_adapter_proto.ros import Node


class Talker(Node):
    def __init__(self) -> None:
        super().__init__("talker")
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.count = 0
        self.create_timer(0.5, self.talk)

    def talk(self) -> None:
        self.count += 1
        message = String(data=f"Hello World: {self.count}")
        self.get_logger().info(f"Publishing: {message.data}")
        self.publisher.publish(message)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(Talker())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
