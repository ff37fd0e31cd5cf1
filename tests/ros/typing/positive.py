"""What type checkers must accept, and what they must find out by themselves."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from typing import Any

import rclpy.client
import rclpy.duration
import rclpy.lifecycle
import rclpy.node
import rclpy.publisher
import rclpy.service
import rclpy.subscription
import rclpy.time
import std_msgs.msg  # type: ignore[import-untyped]
import std_srvs.srv  # type: ignore[import-untyped]
import test_msgs.action  # type: ignore[import-untyped]
from google.protobuf.timestamp_pb2 import Timestamp
from rclpy.action.server import CancelResponse, GoalResponse
from rclpy.subscription import MessageInfo
from rosidl_proto.builtin_interfaces.msg import Duration, Time
from rosidl_proto.std_msgs.msg import Header, HeaderAdapter, String, StringAdapter
from rosidl_proto.std_srvs.srv import SetBool, SetBool_Request, SetBool_Response, SetBoolAdapter
from rosidl_proto.test_msgs.action import (
    Fibonacci,
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
    LifecyclePublisher,
    Node,
    NodeMixin,
    Publisher,
    ServerGoalHandle,
    Service,
    Subscription,
    create_client,
    create_lifecycle_publisher,
    create_publisher,
    create_service,
    create_subscription,
    set_stamp,
    to_datetime,
    to_message,
    to_nanoseconds,
    to_rclpy_duration,
    to_rclpy_time,
    to_timedelta,
)


class Native:
    """Stands for a ROS message class: this is how type checkers know one, where they know it at all."""

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {}


class NativeService:
    """Stands for a ROS service class."""

    Request = Native
    Response = Native


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
        self.service_by_request = self.create_service(SetBool_Request, "set", self.on_request)
        self.create_service(SetBoolAdapter, "set", self.on_request_later)
        self.create_service(SetBool_Request, "set", lambda request, response: response)
        self.create_service(SetBoolAdapter, "set", lambda request, response: response)
        self.client_by_request = self.create_client(SetBool_Request, "set")
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

    async def on_request_later(
        self, request: SetBool_Request, response: SetBool_Response
    ) -> SetBool_Response:
        return response

    async def execute_later(
        self, goal_handle: ServerGoalHandle[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback]
    ) -> Fibonacci_Result:
        return Fibonacci_Result()

    def on_goal(self, goal: Fibonacci_Goal) -> GoalResponse:
        return GoalResponse.ACCEPT if goal.order < 10 else GoalResponse.REJECT

    def on_accepted(
        self, goal_handle: ServerGoalHandle[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback]
    ) -> None:
        goal_handle.execute()

    async def on_cancel(
        self, goal_handle: ServerGoalHandle[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback]
    ) -> CancelResponse:
        return CancelResponse.ACCEPT

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


def check_what_a_request_or_a_goal_tells(talker: Talker) -> None:
    """What they do not tell comes from the callback, or is not known."""
    assert_type(talker.service_by_request, Service[SetBool_Request, SetBool_Response])
    assert_type(talker.client_by_request, Client[SetBool_Request, Any])
    known: Client[SetBool_Request, SetBool_Response] = talker.create_client(SetBool_Request, "set")
    assert_type(known.call(SetBool_Request()), SetBool_Response | None)
    server = ActionServer(talker, Fibonacci_Goal, "fibonacci", talker.execute)
    assert_type(server, ActionServer[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback])
    ActionServer(
        talker,
        FibonacciAdapter,
        "fibonacci",
        talker.execute_later,
        goal_callback=talker.on_goal,
        handle_accepted_callback=talker.on_accepted,
        cancel_callback=talker.on_cancel,
        result_timeout=20,
    )
    client = ActionClient(talker, Fibonacci_Goal, "fibonacci")
    assert_type(client, ActionClient[Fibonacci_Goal, Any, Any])


def check_ros_types(talker: Talker) -> None:
    """What rosidl generates is known as such, and may be sent too."""
    talker.publisher.publish(std_msgs.msg.String())
    talker.client.call_async(std_srvs.srv.SetBool.Request())
    talker.action_client.send_goal_async(test_msgs.action.Fibonacci.Goal())
    publisher: rclpy.publisher.Publisher[Any] = talker.create_publisher(std_msgs.msg.String, "native", 10)
    publisher.publish(std_msgs.msg.String())
    talker.create_subscription(std_msgs.msg.String, "native", print, 10)
    talker.create_subscription(std_msgs.msg.String, "native", talker.on_bytes, 10, raw=True)
    service: rclpy.service.Service[Any, Any] = talker.create_service(std_srvs.srv.SetBool, "native", max)
    client: rclpy.client.Client[Any, Any] = talker.create_client(std_srvs.srv.SetBool, "native")
    ActionServer(talker, test_msgs.action.Fibonacci, "native", print)
    ActionClient(talker, test_msgs.action.Fibonacci, "native")
    print(service, client)
    talker.create_service(NativeService, "native", print)
    talker.create_client(NativeService, "native").call_async(Native())


def check_names_of_services_and_actions(talker: Talker) -> None:
    """They stand for their adapters, and have the protobuf classes under the names of ROS."""

    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = request.data
        return response

    def execute(
        goal_handle: ServerGoalHandle[Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback],
    ) -> Fibonacci.Result:
        goal_handle.publish_feedback(Fibonacci.Feedback(sequence=[1]))
        return Fibonacci.Result()

    assert_type(talker.create_service(SetBool, "set", answer), Service[SetBool_Request, SetBool_Response])
    client = talker.create_client(SetBool, "set")
    assert_type(client, Client[SetBool_Request, SetBool_Response])
    assert_type(client.call(SetBool.Request(data=True)), SetBool_Response | None)
    server = ActionServer(talker, Fibonacci, "fibonacci", execute)
    assert_type(server, ActionServer[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback])
    ActionClient(talker, Fibonacci, "fibonacci").send_goal_async(Fibonacci.Goal(order=1))


def check_times(talker: Talker) -> None:
    now = talker.get_clock().now()
    header = HeaderAdapter.new(frame_id="map", stamp=to_message(now, Time))
    assert_type(header, Header)
    times = (now, now.to_msg(), header.stamp, Timestamp(), datetime.now(timezone.utc), 5)
    for time in times:
        set_stamp(header, time)
    assert_type(to_message(now, Timestamp), Timestamp)
    assert_type(to_message(header.stamp, Time), Time)
    assert_type(to_datetime(header.stamp), datetime)
    assert_type(to_rclpy_time(header.stamp), rclpy.time.Time)
    assert_type(now - to_rclpy_time(header.stamp, now.clock_type), rclpy.duration.Duration)
    assert_type(to_timedelta(Duration(sec=1)), timedelta)
    assert_type(to_rclpy_duration(timedelta(seconds=1)), rclpy.duration.Duration)
    assert_type(to_message(now - now, Duration), Duration)
    assert_type(to_nanoseconds(now) + to_nanoseconds(now - now), int)


def check_functions(node: rclpy.node.Node, mixed: NodeMixin) -> None:
    assert_type(create_lifecycle_publisher(node, StringAdapter, "chatter", 10), LifecyclePublisher[String])
    assert_type(mixed.create_lifecycle_publisher(String, "chatter", 10), LifecyclePublisher[String])
    assert_type(
        mixed.create_lifecycle_publisher(Native, "native", 10), rclpy.lifecycle.LifecyclePublisher[Native]
    )
    assert_type(create_client(node, SetBoolAdapter, "set"), Client[SetBool_Request, SetBool_Response])
    create_service(node, SetBoolAdapter, "set", lambda request, response: response)
