"""What type checkers must accept, and what they must find out by themselves."""

from __future__ import annotations

from typing import Any

import rclpy.node
import rclpy.publisher
import rclpy.subscription
from rclpy.subscription import MessageInfo
from rosidl_proto.std_msgs.msg import String, StringAdapter
from rosidl_proto.std_srvs.srv import SetBool_Request, SetBool_Response, SetBoolAdapter
from rosidl_proto.test_msgs.action import (
    Fibonacci_Feedback,
    Fibonacci_Goal,
    Fibonacci_Result,
    FibonacciAdapter,
)
from typing_extensions import assert_type

from rosidl_adapter_proto.errors import ConversionError
from rosidl_adapter_proto.ros import (
    ActionClient,
    ActionServer,
    Client,
    Node,
    Publisher,
    ServerGoalHandle,
    Service,
    Subscription,
    create_publisher,
    create_subscription,
)


class Native:
    """Stands for a ROS message class, which type checkers know nothing of."""


class Talker(Node):
    def __init__(self) -> None:
        super().__init__("talker")
        self.publisher = self.create_publisher(StringAdapter, "chatter", 10)
        self.by_class = self.create_publisher(String, "chatter", 10)
        self.subscription = self.create_subscription(StringAdapter, "chatter", self.on_message, 10)
        self.create_subscription(String, "chatter", self.on_message_with_info, qos_profile=10)
        self.create_subscription(StringAdapter, "chatter", self.on_message_later, 10)
        self.create_subscription(StringAdapter, "chatter", self.on_bytes, 10, raw=True)
        self.create_subscription(
            StringAdapter, "chatter", self.on_message, 10, on_conversion_error=self.on_conversion_error
        )
        self.native = self.create_publisher(Native, "native", 10)
        self.service = self.create_service(SetBoolAdapter, "set", self.on_request)
        self.client = self.create_client(SetBoolAdapter, "set")
        self.create_service(SetBool_Request, "set", self.on_request)
        self.server = ActionServer(self, FibonacciAdapter, "fibonacci", self.execute)
        self.action_client = ActionClient(self, FibonacciAdapter, "fibonacci")
        self.by_goal: ActionClient[Any, Any, Any] = ActionClient(self, Fibonacci_Goal, "fibonacci")

    def on_message(self, message: String) -> None:
        self.publisher.publish(message)

    async def on_message_later(self, message: String) -> None:
        self.by_class.publish(String(data=message.data))

    def on_message_with_info(self, message: String, info: MessageInfo) -> None:
        assert_type(info["source_timestamp"], int)

    def on_bytes(self, data: bytes) -> None:
        self.publisher.publish(data)

    def on_conversion_error(self, error: ConversionError, received: Any) -> None:
        self.get_logger().error(error.reason)

    def on_request(self, request: SetBool_Request, response: SetBool_Response) -> SetBool_Response:
        response.success = request.data
        return response

    def execute(
        self, goal_handle: ServerGoalHandle[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback]
    ) -> Fibonacci_Result:
        goal_handle.publish_feedback(Fibonacci_Feedback(sequence=[goal_handle.request.order]))
        return Fibonacci_Result(sequence=[1])


def check(talker: Talker, node: rclpy.node.Node) -> None:
    assert_type(talker.publisher, Publisher[String])
    assert_type(talker.by_class, Publisher[String])
    assert_type(talker.subscription, Subscription[String])
    assert_type(talker.native, rclpy.publisher.Publisher[Native])
    assert_type(talker.service, Service[SetBool_Request, SetBool_Response])
    assert_type(talker.client, Client[SetBool_Request, SetBool_Response])
    assert_type(talker.client.call(SetBool_Request(data=True)), SetBool_Response | None)
    assert_type(talker.client.call_async(SetBool_Request()).result(), SetBool_Response | None)
    assert_type(talker.server, ActionServer[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback])
    assert_type(talker.action_client, ActionClient[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback])
    goal = talker.action_client.send_goal_async(Fibonacci_Goal(order=3)).result()
    assert goal is not None
    response = goal.get_result_async().result()
    assert response is not None
    assert_type(response.result, Fibonacci_Result)
    assert_type(create_publisher(node, String, "chatter", 10), Publisher[String])
    create_subscription(node, StringAdapter, "chatter", print, 10)
    annotated: rclpy.publisher.Publisher[Any] = talker.publisher
    annotated.publish(String())
