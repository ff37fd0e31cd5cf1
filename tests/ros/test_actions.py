"""Action servers and clients against native ones in another process."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from rosidl_adapter_proto.errors import ConversionError
from tests.ros import examples
from tests.ros.support import SECONDS, Peer, wait_until

KINDS = ("native", "protobuf")
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/msg/GoalStatus"""


@pytest.mark.parametrize("server", KINDS)
@pytest.mark.parametrize("client", KINDS)
def test_goals(peer: Peer, node: Any, client: str, server: str) -> None:
    import rclpy.action

    import rosidl_adapter_proto.ros

    name = f"fibonacci_{client}_{server}"
    peer.ask("act", kind=server, name=name)
    adapter, fibonacci = examples.adapter("test_msgs/action/Fibonacci"), examples.ros_class(
        "test_msgs/action/Fibonacci"
    )
    ours = client == "protobuf"
    make_goal = adapter.goal.custom_type if ours else fibonacci.Goal
    feedback: queue.Queue[Any] = queue.Queue()
    actions: Any = rosidl_adapter_proto.ros if ours else rclpy.action
    caller = actions.ActionClient(node, adapter if ours else fibonacci, name)
    assert caller.wait_for_server(SECONDS)

    def send(order: int) -> Any:
        future = caller.send_goal_async(make_goal(order=order), feedback.put)
        wait_until(future.done, "the answer to a goal")
        return future.result()

    assert not send(-1).accepted

    goal = send(5)
    assert goal.accepted
    waiting = feedback.get(timeout=SECONDS)
    assert list(waiting.feedback.sequence) == [0]
    peer.ask("proceed")
    for length in range(3, 7):
        while (message := feedback.get(timeout=SECONDS)).feedback == waiting.feedback:
            pass
        assert list(message.feedback.sequence) == [0, 1, 1, 2, 3, 5][:length]
        assert bytes(message.goal_id.uuid) == bytes(goal.goal_id.uuid)
        assert isinstance(message.feedback, adapter.feedback.custom_type if ours else fibonacci.Feedback)

    result = goal.get_result_async()
    peer.ask("proceed")
    wait_until(result.done, "a result")
    assert result.result().status == SUCCEEDED
    assert list(result.result().result.sequence) == [0, 1, 1, 2, 3, 5]
    assert isinstance(result.result().result, adapter.result.custom_type if ours else fibonacci.Result)

    endless = send(0)
    peer.ask("proceed")
    assert len(endless.cancel_goal().goals_canceling) == 1
    canceled = endless.get_result()
    assert canceled.status == CANCELED
    assert list(canceled.result.sequence) == [0, 1]

    caller.destroy()
    peer.ask("stop_acting")


@pytest.fixture
def fibonacci(ros: None) -> Any:
    return examples.adapter("test_msgs/action/Fibonacci")


def done(future: Any) -> Any:
    wait_until(future.done)
    return future.result()


@pytest.fixture
def acting(node: Any, fibonacci: Any) -> Iterator[Callable[..., tuple[Any, Any]]]:
    """Makes a server and a client of it, connected."""
    from rclpy.callback_groups import ReentrantCallbackGroup

    from rosidl_adapter_proto.ros import ActionClient, ActionServer

    made: list[Any] = []

    def make(name: str, execute: Any, adapter: Any = fibonacci, **options: Any) -> tuple[Any, Any]:
        group = ReentrantCallbackGroup()
        server = ActionServer(node, adapter, name, execute, callback_group=group, **options)
        client = ActionClient(node, adapter, name, callback_group=group)
        made.extend((server, client))
        assert client.wait_for_server(SECONDS)
        return server, client

    yield make
    for each in made:
        each.destroy()


def test_callbacks_of_a_server(acting: Any, fibonacci: Any) -> None:
    """Callbacks get protobuf messages, whether they are given at first or later, functions or coroutines."""
    from rclpy.action.server import CancelResponse, GoalResponse

    goal_class, seen = fibonacci.goal.custom_type, []

    async def execute(goal_handle: Any) -> Any:
        seen.append(("execute", goal_handle.request))
        wait_until(lambda: goal_handle.is_cancel_requested)
        goal_handle.canceled()
        return fibonacci.result.custom_type()

    async def accept(goal: Any) -> Any:
        seen.append(("goal", goal))
        return GoalResponse.ACCEPT

    def accepted(goal_handle: Any) -> None:
        seen.append(("accepted", goal_handle.request))
        goal_handle.execute(execute)

    async def cancel(goal_handle: Any) -> Any:
        seen.append(("cancel", goal_handle.request))
        return CancelResponse.ACCEPT

    server, client = acting("callbacks", print, goal_callback=accept, handle_accepted_callback=accepted)
    server.register_cancel_callback(cancel)
    goal = done(client.send_goal_async(goal_class(order=3)))
    wait_until(lambda: len(seen) == 3)
    goal.cancel_goal()
    assert goal.get_result().status == CANCELED
    assert [name for name, _ in seen] == ["goal", "accepted", "execute", "cancel"]
    assert all(type(goal) is goal_class and goal.order == 3 for _, goal in seen)

    for register in (server.register_goal_callback, server.register_handle_accepted_callback):
        register(None)
    server.register_execute_callback(
        lambda goal_handle: goal_handle.succeed() or fibonacci.result.custom_type()
    )
    assert client.send_goal(goal_class()).status == SUCCEEDED
    server.register_cancel_callback(None)
    with pytest.raises(TypeError, match="not callable"):
        server.register_execute_callback(None)


def test_messages_that_do_not_fit(acting: Any, fibonacci: Any, capfd: pytest.CaptureFixture[str]) -> None:
    errors: list[Exception] = []

    def execute(goal_handle: Any) -> Any:
        try:
            goal_handle.publish_feedback(fibonacci.result.custom_type())
        except TypeError as error:
            errors.append(error)
        return "no result"

    server, client = acting("unfit", execute)
    with pytest.raises(
        TypeError, match=r"^the client of action unfit takes a protobuf message .*Fibonacci_Goal"
    ):
        client.send_goal("order")
    assert client.send_goal(fibonacci.goal.custom_type()).status == ABORTED
    assert str(errors[0]).startswith("publish_feedback takes a protobuf message ")
    assert "the result of an execute callback takes a protobuf message" in capfd.readouterr().err
    assert server.conversion_errors == 0


def test_goals_that_cannot_be_converted_are_rejected(
    acting: Any, fibonacci: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    def refuse(source: Any, destination: Any = None) -> Any:
        raise ConversionError("test_msgs/action/Fibonacci_Goal", "order", "refused")

    goal = type("Goal", (fibonacci.goal,), {"convert_to_custom": staticmethod(refuse)})
    server, client = acting("refusing", print, type("Picky", (fibonacci,), {"goal": goal}))

    assert not done(client.send_goal_async(fibonacci.goal.custom_type())).accepted
    assert server.conversion_errors == 1
    assert (
        "a client of action refusing: test_msgs/action/Fibonacci_Goal.order: refused"
        in capfd.readouterr().err
    )


def test_native_actions_are_passed_through(acting: Any) -> None:
    fibonacci = examples.ros_class("test_msgs/action/Fibonacci")
    received: queue.Queue[Any] = queue.Queue()
    proceed = threading.Event()

    def execute(goal_handle: Any) -> Any:
        assert isinstance(goal_handle.request, fibonacci.Goal)
        assert proceed.wait(SECONDS)
        goal_handle.publish_feedback(fibonacci.Feedback(sequence=[1]))
        goal_handle.succeed()
        return fibonacci.Result(sequence=[2])

    server, client = acting("passed", execute, fibonacci)
    goal = done(client.send_goal_async(fibonacci.Goal(order=1), received.put))
    proceed.set()

    assert goal.get_result().result == fibonacci.Result(sequence=[2])
    assert received.get(timeout=SECONDS).feedback == fibonacci.Feedback(sequence=[1])
    assert server.adapter is client.adapter is None
    assert server.conversion_errors == client.conversion_errors == 0


def test_a_goal_by_its_protobuf_class(acting: Any, fibonacci: Any) -> None:
    server, client = acting("by_class", print, fibonacci.goal.custom_type)
    assert server.adapter is client.adapter is fibonacci
    assert server.action_type is examples.ros_class("test_msgs/action/Fibonacci")
