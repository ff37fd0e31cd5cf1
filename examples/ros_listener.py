"""Gets every std_msgs/msg/String as a protobuf message, whoever publishes it: python examples/ros_listener.py"""

import rclpy
from google.protobuf import json_format
from rclpy.executors import ExternalShutdownException
from rosidl_proto.std_msgs.msg import String

from rosidl_adapter_proto.ros import Node


class Listener(Node):
    def __init__(self) -> None:
        super().__init__("listener")
        self.create_subscription(String, "chatter", self.listen, 10)

    def listen(self, message: String) -> None:
        self.get_logger().info(f"I heard: {json_format.MessageToJson(message, indent=None)}")


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
