"""What bags are read as, against other readers of MCAP."""

from __future__ import annotations

from pathlib import Path

import mcap_protobuf.decoder
import mcap_ros2.decoder
import pytest
from mcap.reader import make_reader

from benchmarks import bag_maker
from benchmarks.bag_maker import IMU, JOINT_STATES, SCAN, SMALL_IMAGE, TF, record
from rosidl_adapter_proto import open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from tests.bags.values import assert_same_values


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second of some topics, some messages of which arrived late."""
    path = tmp_path_factory.mktemp("bag") / "bag.mcap"
    messages = record([IMU, JOINT_STATES, SCAN, SMALL_IMAGE, TF], 1)
    late = sorted(messages, key=lambda each: each.log_time + each.log_time % 7 * 10**8)
    bag_maker.write_mcap(path, late, compression="lz4", chunk_size=10_000)
    return path


def test_messages_are_those_of_mcap_ros2_support(path: Path) -> None:
    with open_bag(path) as bag, path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
        for ours, theirs in zip(bag.messages(), reader.iter_decoded_messages(), strict=True):
            assert (ours.topic, ours.log_time) == (theirs.channel.topic, theirs.message.log_time)
            assert (ours.publish_time, ours.sequence) == (
                theirs.message.publish_time,
                theirs.message.sequence,
            )
            assert_same_values(ours.message, theirs.decoded_message)


def test_protobuf_messages_are_those_of_mcap_protobuf_support(path: Path, tmp_path: Path) -> None:
    converted = tmp_path / "protobuf.mcap"
    convert_bag(path, converted, target_format="protobuf")
    with open_bag(converted) as bag, converted.open("rb") as file:
        reader = make_reader(file, decoder_factories=[mcap_protobuf.decoder.DecoderFactory()])
        for ours, theirs in zip(bag.messages(), reader.iter_decoded_messages(), strict=True):
            assert (ours.topic, ours.log_time) == (theirs.channel.topic, theirs.message.log_time)
            assert ours.message.SerializeToString(
                deterministic=True
            ) == theirs.decoded_message.SerializeToString(deterministic=True)
