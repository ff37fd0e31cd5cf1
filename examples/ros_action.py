"""Serves test_msgs/action/Fibonacci with protobuf messages, and sends it a goal: python examples/ros_action.py"""

import time

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rosidl_proto.test_msgs.action import Fibonacci, Fibonacci_FeedbackMessage

from rosidl_adapter_proto.ros import ActionClient, ActionServer, Node, ServerGoalHandle

GoalHandle = ServerGoalHandle[Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback]


class Sequences(Node):
    def __init__(self) -> None:
        super().__init__("sequences")
        self.server = ActionServer(self, Fibonacci, "fibonacci", self.execute)
        self.client = ActionClient(self, Fibonacci, "fibonacci")

    def execute(self, goal_handle: GoalHandle) -> Fibonacci.Result:
        sequence = [0, 1]
        while len(sequence) <= goal_handle.request.order:
            sequence.append(sequence[-1] + sequence[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
            time.sleep(0.1)
        goal_handle.succeed()
        return Fibonacci.Result(sequence=sequence)

    def on_feedback(self, message: Fibonacci_FeedbackMessage) -> None:
        self.get_logger().info(f"Feedback: {list(message.feedback.sequence)}")


def main() -> None:
    node, executor = Sequences(), MultiThreadedExecutor()
    executor.add_node(node)
    if not node.client.wait_for_server(timeout_sec=10):
        raise SystemExit("There is no server")
    goal_future = node.client.send_goal_async(Fibonacci.Goal(order=10), node.on_feedback)
    executor.spin_until_future_complete(goal_future, timeout_sec=10)
    goal_handle = goal_future.result()
    if goal_handle is None or not goal_handle.accepted:
        raise SystemExit("The goal was not accepted")
    result_future = goal_handle.get_result_async()
    executor.spin_until_future_complete(result_future, timeout_sec=10)
    response = result_future.result()
    if response is None:
        raise SystemExit("There was no result")
    node.get_logger().info(f"Result: {list(response.result.sequence)}")
    executor.shutdown()
    node.client.destroy()
    node.server.destroy()
    node.destroy_node()


if __name__ == "__main__":
    rclpy.init()
    try:
        main()
    finally:
        rclpy.try_shutdown()
