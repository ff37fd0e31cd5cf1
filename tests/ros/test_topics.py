"""Publishers and subscriptions against native ones in another process."""

from __future__ import annotations

from typing import Any

import pytest

from tests.ros import examples
from tests.ros.support import Peer, wait_until

KINDS = ("native", "protobuf")


@pytest.mark.parametrize("listener", KINDS)
@pytest.mark.parametrize("talker", KINDS)
def test_what_is_sent_arrives(peer: Peer, node: Any, talker: str, listener: str) -> None:
    topics = {name.replace("/", "_") + f"_{talker}_{listener}": name for name in examples.message_types()}
    peer.ask("listen", kind=listener, topics=topics)
    publishers = {
        topic: node.create_publisher(
            examples.ros_class(name) if talker == "native" else examples.adapter(name), topic, 100
        )
        for topic, name in topics.items()
    }

    for topic, name in topics.items():
        wait_until(publishers[topic].get_subscription_count, topic)
        to_publish = examples.messages(name)
        if talker == "protobuf":
            custom_type = examples.adapter(name).custom_type
            to_publish = [examples.as_protobuf(message, custom_type) for message in to_publish]
        for message in to_publish:
            publishers[topic].publish(message)

    assert peer.ask("heard", topics=topics) == {}


def test_ten_thousand_messages(peer: Peer, node: Any) -> None:
    from rclpy.qos import QoSProfile

    peer.ask("listen", kind="protobuf", topics={"many": "std_msgs/msg/String"})
    adapter = examples.adapter("std_msgs/msg/String")
    publisher = node.create_publisher(adapter, "many", QoSProfile(depth=20_000))
    wait_until(publisher.get_subscription_count)

    for number in range(10_000):
        publisher.publish(adapter.custom_type(data=str(number)))

    assert peer.ask("count", topic="many", expected=10_000) == list(range(10_000))


def test_a_large_message(peer: Peer, node: Any) -> None:
    size = 25_000_000
    peer.ask("listen", kind="protobuf", topics={"large": "sensor_msgs/msg/Image"})
    adapter = examples.adapter("sensor_msgs/msg/Image")
    publisher = node.create_publisher(adapter, "large", 10)
    wait_until(publisher.get_subscription_count)

    publisher.publish(adapter.custom_type(data=bytes(size)))
    publisher.publish(adapter.custom_type(data=bytes(size + 1)))

    assert peer.ask("count", topic="large", expected=2) == [size, size + 1]
