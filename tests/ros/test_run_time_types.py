"""Nodes with adapters that are made at run time, against native ones in another process."""

from __future__ import annotations

import queue
from typing import Any

import pytest

from rosidl_adapter_proto import TypeRegistry, adapter_for
from tests.ros import examples
from tests.ros.support import SECONDS, Peer, wait_until

SUCCEEDED = 4
"""action_msgs/msg/GoalStatus"""


def test_publishers(peer: Peer, node: Any) -> None:
    topics = {f"made_{name.replace('/', '_')}": name for name in examples.SENSOR_MESSAGES}
    peer.ask("listen", kind="native", topics=topics)
    publishers = {
        topic: node.create_publisher(adapter_for(name), topic, 100) for topic, name in topics.items()
    }
    for topic, name in topics.items():
        wait_until(publishers[topic].get_subscription_count, topic)
        for message in examples.messages(name):
            publishers[topic].publish(examples.as_protobuf(message, adapter_for(name).custom_type))

    assert peer.ask("heard", topics=topics) == {}


def test_subscriptions(node: Any, native_node: Any) -> None:
    received: queue.Queue[Any] = queue.Queue()
    for name in examples.SENSOR_MESSAGES:
        topic, adapter = f"heard_{name.replace('/', '_')}", adapter_for(name)
        node.create_subscription(adapter, topic, received.put, 100)
        publisher = native_node.create_publisher(examples.ros_class(name), topic, 100)
        wait_until(publisher.get_subscription_count, topic)
        for message in examples.messages(name):
            publisher.publish(message)
            assert received.get(timeout=SECONDS) == examples.as_protobuf(message, adapter.custom_type)


def test_a_client(peer: Peer, node: Any) -> None:
    services = {"made_service": "test_msgs/srv/Arrays"}
    peer.ask("serve", kind="native", services=services)
    adapter = adapter_for("test_msgs/srv/Arrays")
    client = node.create_client(adapter, "made_service")
    assert client.wait_for_service(SECONDS)
    exchanges = examples.exchanges_as_protobuf(examples.exchanges("test_msgs/srv/Arrays"), adapter)
    for request, response in exchanges:
        assert client.call(request, timeout_sec=SECONDS) == response
    peer.ask("stop_serving", services=services)


def test_a_service(node: Any, native_node: Any) -> None:
    adapter, native = adapter_for("std_srvs/srv/SetBool"), examples.ros_class("std_srvs/srv/SetBool")

    def answer(request: Any, response: Any) -> Any:
        assert isinstance(request, adapter.request.custom_type)
        response.message = f"set to {request.data}"
        return response

    node.create_service(adapter, "served_service", answer)
    client = native_node.create_client(native, "served_service")
    assert client.wait_for_service(SECONDS)
    assert client.call(native.Request(data=True), timeout_sec=SECONDS).message == "set to True"


def test_an_action_client(peer: Peer, node: Any) -> None:
    from rosidl_adapter_proto.ros import ActionClient

    peer.ask("act", kind="native", name="made_action")
    adapter = adapter_for("test_msgs/action/Fibonacci")
    feedback: queue.Queue[Any] = queue.Queue()
    client = ActionClient(node, adapter, "made_action")
    assert client.wait_for_server(SECONDS)
    future: Any = client.send_goal_async(adapter.goal.custom_type(order=5), feedback.put)
    wait_until(future.done, "the answer to a goal")
    assert list(feedback.get(timeout=SECONDS).feedback.sequence) == [0]
    peer.ask("proceed")
    accepted: Any = future.result()
    result = accepted.get_result_async()
    peer.ask("proceed")
    wait_until(result.done, "a result")
    assert result.result().status == SUCCEEDED
    assert result.result().result == adapter.result.custom_type(sequence=[0, 1, 1, 2, 3, 5])
    client.destroy()
    peer.ask("stop_acting")


def test_an_action_server(node: Any, native_node: Any) -> None:
    import rclpy.action

    from rosidl_adapter_proto.ros import ActionServer

    adapter, native = adapter_for("test_msgs/action/Fibonacci"), examples.ros_class(
        "test_msgs/action/Fibonacci"
    )

    def execute(goal_handle: Any) -> Any:
        goal_handle.succeed()
        return adapter.result.custom_type(sequence=[goal_handle.request.order])

    server = ActionServer(node, adapter, "served_action", execute)
    client: Any = rclpy.action.client.ActionClient(native_node, native, "served_action")
    assert client.wait_for_server(SECONDS)
    result = client.send_goal(native.Goal(order=3))
    assert (result.status, list(result.result.sequence)) == (SUCCEEDED, [3])
    client.destroy()
    server.destroy()


def test_another_version_than_the_installed_one(node: Any) -> None:
    """Nothing is sent that nodes would not understand."""
    from rosidl_adapter_proto.ros import TypeHashError

    registry = TypeRegistry.from_texts({"std_msgs/msg/String": "int32 data\n"})
    with pytest.raises(
        TypeHashError, match=r"^std_msgs/msg/String: the adapter was generated for the type with hash "
    ):
        node.create_publisher(adapter_for("std_msgs/msg/String", registry), "other_version", 10)


def test_a_protobuf_class_means_its_generated_adapter(node: Any) -> None:
    """Where there is one: what is made at run time does not change what a class stands for."""
    made = adapter_for("std_msgs/msg/Header")
    publisher = node.create_publisher(made.custom_type, "by_class", 10)
    assert publisher.adapter.custom_type is made.custom_type
    # Which one there is depends on what the process has imported first: the class belongs to that.
    assert publisher.adapter.__module__ == f"{made.custom_type.__module__.removesuffix('_pb2')}_adapter"


def test_a_protobuf_class_without_generated_code_means_the_adapter_made_for_it(ros: None) -> None:
    from rosidl_adapter_proto.ros.adapters import MESSAGE, find_adapter

    name = "never_generated_msgs/msg/Track"  # other tests generate all that is installed
    made = adapter_for(name, TypeRegistry.from_texts({name: "float64 x\n"}))
    assert find_adapter(MESSAGE, made.custom_type) is made
