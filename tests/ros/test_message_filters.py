"""ROS's message_filters with protobuf messages: the installed package, and what stands for it where there is none."""

from __future__ import annotations

import importlib.util
import queue
from collections.abc import Callable
from typing import Any

import pytest

from tests.ros import examples
from tests.ros.support import SECONDS, wait_until

IMU, IMAGE, STRING = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Image", "std_msgs/msg/String"


@pytest.fixture(params=["installed", "stand-in"])
def filters(ros: None, request: pytest.FixtureRequest) -> Any:
    """The module message_filters."""
    if request.param == "stand-in":
        return importlib.import_module("tests.ros.stand_in.message_filters")
    return pytest.importorskip("message_filters", reason="needs message_filters of a ROS installation")


def stamped(type_name: str, nanoseconds: int) -> Any:
    """Return a ROS message with a stamp."""
    message = examples.ros_class(type_name)()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(nanoseconds, 10**9)
    return message


def published(node: Any, topic: str, type_name: str, messages: list[Any]) -> None:
    """Publish ROS messages to the one subscription of a topic."""
    publisher = node.create_publisher(examples.ros_class(type_name), topic, 10)
    wait_until(publisher.get_subscription_count, f"a subscription to {topic}")
    for message in messages:
        publisher.publish(message)


def custom_type(type_name: str) -> Any:
    return examples.adapter(type_name).custom_type


@pytest.fixture
def received() -> queue.Queue[Any]:
    return queue.Queue()


@pytest.mark.parametrize("given", [examples.adapter, custom_type], ids=["adapter", "protobuf class"])
def test_messages_of_the_same_time(
    filters: Any, node: Any, native_node: Any, received: Any, given: Callable[[str], Any]
) -> None:
    subscribers = [filters.Subscriber(node, given(name), f"same_{name[-3:]}") for name in (IMU, IMAGE)]
    synchronizer = filters.TimeSynchronizer(subscribers, 10)
    synchronizer.registerCallback(lambda *messages: received.put(messages))
    published(native_node, "same_Imu", IMU, [stamped(IMU, 1), stamped(IMU, 5 * 10**9 + 7)])
    published(native_node, "same_age", IMAGE, [stamped(IMAGE, 5 * 10**9 + 7)])
    imu, image = received.get(timeout=SECONDS)
    assert (type(imu), type(image)) == (custom_type(IMU), custom_type(IMAGE))
    assert (imu.header.stamp.sec, imu.header.stamp.nanosec) == (5, 7)
    assert imu.header.stamp == image.header.stamp


def test_messages_of_about_the_same_time(filters: Any, node: Any, native_node: Any, received: Any) -> None:
    """One topic has protobuf messages and one those of ROS, as in a node that is being ported."""
    subscribers = [
        filters.Subscriber(node, custom_type(IMU), "about_imu"),
        filters.Subscriber(node, examples.ros_class(IMAGE), "about_image"),
    ]
    synchronizer = filters.ApproximateTimeSynchronizer(subscribers, 10, 0.05)
    synchronizer.registerCallback(lambda *messages: received.put(messages))
    published(native_node, "about_imu", IMU, [stamped(IMU, 10**9), stamped(IMU, 2 * 10**9)])
    published(native_node, "about_image", IMAGE, [stamped(IMAGE, 2 * 10**9 + 40_000_000)])
    imu, image = received.get(timeout=SECONDS)
    assert (type(imu), type(image)) == (custom_type(IMU), examples.ros_class(IMAGE))
    assert (imu.header.stamp.sec, image.header.stamp.nanosec) == (2, 40_000_000)


def test_messages_without_a_header(filters: Any, node: Any, native_node: Any, received: Any) -> None:
    subscriber = filters.Subscriber(node, custom_type(STRING), "headerless")
    synchronizer = filters.ApproximateTimeSynchronizer([subscriber], 10, 1, allow_headerless=True)
    synchronizer.registerCallback(received.put)
    published(native_node, "headerless", STRING, [examples.ros_class(STRING)(data="text")])
    assert received.get(timeout=SECONDS) == custom_type(STRING)(data="text")


def test_a_cache(filters: Any, node: Any, native_node: Any, received: Any) -> None:
    from rclpy.clock_type import ClockType
    from rclpy.time import Time

    def time(seconds: int) -> Time:
        return Time(seconds=seconds, clock_type=ClockType.ROS_TIME)

    cache = filters.Cache(filters.Subscriber(node, custom_type(IMU), "cached"), cache_size=3)
    cache.registerCallback(received.put)
    published(native_node, "cached", IMU, [stamped(IMU, second * 10**9) for second in range(1, 5)])
    messages = [received.get(timeout=SECONDS) for _ in range(4)]
    assert cache.getInterval(time(1), time(3)) == messages[1:3]
    assert cache.getElemBeforeTime(time(9)) is messages[3]
    assert all(type(message) is custom_type(IMU) for message in messages)


@pytest.mark.parametrize("name", ["Subscriber", "OldSubscriber"])
def test_subscribers(filters: Any, node: Any, native_node: Any, received: Any, name: str) -> None:
    if not hasattr(filters, name):
        pytest.skip("the installed one is one of them")
    subscriber = getattr(filters, name)(node, custom_type(IMU), f"subscribed_{name}", qos_profile=5)
    subscriber.registerCallback(received.put)
    assert subscriber.getTopic() == subscriber.topic == f"subscribed_{name}"
    assert subscriber.adapter is examples.adapter(IMU)
    assert subscriber.msg_type is examples.ros_class(IMU)
    published(native_node, subscriber.topic, IMU, [stamped(IMU, 3)])
    assert received.get(timeout=SECONDS).header.stamp.nanosec == 3
