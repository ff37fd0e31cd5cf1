"""The other process of the tests: publishes, subscribes, serves and calls as it is told on its standard input."""

from __future__ import annotations

import json
import queue
import sys
import threading
import traceback
from collections.abc import Callable
from typing import Any

import rclpy
import rclpy.action
import rclpy.node
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile

import rosidl_adapter_proto.ros
from tests.ros import examples
from tests.ros.support import SECONDS, Spinning, wait_until

QOS = QoSProfile(depth=20_000)


class Other:
    """A node that is native or ours, and the commands it knows."""

    def __init__(self) -> None:
        self.node: Any = rosidl_adapter_proto.ros.Node("peer")
        self.listener: Any = rosidl_adapter_proto.ros.Node("listening_peer")
        self.received: dict[str, queue.Queue[Any]] = {}
        self.kind = ""
        self.steps = threading.Semaphore(0)
        self.action_server: Any = None

    def type(self, kind: str, type_name: str) -> Any:
        return examples.adapter(type_name) if kind == "protobuf" else examples.ros_class(type_name)

    def listen(self, kind: str, topics: dict[str, str]) -> None:
        """Subscribe; what arrives is kept."""
        self.kind = kind
        for topic, type_name in topics.items():
            self.received[topic] = queue.Queue()
            callback = self.received[topic].put
            self.listener.create_subscription(self.type(kind, type_name), topic, callback, QOS)

    def heard(self, topics: dict[str, str]) -> dict[str, str]:
        """Compare all that arrived with the examples, and return the differences; then stop listening."""
        differences = {}
        for topic, type_name in topics.items():
            expected = examples.messages(type_name)
            if self.kind == "protobuf":
                custom_type = examples.adapter(type_name).custom_type
                expected = [examples.as_protobuf(message, custom_type) for message in expected]
            arrived = [self.received[topic].get(timeout=SECONDS) for _ in expected]
            # DDS keeps the order for each key, and some types of test_msgs have keys.
            for message in arrived:
                if message in expected:
                    expected.remove(message)
            if expected:
                differences[topic] = f"{expected} did not come, but {arrived} did"
        self.stop_listening()
        return differences

    def count(self, topic: str, expected: int) -> list[int]:
        """Return the numbers or lengths of what arrived, when there is as much as expected."""
        arrived = [self.received[topic].get(timeout=SECONDS) for _ in range(expected)]
        self.stop_listening()
        return [int(each.data) if isinstance(each.data, str) else len(each.data) for each in arrived]

    def stop_listening(self) -> None:
        for subscription in list(self.listener.subscriptions):
            self.listener.destroy_subscription(subscription)

    def serve(self, kind: str, services: dict[str, str]) -> None:
        """Answer requests as the examples do."""
        for name, type_name in services.items():
            self.node.create_service(self.type(kind, type_name), name, self.answering(kind, type_name))

    def answering(self, kind: str, type_name: str) -> Callable[[Any, Any], Any]:
        answers = examples.exchanges(type_name)
        if kind == "protobuf":
            answers = examples.exchanges_as_protobuf(answers, examples.adapter(type_name))

        def answer(request: Any, response: Any) -> Any:
            return next(response for expected, response in answers if expected == request)

        return answer

    def act(self, kind: str, name: str) -> None:
        """Serve Fibonacci; a goal starts and ends when we are told to proceed.

        Until it starts, it sends the same feedback.
        """
        ours = kind == "protobuf"
        server = (rosidl_adapter_proto.ros if ours else rclpy.action).ActionServer
        fibonacci: Any = examples.ros_class("test_msgs/action/Fibonacci")
        if ours:
            from rosidl_proto.test_msgs import action as fibonacci_types

            feedback, result = fibonacci_types.Fibonacci_Feedback, fibonacci_types.Fibonacci_Result
        else:
            feedback, result = fibonacci.Feedback, fibonacci.Result

        def execute(goal_handle: Any) -> Any:
            # Feedback is lost until the middleware has connected its two ends, which nobody is told of.
            wait_until(
                lambda: goal_handle.publish_feedback(feedback(sequence=[0]))
                or self.steps.acquire(blocking=False)
            )
            sequence = [0, 1]
            for _ in range(goal_handle.request.order - 1):
                sequence.append(sequence[-1] + sequence[-2])
                goal_handle.publish_feedback(feedback(sequence=sequence))
            if goal_handle.request.order == 0:
                wait_until(lambda: goal_handle.is_cancel_requested, "a cancel request")
                goal_handle.canceled()
            else:
                # rclpy forgets about feedback when the result is there.
                assert self.steps.acquire(timeout=SECONDS)
                goal_handle.succeed()
            return result(sequence=sequence)

        self.action_server = server(
            self.node,
            self.type(kind, "test_msgs/action/Fibonacci"),
            name,
            execute,
            goal_callback=lambda goal: rclpy.action.server.GoalResponse(2 if goal.order >= 0 else 1),
            cancel_callback=lambda goal_handle: rclpy.action.server.CancelResponse.ACCEPT,
            callback_group=rclpy.callback_groups.ReentrantCallbackGroup(),
        )

    def proceed(self) -> None:
        self.steps.release()

    def stop_acting(self) -> None:
        self.action_server.destroy()

    def stop_serving(self, services: dict[str, str]) -> None:
        for service in list(self.node.services):
            if service.srv_name in services:
                self.node.destroy_service(service)


def main() -> None:
    rclpy.init(args=[])
    other = Other()
    spinning = [Spinning(other.node), Spinning(other.listener, SingleThreadedExecutor())]
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = {"answer": getattr(other, request["command"])(**request["arguments"])}
        except Exception:
            answer = {"error": traceback.format_exc()}
        print(json.dumps(answer), flush=True)
    for each in spinning:
        each.stop()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
