"""Services and clients against native ones in another process."""

from __future__ import annotations

import queue
from typing import Any

import pytest

from rosidl_adapter_proto.errors import ConversionError
from tests.ros import examples
from tests.ros.support import SECONDS, Peer, wait_until

KINDS = ("native", "protobuf")


@pytest.mark.parametrize("server", KINDS)
@pytest.mark.parametrize("client", KINDS)
def test_what_is_asked_is_answered(peer: Peer, node: Any, client: str, server: str) -> None:
    services = {name.replace("/", "_") + f"_{client}_{server}": name for name in examples.SERVICES}
    peer.ask("serve", kind=server, services=services)

    for service, name in services.items():
        adapter = examples.adapter(name)
        caller = node.create_client(examples.ros_class(name) if client == "native" else adapter, service)
        assert caller.wait_for_service(SECONDS)
        exchanges = examples.exchanges(name)
        if client == "protobuf":
            exchanges = examples.exchanges_as_protobuf(exchanges, adapter)
        for request, response in exchanges:
            answer = caller.call(request, timeout_sec=SECONDS)
            assert type(answer) is type(response)
            assert answer == response

    peer.ask("stop_serving", services=services)


@pytest.fixture
def set_bool(ros: None) -> Any:
    return examples.adapter("std_srvs/srv/SetBool")


def served(node: Any, adapter: Any, name: str, callback: Any, **options: Any) -> tuple[Any, Any]:
    """Return a service and a client of it, connected."""
    from rclpy.callback_groups import ReentrantCallbackGroup

    group = ReentrantCallbackGroup()
    service = node.create_service(adapter, name, callback, callback_group=group, **options)
    client = node.create_client(adapter, name, callback_group=group)
    assert client.wait_for_service(SECONDS)
    return service, client


def echo(request: Any, response: Any) -> Any:
    response.success = request.data
    return response


async def echo_later(request: Any, response: Any) -> Any:
    return echo(request, response)


def test_a_service_by_its_own_name(node: Any, set_bool: Any) -> None:
    from rosidl_proto.std_srvs.srv import SetBool

    asked: queue.Queue[Any] = queue.Queue()

    def answer(request: Any, response: Any) -> Any:
        asked.put((type(request), type(response)))
        return SetBool.Response(success=request.data)

    service, client = served(node, SetBool, "own_name", answer)
    assert service.adapter is client.adapter is set_bool
    assert client.call(SetBool.Request(data=True), SECONDS) == SetBool.Response(success=True)
    assert asked.get(timeout=SECONDS) == (SetBool.Request, SetBool.Response)


@pytest.mark.parametrize("callback", [echo, echo_later])
def test_futures(node: Any, set_bool: Any, callback: Any) -> None:
    request = set_bool.request.custom_type(data=True)
    _, client = served(node, set_bool, f"futures_{callback.__name__}", callback)

    future = client.call_async(request)
    done: queue.Queue[Any] = queue.Queue()
    future.add_done_callback(done.put)
    assert done.get(timeout=SECONDS) is future
    assert future.done()
    assert future.exception() is None
    assert future.result() is future.result()
    assert future.result() == set_bool.response.custom_type(success=True)

    async def await_response() -> Any:
        return await client.call_async(request)

    task = node.executor.create_task(await_response)
    wait_until(task.done)
    assert task.result() == set_bool.response.custom_type(success=True)


def test_futures_without_a_result(node: Any, set_bool: Any) -> None:
    client = node.create_client(set_bool, "nobody")
    future = client.call_async(set_bool.request.custom_type())

    assert not future.done()
    assert future.result() is None
    client.remove_pending_request(future)
    with pytest.raises(KeyError):
        client.get_pending_request(1)
    future.cancel()
    assert future.cancelled()
    assert future.exception() is None


def test_services_are_those_of_rclpy(node: Any, set_bool: Any) -> None:
    import rclpy.client
    import rclpy.service
    from rclpy.qos import qos_profile_services_default, qos_profile_system_default
    from rclpy.service_introspection import ServiceIntrospectionState

    service, client = served(node, set_bool, "introspected", echo)
    events: queue.Queue[Any] = queue.Queue()
    for each in (service, client):
        each.configure_introspection(
            node.get_clock(), qos_profile_system_default, ServiceIntrospectionState.CONTENTS
        )
    event_type = examples.ros_class("std_srvs/srv/SetBool").Event
    subscription = node.create_subscription(event_type, "introspected/_service_event", events.put, 10)
    wait_until(lambda: subscription.get_publisher_count() == 2)

    client.call(set_bool.request.custom_type(data=True), SECONDS)

    assert {events.get(timeout=SECONDS).info.event_type for _ in range(4)} == {0, 1, 2, 3}
    assert isinstance(service, rclpy.service.Service)
    assert isinstance(client, rclpy.client.Client)
    assert service.service_name == "/introspected"
    assert service.srv_type is client.srv_type is examples.ros_class("std_srvs/srv/SetBool")
    assert client.qos_profile == qos_profile_services_default
    assert node.destroy_service(service)
    assert node.destroy_client(client)


def test_native_messages_and_others(node: Any, set_bool: Any) -> None:
    native = examples.ros_class("std_srvs/srv/SetBool")
    service, client = served(
        node, set_bool, "lenient", lambda request, response: native.Response(success=request.data)
    )

    assert client.call(native.Request(data=True), SECONDS) == set_bool.response.custom_type(success=True)
    service.callback = echo
    assert client.call(native.Request(data=True), SECONDS) == set_bool.response.custom_type(success=True)
    for call in (client.call, client.call_async):
        with pytest.raises(
            TypeError, match=r"^the client of /lenient takes a protobuf message .*SetBool_Request .*int$"
        ):
            call(1)


def test_a_request_that_does_not_fit(node: Any) -> None:
    adapter = examples.adapter("test_msgs/srv/BasicTypes")
    client = node.create_client(adapter, "unfit")
    for call in (client.call, client.call_async):
        with pytest.raises(ConversionError, match=r"^test_msgs/srv/BasicTypes_Request\.int8_value: "):
            call(adapter.request.custom_type(int8_value=128))


def test_responses_have_default_values(node: Any) -> None:
    adapter = examples.adapter("test_msgs/srv/Arrays")
    _, client = served(node, adapter, "defaults", lambda request, response: response)
    answer = client.call(adapter.request.custom_type(), SECONDS)
    assert (
        adapter.response.convert_to_ros_message(answer)
        == examples.ros_class("test_msgs/srv/Arrays").Response()
    )


def picky(adapter: Any, part: str) -> Any:
    """Return the adapter of a service, with one for a part that converts nothing to protobuf."""
    part_adapter = getattr(adapter, part)

    def refuse(source: Any, destination: Any = None) -> Any:
        raise ConversionError(part_adapter.type_name, "data", "refused")

    refusing = type("Refusing", (part_adapter,), {"convert_to_custom": staticmethod(refuse)})
    return type("Picky", (adapter,), {part: refusing})


def test_requests_that_cannot_be_converted(
    node: Any, set_bool: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    errors: queue.Queue[Any] = queue.Queue()
    refusing = picky(set_bool, "request")
    service, client = served(node, refusing, "refusing", echo)
    _, handing_client = served(
        node, refusing, "handing", echo, on_conversion_error=lambda *each: errors.put(each)
    )

    unanswered = client.call_async(set_bool.request.custom_type())
    handing_client.call_async(set_bool.request.custom_type(data=True))

    error, request = errors.get(timeout=SECONDS)
    assert str(error) == "std_srvs/srv/SetBool_Request.data: refused"
    assert request == examples.ros_class("std_srvs/srv/SetBool").Request(data=True)
    wait_until(lambda: service.conversion_errors == 1)
    assert not unanswered.done()
    log = "dropped what came from a client of service refusing: std_srvs/srv/SetBool_Request.data: refused"
    wait_until(lambda: log in capfd.readouterr().err, "the log")


def test_responses_that_cannot_be_converted(node: Any, set_bool: Any) -> None:
    _, client = served(node, picky(set_bool, "response"), "refused", echo)

    future = client.call_async(set_bool.request.custom_type())
    wait_until(future.done)

    assert isinstance(future.exception(), ConversionError)
    with pytest.raises(ConversionError, match="refused"):
        future.result()
    with pytest.raises(ConversionError, match="refused"):
        client.call(set_bool.request.custom_type(), SECONDS)
