"""Receives the same messages as any node does, without protobuf."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from scene_msgs.msg import Scene


class Listener(Node):
    def __init__(self) -> None:
        super().__init__("listener")
        self.subscription = self.create_subscription(Scene, "scene", self.receive, 10)

    def receive(self, scene: Scene) -> None:
        for track in scene.tracks:
            self.get_logger().info(f"{track.label} {track.id} with scores {list(track.scores)}")


def main() -> None:
    rclpy.init()
    try:
        rclpy.spin(Listener())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
