"""What type checkers must refuse: every line that ends with the word error, and no other."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from typing import Any

from rclpy.action.server import CancelResponse, GoalResponse
from rosidl_proto.builtin_interfaces.msg import Duration, Time
from rosidl_proto.std_msgs.msg import Header, HeaderAdapter, Int8, String, StringAdapter
from rosidl_proto.std_srvs.srv import (
    SetBool,
    SetBool_Request,
    SetBool_Response,
    SetBoolAdapter,
    Trigger,
    Trigger_Request,
    Trigger_Response,
    TriggerAdapter,
)
from rosidl_proto.test_msgs.action import (
    Fibonacci,
    Fibonacci_Feedback,
    Fibonacci_Goal,
    Fibonacci_Result,
    FibonacciAdapter,
    NestedMessage,
    NestedMessage_Feedback,
    NestedMessage_Goal,
    NestedMessage_Result,
)

from rosidl_adapter_proto.ros import (
    ActionClient,
    ActionServer,
    Node,
    NodeMixin,
    ServerGoalHandle,
    create_client,
    create_publisher,
    create_service,
    create_subscription,
    set_stamp,
    to_datetime,
    to_message,
    to_rclpy_duration,
    to_rclpy_time,
    to_timedelta,
)


class Native:
    """Stands for a ROS message class."""

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {}


def on_string(message: String) -> None:
    message.dat = "a field that does not exist"  # error


def on_int8(message: Int8) -> None:
    pass


def on_request(request: SetBool_Request, response: SetBool_Response) -> SetBool_Response:
    return response


def on_requests(request: SetBool_Request) -> SetBool_Response:
    return SetBool_Response()


def on_trigger(request: Trigger_Request, response: Trigger_Response) -> Trigger_Response:
    return response


async def on_trigger_later(request: Trigger_Request, response: Trigger_Response) -> Trigger_Response:
    return response


def on_half(request: SetBool_Request, response: Trigger_Response) -> Trigger_Response:
    return response


def answer_with_trigger(request: SetBool_Request, response: SetBool_Response) -> Trigger_Response:
    return Trigger_Response()


async def answer_with_trigger_later(request: SetBool_Request, response: SetBool_Response) -> Trigger_Response:
    return Trigger_Response()


def answer_nothing(request: SetBool_Request, response: SetBool_Response) -> None:
    pass


NestedHandle = ServerGoalHandle[NestedMessage_Goal, NestedMessage_Result, NestedMessage_Feedback]
Handle = ServerGoalHandle[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback]


def execute_nested(goal_handle: NestedHandle) -> NestedMessage_Result:
    return NestedMessage_Result()


def execute_with_nested_result(goal_handle: Handle) -> NestedMessage_Result:
    goal_handle.publish_feedback(NestedMessage_Feedback())  # error
    print(goal_handle.request.ordre)  # error
    return NestedMessage_Result()


def accept_nested(goal: NestedMessage_Goal) -> GoalResponse:
    return GoalResponse.ACCEPT


def accept_with_bool(goal: Fibonacci_Goal) -> bool:
    return True


def on_accepted_nested(goal_handle: NestedHandle) -> None:
    pass


def cancel_nested(goal_handle: NestedHandle) -> CancelResponse:
    return CancelResponse.ACCEPT


def execute(goal_handle: Handle) -> Fibonacci_Result:
    return Fibonacci_Result()


def publish(node: Node, mixed: NodeMixin) -> None:
    node.create_publisher(StringAdapter, "chatter", 10).publish(Int8())  # error
    node.create_publisher(String, "chatter", 10).publish(Int8())  # error
    create_publisher(node, String, "chatter", 10).publish(Int8())  # error
    mixed.create_lifecycle_publisher(String, "chatter", 10).publish(Int8())  # error
    publisher = node.create_publisher(String, "chatter", 10)
    publisher.publish("text")  # error
    publisher.publish(None)  # error
    publisher.publish(String)  # error
    node.create_publisher(StringAdapter, "chatter")  # error
    node.create_publisher(StringAdapter, "chatter", 10, callback_groups=None)  # error
    node.create_publisher(SetBoolAdapter, "chatter", 10)  # error
    node.create_publisher(int, "chatter", 10)  # error


def subscribe(node: Node) -> None:
    node.create_subscription(StringAdapter, "chatter", on_string, 10)
    node.create_subscription(StringAdapter, "chatter", on_int8, 10)  # error
    node.create_subscription(String, "chatter", on_int8, 10)  # error
    create_subscription(node, StringAdapter, "chatter", on_int8, 10)  # error
    node.create_subscription(StringAdapter, "chatter", on_string, 10, raw=True)  # error
    node.create_subscription(StringAdapter, "chatter", on_string, "deep")  # error
    node.create_subscription(Native, "chatter", print, 10, on_conversion_error=print)  # error
    node.create_subscription(String, "raw", print, 10, raw=True, on_conversion_error=print)  # error
    node.create_subscription(SetBoolAdapter, "chatter", print, 10)  # error


def serve(node: Node) -> None:
    node.create_service(SetBoolAdapter, "set", on_request)
    node.create_service(SetBoolAdapter, "set", on_requests)  # error
    node.create_service(SetBoolAdapter, "set", on_trigger)  # error
    node.create_service(SetBoolAdapter, "set", on_trigger_later)  # error
    node.create_service(SetBoolAdapter, "set", on_half)  # error
    node.create_service(SetBoolAdapter, "set", answer_with_trigger)  # error
    node.create_service(SetBoolAdapter, "set", answer_with_trigger_later)  # error
    node.create_service(SetBoolAdapter, "set", answer_nothing)  # error
    create_service(node, SetBoolAdapter, "set", on_trigger)  # error
    node.create_service(SetBool_Request, "set", on_trigger)  # error
    node.create_service(SetBool_Request, "set", answer_with_trigger)  # error
    node.create_service(StringAdapter, "set", print)  # error
    service = node.create_service(SetBoolAdapter, "set", on_request)
    service.send_response(Trigger_Response(), None)  # error


def on_request_by_name(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
    response.messag = str(request.dat)  # error
    return response


def on_trigger_by_name(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
    return response


def serve_by_name(node: Node) -> None:
    node.create_service(SetBool, "set", on_request_by_name)
    node.create_service(SetBool, "set", on_trigger_by_name)  # error
    node.create_service(SetBool, "set", on_requests)  # error
    node.create_service(SetBool, "set", answer_with_trigger)  # error
    node.create_service(Fibonacci, "set", print)  # error
    create_service(node, SetBool, "set", on_trigger)  # error
    client = node.create_client(SetBool, "set")
    client.call_async(Trigger.Request())  # error
    client.call_async(SetBool.Response())  # error
    client.call_async(SetBool.Request(dat=True))  # error
    create_client(node, Trigger, "set").call(SetBool.Request())  # error
    node.create_client(Fibonacci, "set")  # error
    node.create_publisher(SetBool, "set", 10)  # error


def act_by_name(node: Node) -> None:
    ActionServer(node, Fibonacci, "fibonacci", execute)
    ActionServer(node, NestedMessage, "fibonacci", execute)  # error
    ActionServer(node, SetBool, "fibonacci", execute)  # error
    client = ActionClient(node, Fibonacci, "fibonacci")
    client.send_goal_async(NestedMessage.Goal())  # error
    client.send_goal_async(Fibonacci.Result())  # error
    ActionClient(node, SetBool, "fibonacci")  # error


def make() -> None:
    HeaderAdapter.new(fram_id="map")  # error
    HeaderAdapter.new(frame_id=3)  # error
    HeaderAdapter.new("map")  # error
    SetBool.request.new(dat=True)  # error
    Fibonacci.goal.new(ordre=3)  # error
    header: Header = StringAdapter.new(data="text")  # error
    print(header)


def convert(node: Node) -> None:
    now = node.get_clock().now()
    header = Header()
    Header(stamp=now)  # error
    Header(stamp=to_message(now, Duration))  # error
    header.stamp = to_message(now, Time)  # error
    set_stamp("header", now)  # error
    set_stamp(header, "now")  # error
    set_stamp(header, timedelta(seconds=1))  # error
    to_message(now, String)  # error
    to_datetime(header)  # error
    to_datetime(timedelta(seconds=1))  # error
    to_timedelta(now)  # error
    to_rclpy_time(String())  # error
    to_rclpy_duration(datetime.now(timezone.utc))  # error


def call(node: Node) -> None:
    client = node.create_client(SetBoolAdapter, "set")
    response = client.call(SetBool_Request(data="yes"))  # error
    print(response.message)  # error
    client.call(Trigger_Request())  # error
    client.call_async(Trigger_Request())  # error
    client.call(SetBool_Response())  # error
    create_client(node, SetBoolAdapter, "set").call_async(Trigger_Request())  # error
    node.create_client(SetBool_Request, "set").call_async(Trigger_Request())  # error
    node.create_client(TriggerAdapter, "set").call_async(SetBool_Request())  # error
    node.create_client(StringAdapter, "set")  # error


def act(node: Node) -> None:
    ActionServer(node, FibonacciAdapter, "fibonacci", execute_nested)  # error
    ActionServer(node, FibonacciAdapter, "fibonacci", execute_with_nested_result)  # error
    ActionServer(node, Fibonacci_Goal, "fibonacci", execute_nested)  # error
    ActionServer(node, FibonacciAdapter, "fibonacci", execute, goal_callback=accept_nested)  # error
    ActionServer(node, FibonacciAdapter, "fibonacci", execute, goal_callback=accept_with_bool)  # error
    ActionServer(node, FibonacciAdapter, "f", execute, handle_accepted_callback=on_accepted_nested)  # error
    ActionServer(node, FibonacciAdapter, "fibonacci", execute, cancel_callback=cancel_nested)  # error
    ActionServer(node, SetBoolAdapter, "fibonacci", execute_nested)  # error
    ActionClient(node, FibonacciAdapter, "fibonacci").send_goal_async(NestedMessage_Goal())  # error
    ActionClient(node, FibonacciAdapter, "fibonacci").send_goal(NestedMessage_Goal())  # error
    by_goal: ActionClient[Fibonacci_Goal, Any, Any] = ActionClient(node, Fibonacci_Goal, "fibonacci")
    by_goal.send_goal_async(NestedMessage_Goal())  # error
    ActionClient(node, StringAdapter, "fibonacci")  # error
