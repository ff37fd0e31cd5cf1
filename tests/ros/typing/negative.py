"""What type checkers must refuse: every line that ends with the word error, and no other."""

from __future__ import annotations

from rosidl_proto.std_msgs.msg import Int8, String, StringAdapter
from rosidl_proto.std_srvs.srv import SetBool_Request, SetBool_Response, SetBoolAdapter

from rosidl_adapter_proto.ros import Node, create_subscription


def on_string(message: String) -> None:
    message.dat = "a field that does not exist"  # error


def on_int8(message: Int8) -> None:
    pass


def on_request(request: SetBool_Request, response: SetBool_Response) -> SetBool_Response:
    return response


def on_requests(request: SetBool_Request) -> SetBool_Response:
    return SetBool_Response()


def check(node: Node) -> None:
    node.create_subscription(StringAdapter, "chatter", on_string, 10)
    node.create_subscription(StringAdapter, "chatter", on_int8, 10)  # error
    node.create_subscription(String, "chatter", on_int8, 10)  # error
    create_subscription(node, StringAdapter, "chatter", on_int8, 10)  # error
    node.create_subscription(StringAdapter, "chatter", on_string, 10, raw=True)  # error
    node.create_subscription(StringAdapter, "chatter", on_string, "deep")  # error
    node.create_publisher(StringAdapter, "chatter")  # error
    node.create_publisher(StringAdapter, "chatter", 10, callback_groups=None)  # error
    node.create_service(SetBoolAdapter, "set", on_request)
    client = node.create_client(SetBoolAdapter, "set")
    response = client.call(SetBool_Request(data="yes"))  # error
    print(response.message)  # error
