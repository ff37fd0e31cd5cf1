"""A lifecycle node that publishes protobuf messages while it is active: python examples/ros_lifecycle.py"""

import rclpy
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rosidl_proto.std_msgs.msg import String

from rosidl_adapter_proto.ros import NodeMixin


class Talker(NodeMixin, LifecycleNode):  # type: ignore[misc]  # the mixin takes more types
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.publisher = self.create_lifecycle_publisher(String, "lifecycle_chatter", 10)
        self.create_subscription(String, "lifecycle_chatter", self.listen, 10)
        return TransitionCallbackReturn.SUCCESS

    def listen(self, message: String) -> None:
        self.get_logger().info(f"I heard: {message.data}")


def main() -> None:
    talker = Talker("lifecycle_talker")
    talker.trigger_configure()
    while talker.publisher.get_subscription_count() == 0:
        rclpy.spin_once(talker, timeout_sec=0.1)
    talker.publisher.publish(String(data="Nobody hears this"))
    talker.trigger_activate()
    talker.publisher.publish(String(data="I am active"))
    rclpy.spin_once(talker, timeout_sec=10)
    talker.trigger_deactivate()
    talker.trigger_cleanup()
    talker.destroy_node()


if __name__ == "__main__":
    rclpy.init()
    try:
        main()
    finally:
        rclpy.try_shutdown()
