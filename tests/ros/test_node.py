"""What nodes, publishers and subscriptions of ours do as those of rclpy do, and what they do besides."""

from __future__ import annotations

import functools
import json
import queue
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from rosidl_adapter_proto.errors import ConversionError
from tests.ros import examples
from tests.ros.support import SECONDS, Spinning, wait_until

STRING = "std_msgs/msg/String"
INVALID_UTF8 = b"\x00\x01\x00\x00\x02\x00\x00\x00\xff\x00"
TOO_LONG = b"\x00\x01\x00\x00\xff\xff\xff\x7f"


@pytest.fixture
def adapter(ros: None) -> Any:
    return examples.adapter(STRING)


@pytest.fixture
def text(adapter: Any) -> Any:
    """Makes a protobuf message."""
    return lambda data: adapter.custom_type(data=data)


class Received:
    """A callback that keeps what it is called with."""

    def __init__(self) -> None:
        self.queue: queue.Queue[Any] = queue.Queue()

    def method(self, message: Any) -> None:
        self.queue.put(message)

    def with_info(self, message: Any, info: Any) -> None:
        self.queue.put((message, info))

    async def coroutine(self, message: Any) -> None:
        self.queue.put(message)

    async def coroutine_with_info(self, message: Any, info: Any) -> None:
        self.queue.put((message, info))

    def next(self) -> Any:
        return self.queue.get(timeout=SECONDS)


def connected(publisher: Any) -> Any:
    wait_until(publisher.get_subscription_count, "a subscription")
    return publisher


# --- What types are taken ---


def test_ros_types_are_passed_through(node: Any) -> None:
    import rclpy.client
    import rclpy.publisher
    import rclpy.service
    import rclpy.subscription

    string, set_bool = examples.ros_class(STRING), examples.ros_class("std_srvs/srv/SetBool")
    received = Received()

    publisher = node.create_publisher(string, "native", 10)
    subscription = node.create_subscription(string, "native", received.method, qos_profile=10)
    service = node.create_service(set_bool, "native", lambda request, response: response)
    client = node.create_client(set_bool, "native")

    assert type(publisher) is rclpy.publisher.Publisher
    assert type(subscription) is rclpy.subscription.Subscription
    assert type(service) is rclpy.service.Service
    assert type(client) is rclpy.client.Client
    connected(publisher).publish(string(data="native"))
    assert received.next() == string(data="native")


def test_protobuf_classes_have_adapters(node: Any, adapter: Any, text: Any) -> None:
    received = Received()
    subscription = node.create_subscription(adapter.custom_type, "classes", received.method, 10)
    publisher = node.create_publisher(adapter.custom_type, "classes", 10)
    set_bool = examples.adapter("std_srvs/srv/SetBool")

    assert publisher.adapter is subscription.adapter is adapter
    assert publisher.msg_type is subscription.msg_type is examples.ros_class(STRING)
    assert node.create_client(set_bool.request.custom_type, "classes").adapter is set_bool
    connected(publisher).publish(text("found"))
    assert received.next() == text("found")


def test_adapters_of_other_protobuf_classes(node: Any, adapter: Any) -> None:
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    from rosidl_adapter_proto.ros import AdapterNotFoundError

    def message_class(name: str) -> Any:
        descriptor = pool.FindMessageTypeByName(name)
        if hasattr(message_factory, "GetMessageClass"):
            return message_factory.GetMessageClass(descriptor)
        return message_factory.MessageFactory(pool).GetPrototype(descriptor)  # before protobuf 4.22

    pool = descriptor_pool.DescriptorPool()
    file = descriptor_pb2.FileDescriptorProto(name="mine/Text.proto", package="mine", syntax="proto3")
    file.message_type.add(name="Text").field.add(name="text", number=1, type=9, label=1)
    pool.AddSerializedFile(file.SerializeToString())
    text_class = message_class("mine.Text")

    with pytest.raises(AdapterNotFoundError, match=r"Text has no adapter for a message"):
        node.create_publisher(text_class, "mine", 10)

    class TextAdapter(adapter):  # type: ignore[misc]
        custom_type = text_class

        @staticmethod
        def convert_to_ros_message(source: Any, destination: Any = None) -> Any:
            return adapter.ros_message_type(data=source.text.upper())

        @staticmethod
        def convert_to_custom(source: Any, destination: Any = None) -> Any:
            return text_class(text=f"{source.data}!")

    received = Received()
    subscription = node.create_subscription(text_class, "mine", received.method, 10)
    publisher = connected(node.create_publisher(text_class, "mine", 10))
    assert publisher.adapter is subscription.adapter is TextAdapter
    publisher.publish(TOO_LONG)
    publisher.publish(text_class(text="hello"))
    assert received.next() == text_class(text="HELLO!")
    assert subscription.conversion_errors == 1

    class OtherAdapter(TextAdapter):
        pass

    other_file = descriptor_pb2.FileDescriptorProto(name="mine/More.proto", package="more", syntax="proto3")
    other_file.message_type.add(name="More")
    pool.AddSerializedFile(other_file.SerializeToString())
    TextAdapter.custom_type = OtherAdapter.custom_type = message_class("more.More")
    with pytest.raises(AdapterNotFoundError, match=r"TextAdapter and .*OtherAdapter; pass the one to use"):
        node.create_publisher(TextAdapter.custom_type, "mine", 10)


def test_adapters_made_at_run_time(
    node: Any, adapter: Any, text: Any, native_node: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    """Nobody generated them, so they may know little more than their conversions, and no module has them."""
    from rosidl_adapter_proto.adapter import ServiceAdapter, TypeAdapter

    def made(given: Any) -> Any:
        class MadeAdapter(TypeAdapter[Any, Any]):
            custom_type = given.custom_type
            ros_message_type = given.ros_message_type
            fields = ()

            @staticmethod
            def convert_to_ros_message(source: Any, destination: Any = None) -> Any:
                return given.convert_to_ros_message(source)

            @staticmethod
            def convert_to_custom(source: Any, destination: Any = None) -> Any:
                return given.convert_to_custom(source)

        return MadeAdapter

    received = Received()
    text_adapter = made(adapter)
    subscription = node.create_subscription(text_adapter, "made", received.method, 10)
    connected(node.create_publisher(text_adapter, "made", 10)).publish(text("hello"))
    assert received.next() == text("hello")
    connected(native_node.create_publisher(adapter.ros_message_type, "made", 10)).publish(TOO_LONG)
    wait_until(lambda: subscription.conversion_errors == 1)
    log = "MadeAdapter: 8 bytes are not a serialized message of this type: "
    wait_until(lambda: log in capfd.readouterr().err, "the log")

    set_bool = examples.adapter("std_srvs/srv/SetBool")
    parts = {name: made(getattr(set_bool, name)) for name in ("request", "response")}
    ros_service_type = examples.ros_class("std_srvs/srv/SetBool")
    switch = type("SwitchAdapter", (ServiceAdapter,), {**parts, "ros_service_type": ros_service_type})
    make_request, make_response = (parts[name].custom_type for name in ("request", "response"))
    node.create_service(switch, "made", lambda request, response: make_response(success=request.data))
    client = node.create_client(switch, "made")
    assert client.wait_for_service(SECONDS)
    assert client.call(make_request(data=True), SECONDS) == make_response(success=True)


def test_adapters_of_another_kind(node: Any, adapter: Any) -> None:
    from rosidl_adapter_proto.ros import ActionClient, AdapterNotFoundError

    set_bool = examples.adapter("std_srvs/srv/SetBool")
    with pytest.raises(AdapterNotFoundError, match="SetBoolAdapter is not the adapter of a message"):
        node.create_publisher(set_bool, "kind", 10)
    with pytest.raises(AdapterNotFoundError, match="StringAdapter is not the adapter of a service"):
        node.create_client(adapter, "kind")
    with pytest.raises(AdapterNotFoundError, match="String has no adapter for a service"):
        node.create_service(adapter.custom_type, "kind", print)
    with pytest.raises(AdapterNotFoundError, match="SetBoolAdapter is not the adapter of an action"):
        ActionClient(node, set_bool, "kind")


def test_another_version_of_a_type(node: Any, adapter: Any) -> None:
    from rosidl_adapter_proto.ros import ActionServer, TypeHashError

    def outdated(type_name: str) -> Any:
        current = examples.adapter(type_name)
        return type(current.__name__, (current,), {"type_hash": "RIHS01_" + "0" * 64})

    expected = (
        rf"^std_msgs/msg/String: the adapter was generated for the type with hash RIHS01_0{{64}}, but "
        rf".*/share/std_msgs/msg/String.json has {adapter.type_hash}; .*: rosidl-proto generate std_msgs$"
    )
    for _ in range(2):
        with pytest.raises(TypeHashError, match=expected):
            node.create_publisher(outdated(STRING), "version", 10)
    with pytest.raises(TypeHashError, match=expected):
        node.create_subscription(outdated(STRING), "version", print, 10)
    with pytest.raises(TypeHashError, match=r"^std_srvs/srv/SetBool: .*SetBool\.json "):
        node.create_client(outdated("std_srvs/srv/SetBool"), "version")
    with pytest.raises(TypeHashError, match=r"^std_srvs/srv/SetBool: .*SetBool\.json "):
        node.create_service(outdated("std_srvs/srv/SetBool"), "version", print)
    with pytest.raises(TypeHashError, match=r"^test_msgs/action/Fibonacci: .*Fibonacci\.json "):
        ActionServer(node, outdated("test_msgs/action/Fibonacci"), "version", print)
    assert "/version" not in dict(node.get_topic_names_and_types())


def test_a_type_without_description(node: Any, adapter: Any) -> None:
    from rosidl_adapter_proto.ros.type_hash import check_type_hash

    class Unknown(adapter):  # type: ignore[misc]
        type_name = "std_msgs/msg/Unknown"

    warnings: list[str] = []
    check_type_hash(Unknown, adapter.ros_message_type, SimpleNamespace(warning=warnings.append))  # type: ignore[arg-type]
    assert len(warnings) == 1
    assert "no type description share/std_msgs/msg/Unknown.json in a folder above" in warnings[0]


@pytest.mark.parametrize(
    ("type_name", "file"),
    [
        ("pkg/msg/My_Type", "msg/My_Type"),
        ("pkg/msg/My_Type", "msg/My_Type_"),
        ("pkg/srv/My_Service_Request", "srv/My_Service"),
        ("pkg/action/My_Action_SendGoal_Request", "action/My_Action"),
        ("pkg/msg/My", "msg/My"),
    ],
)
def test_names_with_underscores(
    type_name: str, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each file of the package describes one type, and `My.json` another than the one that is asked for."""
    from rosidl_adapter_proto.ros.type_hash import TypeHashError, _installed_type_hash, check_type_hash

    for path, described in (("msg/My", "pkg/msg/My"), (file, type_name)):
        place = tmp_path / "share" / "pkg" / f"{path}.json"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(json.dumps({"type_hashes": [{"type_name": described, "hash_string": "RIHS01_1"}]}))
    module = ModuleType("pkg")
    module.__file__ = str(tmp_path / "lib" / "pkg" / "__init__.py")
    monkeypatch.setitem(sys.modules, "pkg", module)
    _installed_type_hash.cache_clear()
    warnings: list[str] = []
    adapter: Any = SimpleNamespace(type_name=type_name, type_hash="RIHS01_0")
    logger: Any = SimpleNamespace(warning=warnings.append)
    try:
        if file.endswith("_"):  # a file that cannot be the type's
            check_type_hash(adapter, SimpleNamespace(__module__="pkg.msg"), logger)
            assert len(warnings) == 1
            return
        with pytest.raises(TypeHashError, match=rf"^{type_name}: .*/share/pkg/{file}\.json has RIHS01_1; "):
            check_type_hash(adapter, SimpleNamespace(__module__="pkg.msg"), logger)
    finally:
        _installed_type_hash.cache_clear()


# --- Publishers ---


def test_what_is_published(node: Any, adapter: Any, text: Any) -> None:
    from rclpy.serialization import serialize_message

    received = Received()
    node.create_subscription(adapter, "published", received.method, 10)
    publisher = connected(node.create_publisher(adapter, "published", 10))
    native = examples.ros_class(STRING)(data="native")

    publisher.publish(text("protobuf"))
    publisher.publish(native)
    publisher.publish(serialize_message(native))

    assert [received.next().data for _ in range(3)] == ["protobuf", "native", "native"]
    with pytest.raises(
        TypeError, match=r"^the publisher of /published takes a protobuf message .*String .*not builtins.str"
    ):
        publisher.publish("text")


def test_a_message_that_does_not_fit_is_not_published(node: Any, text: Any) -> None:
    int8 = examples.adapter("std_msgs/msg/Int8")
    received = Received()
    node.create_subscription(int8, "unfit", received.method, 10)
    publisher = connected(node.create_publisher(int8, "unfit", 10))

    with pytest.raises(ConversionError, match=r"^std_msgs/msg/Int8\.data.*: .*128"):
        publisher.publish(int8.custom_type(data=128))
    publisher.publish(int8.custom_type(data=127))

    assert received.next().data == 127


def test_publishers_are_those_of_rclpy(ros: None, adapter: Any, text: Any, spin: Callable[..., Any]) -> None:
    import rclpy.publisher
    from rclpy.duration import Duration
    from rclpy.event_handler import PublisherEventCallbacks
    from rclpy.parameter import Parameter
    from rclpy.qos import QoSProfile
    from rclpy.qos_overriding_options import QoSOverridingOptions

    from rosidl_adapter_proto.ros import Node

    matched: queue.Queue[Any] = queue.Queue()
    depth = Parameter("qos_overrides./space/renamed.publisher.depth", value=7)
    arguments = ["--ros-args", "-r", "talk:=renamed"]
    node = spin(Node("ours", namespace="space", cli_args=arguments, parameter_overrides=[depth]))
    publisher = node.create_publisher(
        adapter,
        "talk",
        QoSProfile(depth=3),
        event_callbacks=PublisherEventCallbacks(matched=matched.put),
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )
    assert isinstance(publisher, rclpy.publisher.Publisher)
    assert publisher in list(node.publishers)
    assert publisher.topic_name == "/space/renamed"
    assert publisher.qos_profile.depth == 7
    assert publisher.logger_name == "space.ours"
    assert len(publisher.event_handlers) >= 1
    publisher.assert_liveliness()
    node.create_subscription(adapter, "renamed", print, 10)
    assert matched.get(timeout=SECONDS).current_count == 1
    publisher.publish(text("acknowledged"))
    assert publisher.wait_for_all_acked(Duration(seconds=SECONDS))
    assert node.destroy_publisher(publisher)
    assert not node.destroy_publisher(publisher)


def test_context_managers(ros: None, adapter: Any, text: Any) -> None:
    import rclpy.node

    from rosidl_adapter_proto.ros import Node

    if not hasattr(rclpy.node.Node, "__enter__"):
        pytest.skip("this rclpy has no context managers")
    trigger = examples.adapter("std_srvs/srv/Trigger")
    with (
        Node("managed") as node,
        node.create_publisher(adapter, "managed", 10) as publisher,
        node.create_subscription(adapter, "managed", print, 10) as subscription,
        node.create_service(trigger, "managed", print) as service,
        node.create_client(trigger, "managed") as client,
    ):
        assert {type(each).__name__ for each in (publisher, subscription, service, client)} == {
            *("Publisher", "Subscription", "Service", "Client")
        }
        publisher.publish(text("hello"))


def test_a_publisher_class_of_the_user(node: Any, adapter: Any, text: Any) -> None:
    import rclpy.publisher

    import rosidl_adapter_proto.ros

    class Counting(rclpy.publisher.Publisher):  # type: ignore[type-arg]
        count = 0

        def publish(self, msg: Any) -> None:
            self.count += 1
            super().publish(msg)

    publisher = node.create_publisher(adapter, "counting", 10, publisher_class=Counting)
    publisher.publish(text("one"))
    assert isinstance(publisher, (Counting, rosidl_adapter_proto.ros.Publisher))
    assert publisher.count == 1


# --- Subscriptions ---


def callbacks(received: Received) -> dict[str, tuple[Callable[..., Any], bool]]:
    """Callbacks of every kind, and whether they take a MessageInfo."""
    return {
        "method": (received.method, False),
        "lambda": (lambda message: received.queue.put((message, "lambda")[0]), False),
        "partial": (functools.partial(received.with_info, info=None), False),
        "builtin": (received.queue.put_nowait, False),
        "optional": (lambda message, info=0: received.method(message), False),
        "with info": (received.with_info, True),
        "coroutine": (received.coroutine, False),
        "coroutine with info": (received.coroutine_with_info, True),
    }


@pytest.mark.parametrize("kind", callbacks(Received()))
def test_callbacks(node: Any, adapter: Any, text: Any, kind: str) -> None:
    received = Received()
    callback, has_info = callbacks(received)[kind]
    topic = kind.replace(" ", "_")
    subscription = node.create_subscription(adapter, topic, callback, 10)
    publisher = connected(node.create_publisher(adapter, topic, 10))

    publisher.publish(text("hello"))
    message = received.next()

    if has_info:
        message, info = message
        assert info["source_timestamp"] > 0
    elif kind == "partial":
        message, _ = message
    assert type(message) is adapter.custom_type
    assert message == text("hello")
    assert subscription.callback.__wrapped__ == callback


def test_a_callback_that_takes_three_arguments(node: Any, adapter: Any) -> None:
    with pytest.raises(RuntimeError, match="callable with one argument"):
        node.create_subscription(adapter, "three", lambda one, two, three: None, 10)


def test_another_callback(node: Any, adapter: Any, text: Any) -> None:
    first, second = Received(), Received()
    subscription = node.create_subscription(adapter, "another", first.method, 10)
    publisher = connected(node.create_publisher(adapter, "another", 10))

    subscription.callback = second.with_info
    publisher.publish(text("hello"))

    assert second.next()[0] == text("hello")
    subscription.callback = first.method
    subscription.callback(text("by hand"))
    assert first.next() == text("by hand")


def test_raw_subscriptions(node: Any, adapter: Any, text: Any) -> None:
    from rclpy.serialization import deserialize_message

    received = Received()
    node.create_subscription(adapter, "raw", received.method, 10, raw=True)
    connected(node.create_publisher(adapter, "raw", 10)).publish(text("hello"))
    assert deserialize_message(received.next(), adapter.ros_message_type).data == "hello"


def test_subscriptions_are_those_of_rclpy(ros: None, adapter: Any, spin: Callable[..., Any]) -> None:
    import rclpy.subscription
    from rclpy.callback_groups import ReentrantCallbackGroup
    from rclpy.event_handler import SubscriptionEventCallbacks
    from rclpy.qos import QoSProfile

    from rosidl_adapter_proto.ros import Node

    matched: queue.Queue[Any] = queue.Queue()
    node = spin(Node("ours", namespace="space", cli_args=["--ros-args", "-r", "listen:=renamed"]))
    group = ReentrantCallbackGroup()
    events = SubscriptionEventCallbacks(matched=matched.put)
    subscription = node.create_subscription(
        adapter, "listen", print, QoSProfile(depth=3), callback_group=group, event_callbacks=events
    )
    assert isinstance(subscription, rclpy.subscription.Subscription)
    assert subscription in list(node.subscriptions)
    assert subscription.topic_name == "/space/renamed"
    assert subscription.callback_group is group
    assert subscription.qos_profile.depth == 3
    assert subscription.get_publisher_count() == 0
    node.create_publisher(adapter, "renamed", 10)
    assert matched.get(timeout=SECONDS).current_count == 1
    assert node.destroy_subscription(subscription)


def test_content_filters(node: Any, adapter: Any, text: Any) -> None:
    options = pytest.importorskip(
        "rclpy.subscription_content_filter_options", reason="this rclpy has no content filters"
    )
    received = Received()
    subscription = node.create_subscription(
        adapter,
        "filtered",
        received.method,
        10,
        content_filter_options=options.ContentFilterOptions("data = %0", ["'yes'"]),
    )
    assert subscription.is_cft_enabled
    publisher = connected(node.create_publisher(adapter, "filtered", 10))
    for data in ("no", "yes"):
        publisher.publish(text(data))
    assert received.next() == text("yes")


@pytest.mark.parametrize("data", [INVALID_UTF8, TOO_LONG, b"\x00\x01\x00\x00", b"\x00"], ids=repr)
def test_bad_messages_are_counted_and_dropped(
    node: Any, native_node: Any, adapter: Any, text: Any, data: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    received, topic = Received(), f"bad_{data.hex()}"
    subscription = node.create_subscription(adapter, topic, received.method, 10)
    publisher = connected(native_node.create_publisher(adapter.ros_message_type, topic, 10))

    for _ in range(3):
        publisher.publish(data)
    publisher.publish(adapter.ros_message_type(data="good"))

    assert received.next() == text("good")
    assert subscription.conversion_errors == 3
    assert received.queue.empty()
    log = capfd.readouterr().err
    assert log.count(f"[tested]: dropped what came from topic {topic}: std_msgs/msg/String") == 1
    assert "(1 dropped so far)" in log


def test_bad_messages_are_handed_over(
    node: Any, native_node: Any, adapter: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    errors: queue.Queue[Any] = queue.Queue()
    node.create_subscription(
        adapter, "handed", print, 10, on_conversion_error=lambda error, data: errors.put((error, data))
    )
    connected(native_node.create_publisher(adapter.ros_message_type, "handed", 10)).publish(TOO_LONG)

    error, data = errors.get(timeout=SECONDS)

    assert isinstance(error, ConversionError)
    assert str(error).startswith("std_msgs/msg/String.data at byte 8: ")
    assert data == TOO_LONG
    assert "dropped" not in capfd.readouterr().err


def test_publishers_of_other_versions_are_named(adapter: Any) -> None:
    from rosidl_adapter_proto.ros.type_hash import publishers_of_other_versions

    endpoints = [
        SimpleNamespace(node_namespace="/", node_name="same", topic_type_hash=adapter.type_hash),
        SimpleNamespace(node_namespace="/old", node_name="robot", topic_type_hash="RIHS01_00"),
        SimpleNamespace(node_namespace="/", node_name="unknown", topic_type_hash="INVALID"),
    ]
    node: Any = SimpleNamespace(
        get_publishers_info_by_topic=lambda topic: endpoints, resolve_topic_name=lambda topic: topic
    )
    assert publishers_of_other_versions(node, "/topic", adapter) == ["/old/robot (RIHS01_00)"]


def test_an_error_of_a_callback_reaches_the_executor(ros: None, adapter: Any, text: Any) -> None:
    from rosidl_adapter_proto.ros import Node

    def fail(message: Any) -> None:
        raise ZeroDivisionError(message.data)

    node = Node("failing")
    spinning = Spinning(node)
    node.create_subscription(adapter, "failing", fail, 10)
    connected(node.create_publisher(adapter, "failing", 10)).publish(text("boom"))
    spinning.thread.join(SECONDS)
    with pytest.raises(ZeroDivisionError, match="boom"):
        spinning.stop()


# --- Nodes ---


def executors() -> dict[str, Callable[[], Any]]:
    return {
        "SingleThreadedExecutor": lambda: rclpy_executors().SingleThreadedExecutor(),
        "MultiThreadedExecutor": lambda: rclpy_executors().MultiThreadedExecutor(num_threads=2),
        "EventsExecutor": lambda: pytest.importorskip("rclpy.experimental").EventsExecutor(),
    }


def rclpy_executors() -> Any:
    import rclpy.executors

    return rclpy.executors


@pytest.mark.parametrize("name", executors())
def test_executors(ros: None, adapter: Any, text: Any, name: str) -> None:
    from rosidl_adapter_proto.ros import ActionClient, ActionServer, Node

    node, executor, received = Node("spun"), executors()[name](), Received()
    executor.add_node(node)

    def spin_until(condition: Callable[[], Any]) -> None:
        wait_until(lambda: executor.spin_once(timeout_sec=0.01) or condition())

    subscription = node.create_subscription(adapter, name, received.method, 10)
    publisher = node.create_publisher(adapter, name, 10)
    spin_until(publisher.get_subscription_count)
    publisher.publish(TOO_LONG)
    publisher.publish(text("hello"))
    spin_until(lambda: not received.queue.empty())
    assert received.next() == text("hello")
    assert subscription.conversion_errors == 1

    set_bool = examples.adapter("std_srvs/srv/SetBool")
    make_response = set_bool.response.custom_type
    node.create_service(set_bool, name, lambda request, response: make_response(success=request.data))
    client = node.create_client(set_bool, name)
    spin_until(client.service_is_ready)
    response = client.call_async(set_bool.request.custom_type(data=True))
    executor.spin_until_future_complete(response, timeout_sec=SECONDS)
    assert response.result() == make_response(success=True)

    fibonacci = examples.adapter("test_msgs/action/Fibonacci")

    def execute(goal_handle: Any) -> Any:
        goal_handle.succeed()
        return fibonacci.result.custom_type(sequence=[goal_handle.request.order])

    server, action_client = ActionServer(node, fibonacci, name, execute), ActionClient(node, fibonacci, name)
    spin_until(action_client.server_is_ready)
    goal = action_client.send_goal_async(fibonacci.goal.custom_type(order=5))
    executor.spin_until_future_complete(goal, timeout_sec=SECONDS)
    result = goal.result().get_result_async()
    executor.spin_until_future_complete(result, timeout_sec=SECONDS)
    assert result.result().result == fibonacci.result.custom_type(sequence=[5])

    server.destroy()
    action_client.destroy()
    node.destroy_node()
    executor.shutdown(timeout_sec=SECONDS)


def test_functions_for_other_nodes(native_node: Any, adapter: Any, text: Any) -> None:
    from rosidl_adapter_proto import ros

    received, trigger = Received(), examples.adapter("std_srvs/srv/Trigger")
    ros.create_subscription(native_node, adapter, "functions", received.method, 10)
    publisher = connected(ros.create_publisher(native_node, adapter, "functions", 10))
    ros.create_service(native_node, trigger, "functions", lambda request, response: response)
    client = ros.create_client(native_node, trigger, "functions")

    publisher.publish(text("hello"))

    assert received.next() == text("hello")
    assert client.wait_for_service(SECONDS)
    assert client.call(trigger.request.custom_type(), SECONDS) == trigger.response.custom_type()


@pytest.mark.parametrize("has_mixin", [True, False], ids=["mixin", "functions"])
def test_lifecycle_nodes(
    ros: None, adapter: Any, text: Any, spin: Callable[..., Any], has_mixin: bool
) -> None:
    from rclpy.lifecycle import LifecycleNode, LifecyclePublisher

    from rosidl_adapter_proto import ros as ours

    class Managed(ours.NodeMixin, LifecycleNode):  # type: ignore[misc]
        pass

    node, received = spin((Managed if has_mixin else LifecycleNode)("managed")), Received()
    create = (
        node.create_lifecycle_publisher
        if has_mixin
        else functools.partial(ours.create_lifecycle_publisher, node)
    )
    publisher = create(adapter, "managed", 10)
    ours.create_subscription(node, adapter, "managed", received.method, 10)
    connected(publisher)

    assert isinstance(publisher, LifecyclePublisher)
    assert not publisher.is_activated
    publisher.publish(text("inactive"))
    publisher.publish("not even a message")
    node.trigger_configure()
    node.trigger_activate()
    assert publisher.is_activated
    publisher.publish(text("active"))
    assert received.next() == text("active")
    node.trigger_deactivate()
    publisher.publish(text("inactive again"))
    assert received.queue.empty()
    assert node.destroy_lifecycle_publisher(publisher)
    if has_mixin:
        assert (
            type(node.create_lifecycle_publisher(adapter.ros_message_type, "other", 10)) is LifecyclePublisher
        )


def test_a_mixin_before_a_class_of_the_user(ros: None, adapter: Any) -> None:
    import rclpy.node

    from rosidl_adapter_proto.ros import NodeMixin

    created = []

    class Tracing(rclpy.node.Node):
        def create_publisher(self, msg_type: Any, topic: str, *args: Any, **options: Any) -> Any:
            created.append(topic)
            return super().create_publisher(msg_type, topic, *args, **options)

    class Mixed(NodeMixin, Tracing):  # type: ignore[misc]
        pass

    node = Mixed("mixed")
    node.create_publisher(adapter, "traced", 10)
    node.destroy_node()
    assert created == ["/parameter_events", "traced"]


def test_a_mixin_behind_a_node_class(ros: None) -> None:
    from rclpy.node import Node

    from rosidl_adapter_proto.ros import NodeMixin

    with pytest.raises(TypeError) as raised:
        type("Wrong", (Node, NodeMixin), {})

    assert str(raised.value) == "class Wrong: NodeMixin has no effect behind a node class; put it first"


def test_conversion_errors_of_what_is_not_converted(node: Any, adapter: Any) -> None:
    for msg_type, options in ((adapter.ros_message_type, {}), (adapter, {"raw": True})):
        with pytest.raises(TypeError) as raised:
            node.create_subscription(msg_type, "topic", print, 10, on_conversion_error=print, **options)
        assert str(raised.value) == (
            "the subscription to topic converts nothing, so it takes no on_conversion_error; "
            "leave it out, or give an adapter and no `raw`"
        )


def test_a_node_destroyed_while_messages_arrive(native_node: Any, adapter: Any) -> None:
    from rosidl_adapter_proto.ros import Node

    publisher = native_node.create_publisher(adapter.ros_message_type, "flood", 1000)
    stop = threading.Event()

    def flood() -> None:
        while not stop.is_set():
            publisher.publish(adapter.ros_message_type(data="flood"))

    flooding = threading.Thread(target=flood)
    flooding.start()
    try:
        for round_number in range(5):
            node, received = Node("doomed"), Received()
            spinning = Spinning(node)
            node.create_subscription(adapter, "flood", received.method, 1000)
            received.next()
            if round_number % 2:
                node.destroy_node()
            spinning.stop()
    finally:
        stop.set()
        flooding.join(SECONDS)
