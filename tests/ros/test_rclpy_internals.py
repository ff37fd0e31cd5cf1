"""Everything that we rely on rclpy for, tried with the rclpy that is installed and nothing of ours in between.

There is a test for each line of `rosidl_adapter_proto.ros.rclpy_internals`. If nodes fail with a new rclpy, look here
first.
"""

from __future__ import annotations

import ast
import inspect
import queue
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.ros.support import ROOT, SECONDS, wait_until

pytest.importorskip("rclpy", reason="needs rclpy: pip install '.[ros]', or source a ROS 2 installation")

import rclpy.action.client
import rclpy.action.server
import rclpy.client
import rclpy.duration
import rclpy.lifecycle
import rclpy.publisher
import rclpy.service
import rclpy.subscription
import rclpy.task
import rclpy.time
from builtin_interfaces.msg import Duration, Time  # type: ignore[import-untyped]
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.serialization import serialize_message
from std_msgs.msg import String  # type: ignore[import-untyped]
from std_srvs.srv import SetBool  # type: ignore[import-untyped]
from test_msgs.action import Fibonacci  # type: ignore[import-untyped]

ROS = ROOT / "rosidl_adapter_proto" / "ros"
NOT_ASSUMPTIONS = ("test_each_line_has_a_test", "test_no_other_module_touches_private_parts")
CDR = serialize_message(String(data="serialized"))


def test_each_line_has_a_test() -> None:
    from rosidl_adapter_proto.ros import rclpy_internals

    assert rclpy_internals.__doc__
    listed = [f"test_{name}" for name in re.findall(r"^- `(\w+)`:", rclpy_internals.__doc__, re.MULTILINE)]
    tested = [name for name in globals() if name.startswith("test_") and name not in NOT_ASSUMPTIONS]
    assert listed == tested


def private_names(file: Path) -> set[str]:
    """Return the names with one leading underscore that a module reads, sets or defines in something."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute):
            names.add(node.attr)
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            names.add(node.name)
    return {name for name in names if re.match(r"_[^_]", name)}


def test_no_other_module_touches_private_parts() -> None:
    of_rclpy = set().union(*map(private_names, Path(rclpy.__file__).parent.rglob("*.py")))
    assert {"_callback", "_result", "_get_result_async"} <= of_rclpy
    touched = {file.name: private_names(file) & of_rclpy for file in sorted(ROS.glob("*.py"))}
    assert touched.pop("rclpy_internals.py") == {"_result", "_exception", "_get_result_async"}
    assert not any(touched.values()), touched


# --- Entities ---


@pytest.fixture
def entities(native_node: Any) -> dict[type, Any]:
    """What a node of rclpy creates, by class."""
    return {
        type(entity): entity
        for entity in (
            native_node.create_publisher(String, "entities", 10),
            native_node.create_subscription(String, "entities", print, 10),
            native_node.create_service(SetBool, "entities", print),
            native_node.create_client(SetBool, "entities"),
        )
    }


def marked(entity: Any, **members: Any) -> Any:
    """Give an entity a subclass of its class, with these members."""
    entity.__class__ = type("Marked", (type(entity),), members)
    return entity


def connected(publisher: Any) -> Any:
    wait_until(publisher.get_subscription_count, "a subscription")
    return publisher


def served(node: Any, name: str, callback: Callable[..., Any]) -> tuple[Any, Any]:
    service = node.create_service(SetBool, name, callback, callback_group=ReentrantCallbackGroup())
    client = node.create_client(SetBool, name, callback_group=ReentrantCallbackGroup())
    assert client.wait_for_service(SECONDS)
    return service, client


def echo(request: Any, response: Any) -> Any:
    response.success = request.data
    return response


def test_entities_may_change_their_class(native_node: Any, entities: dict[type, Any]) -> None:
    received: queue.Queue[Any] = queue.Queue()
    for entity in entities.values():
        assert isinstance(vars(entity), dict)
        marked(entity, __eq__=object.__eq__, __hash__=object.__hash__)
    publisher, subscription, service, client = entities.values()
    assert publisher in list(native_node.publishers)
    assert subscription in list(native_node.subscriptions)
    assert service in list(native_node.services)
    assert client in list(native_node.clients)

    subscription.callback, service.callback = received.put, echo
    connected(publisher).publish(String(data="marked"))
    assert received.get(timeout=SECONDS) == String(data="marked")
    assert client.wait_for_service(SECONDS)
    future = marked(client.call_async(SetBool.Request(data=True)))
    wait_until(future.done)
    assert future.result().success

    assert native_node.destroy_publisher(publisher)
    assert native_node.destroy_subscription(subscription)
    assert native_node.destroy_service(service)
    assert native_node.destroy_client(client)


def overridden_names() -> dict[type, tuple[type, set[str]]]:
    """Return what our classes override, with the class of rclpy that has it."""
    from rosidl_adapter_proto import ros
    from rosidl_adapter_proto.ros import rclpy_internals

    registered = {f"register_{what}_callback" for what in ("goal", "handle_accepted", "cancel", "execute")}
    return {
        ros.Publisher: (rclpy.publisher.Publisher, {"publish"}),
        ros.LifecyclePublisher: (rclpy.lifecycle.LifecyclePublisher, {"publish"}),
        ros.Subscription: (rclpy.subscription.Subscription, {"callback"}),
        ros.Service: (rclpy.service.Service, {"callback", "send_response"}),
        ros.Client: (rclpy.client.Client, {"call", "call_async"}),
        ros.ServerGoalHandle: (rclpy.action.server.ServerGoalHandle, {"request", "publish_feedback"}),
        ros.ActionServer: (rclpy.action.server.ActionServer, {"notify_execute", *registered}),
        ros.ActionClient: (rclpy.action.client.ActionClient, {"send_goal", "send_goal_async"}),
        rclpy_internals.ConvertingActionClient: (rclpy.action.client.ActionClient, {"_get_result_async"}),
        rclpy_internals.ConvertedFuture: (rclpy.task.Future, {"result", "exception"}),
    }


def names_of(rclpy_class: type) -> set[str]:
    """Return the attributes that a class of rclpy and its objects have, as its source has them."""
    sources = {inspect.getfile(each) for each in rclpy_class.__mro__ if each.__module__.startswith("rclpy.")}
    nodes = [node for source in sources for node in ast.walk(ast.parse(Path(source).read_text()))]
    attributes = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    return attributes | set(dir(rclpy_class))


def test_names_are_free() -> None:
    for ours, (theirs, overridden) in overridden_names().items():
        present = names_of(theirs)
        assert overridden <= present
        added = {*vars(ours), *ours.__annotations__} - overridden
        assert not {name for name in added & present if not name.startswith("__")}, ours


def test_callbacks_are_known_by_their_signature(native_node: Any) -> None:
    received: queue.Queue[Any] = queue.Queue()

    def wrapper(*arguments: Any) -> None:
        received.put(arguments)

    async def coroutine(*arguments: Any) -> None:
        received.put(arguments)

    publisher = native_node.create_publisher(String, "signatures", 10)
    both: tuple[Any, Any] = (wrapper, coroutine)
    for wrapped, length in ((lambda message: None, 1), (lambda message, info: None, 2)):
        for callback in both:
            callback.__wrapped__ = wrapped
            subscription = native_node.create_subscription(String, "signatures", callback, 10)
            connected(publisher).publish(String())
            assert len(received.get(timeout=SECONDS)) == length
            native_node.destroy_subscription(subscription)


def test_publishers_send_bytes(native_node: Any) -> None:
    received: queue.Queue[Any] = queue.Queue()
    native_node.create_subscription(String, "bytes", received.put, 10)
    connected(native_node.create_publisher(String, "bytes", 10)).publish(CDR)
    assert received.get(timeout=SECONDS) == String(data="serialized")


def test_raw_subscriptions_hand_over_bytes(native_node: Any) -> None:
    received: queue.Queue[Any] = queue.Queue()
    subscription = native_node.create_subscription(String, "raw", print, 10, raw=True)
    publisher = connected(native_node.create_publisher(String, "raw", 10))
    subscription.callback = received.put
    publisher.publish(CDR)
    assert received.get(timeout=SECONDS) == CDR
    subscription.raw = False
    publisher.publish(CDR)
    assert received.get(timeout=SECONDS) == String(data="serialized")


def test_subscription_callback_is_a_property(entities: dict[type, Any]) -> None:
    subscription = entities[rclpy.subscription.Subscription]
    described = vars(rclpy.subscription.Subscription)["callback"]
    assert isinstance(described, property)
    described.fset(subscription, len)  # type: ignore[misc]
    assert described.fget(subscription) is len  # type: ignore[misc]
    with pytest.raises(RuntimeError, match="callable with one argument"):
        described.fset(subscription, lambda one, two, three: None)  # type: ignore[misc]


def test_service_callback_is_an_attribute(native_node: Any) -> None:
    service, client = served(native_node, "attribute", echo)
    assert vars(service)["callback"] is echo
    asked: queue.Queue[Any] = queue.Queue()

    def answer(request: Any, response: Any) -> Any:
        asked.put((request, response))
        return echo(request, response)

    marked(service, callback=property(lambda self: answer))
    assert client.call(SetBool.Request(data=True), SECONDS).success
    request, response = asked.get(timeout=SECONDS)
    assert (type(request), response) == (SetBool.Request, SetBool.Response(success=True))


def test_services_send_what_the_callback_returns(native_node: Any) -> None:
    sent: queue.Queue[Any] = queue.Queue()
    anything = object()
    service, client = served(native_node, "returned", lambda request, response: anything)
    marked(service, send_response=lambda self, response, header: sent.put((response, header)))
    client.call_async(SetBool.Request())
    response, header = sent.get(timeout=SECONDS)
    assert response is anything
    assert header is not None


def test_clients_call_through_call_async(entities: dict[type, Any]) -> None:
    done: Any = rclpy.task.Future()
    done.set_result("the response")
    client = marked(entities[rclpy.client.Client], call_async=lambda self, request: done)
    assert client.call(SetBool.Request(), SECONDS) == "the response"


def test_futures_keep_result_and_exception() -> None:
    future: Any = rclpy.task.Future()
    assert (future._result, future._exception) == (None, None)
    future.set_result("set")
    assert future._result == "set"
    future._result = "converted"
    assert future.result() == "converted"
    with pytest.raises(StopIteration) as returned:
        next(future.__await__())
    assert returned.value.value == "converted"
    marked(future, result=lambda self: "asked")
    with pytest.raises(StopIteration) as returned:
        next(future.__await__())
    assert returned.value.value == "asked"

    failed: Any = rclpy.task.Future()
    failed.set_result("set")
    failed._exception = ZeroDivisionError()
    assert failed.exception() is failed._exception
    with pytest.raises(ZeroDivisionError):
        failed.result()


def test_lifecycle_publishers_know_whether_they_are_active(ros: None, spin: Callable[..., Any]) -> None:
    node = spin(rclpy.lifecycle.LifecycleNode("lifecycle"))
    publisher = node.create_lifecycle_publisher(String, "lifecycle", 10)
    assert type(publisher) is rclpy.lifecycle.LifecyclePublisher
    assert isinstance(publisher, rclpy.publisher.Publisher)
    assert publisher.is_activated is False
    node.trigger_configure()
    node.trigger_activate()
    assert publisher.is_activated is True


# --- Actions ---


@pytest.fixture
def acting(native_node: Any) -> Iterator[Callable[..., tuple[Any, Any]]]:
    """Makes a server and a client of it, of these classes, connected."""
    made: list[Any] = []

    def make(name: str, execute: Any, **options: Any) -> tuple[Any, Any]:
        group = ReentrantCallbackGroup()
        server_class = options.pop("server_class", rclpy.action.server.ActionServer)
        server = server_class(native_node, Fibonacci, name, execute, callback_group=group, **options)
        client: Any = rclpy.action.client.ActionClient(native_node, Fibonacci, name, callback_group=group)
        made.extend((server, client))
        assert client.wait_for_server(SECONDS)
        return server, client

    yield make
    for each in made:
        each.destroy()


def succeed(goal_handle: Any) -> Any:
    goal_handle.succeed()
    return Fibonacci.Result()


def test_action_servers_register_their_callbacks(acting: Any) -> None:
    registered = {}

    def recorder(name: str) -> Callable[[Any, Any], None]:
        def register(self: Any, callback: Any) -> None:
            registered[name] = callback
            getattr(rclpy.action.server.ActionServer, name)(self, callback)

        return register

    names = [f"register_{what}_callback" for what in ("goal", "handle_accepted", "cancel", "execute")]
    recording = type(
        "Recording", (rclpy.action.server.ActionServer,), {name: recorder(name) for name in names}
    )
    acting("registered", succeed, server_class=recording, goal_callback=max)
    actions: Any = rclpy.action.server
    assert registered == {
        "register_goal_callback": max,
        "register_handle_accepted_callback": actions.default_handle_accepted_callback,
        "register_cancel_callback": actions.default_cancel_callback,
        "register_execute_callback": succeed,
    }
    assert actions.default_goal_callback(None) is actions.GoalResponse.ACCEPT


def test_goal_handles_may_change_their_class(acting: Any) -> None:
    handles: list[Any] = []

    def accept(goal_handle: Any) -> None:
        assert type(goal_handle) is rclpy.action.server.ServerGoalHandle
        assert "request" not in vars(goal_handle)
        handles.append(marked(goal_handle, request=property(lambda self: "changed")))
        goal_handle.execute()

    def execute(goal_handle: Any) -> Any:
        handles.append(goal_handle)
        return succeed(goal_handle)

    _, client = acting("handles", execute, handle_accepted_callback=accept)
    assert client.send_goal(Fibonacci.Goal()).status == 4
    assert handles[0] is handles[1]
    assert handles[0].request == "changed"


def test_goal_handles_execute_through_their_server(acting: Any) -> None:
    notified: list[Any] = []

    class Recording(rclpy.action.server.ActionServer):  # type: ignore[type-arg]
        def notify_execute(self, goal_handle: Any, execute_callback: Any) -> None:
            notified.append(execute_callback)
            super().notify_execute(goal_handle, execute_callback)

    server, client = acting("notified", succeed, server_class=Recording)
    assert client.send_goal(Fibonacci.Goal()).status == 4
    server.register_handle_accepted_callback(lambda goal_handle: goal_handle.execute(succeed))
    assert client.send_goal(Fibonacci.Goal()).status == 4
    assert notified == [None, succeed]


def test_goals_are_sent_through_send_goal_async(acting: Any) -> None:
    sent = []

    def send_goal_async(self: Any, *arguments: Any, **options: Any) -> Any:
        sent.append((arguments, options))
        raise ZeroDivisionError

    _, client = acting("sent", succeed)
    marked(client, send_goal_async=send_goal_async)
    with pytest.raises(ZeroDivisionError):
        client.send_goal(Fibonacci.Goal(order=3), feedback_callback=print)
    assert sent == [((Fibonacci.Goal(order=3),), {"feedback_callback": print})]


def test_results_come_through_get_result_async(acting: Any) -> None:
    done: Any = rclpy.task.Future()
    done.set_result("the result")
    _, client = acting("results", succeed)
    marked(client, _get_result_async=lambda self, goal_handle: done)
    sending = client.send_goal_async(Fibonacci.Goal())
    wait_until(sending.done)
    assert sending.result().get_result_async() is done
    assert sending.result().get_result() == "the result"
    assert client.send_goal(Fibonacci.Goal()) == "the result"


# --- Time ---


def test_stamps_are_read_by_from_msg() -> None:
    for rclpy_class, ros_class in ((rclpy.time.Time, Time), (rclpy.duration.Duration, Duration)):
        described = vars(rclpy_class)["from_msg"]
        assert isinstance(described, classmethod)
        of_rclpy: Any = inspect.unwrap(described.__func__)
        assert of_rclpy.__module__ == rclpy_class.__module__
        assert of_rclpy(rclpy_class, ros_class(sec=1, nanosec=2)).nanoseconds == 10**9 + 2
        with pytest.raises(TypeError, match="Must pass a builtin_interfaces"):
            of_rclpy(rclpy_class, SimpleNamespace(sec=1, nanosec=2))
