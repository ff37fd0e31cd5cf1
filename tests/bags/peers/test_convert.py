"""What others read in bags that were converted."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from ros_types import protobuf_message, random_value, same_message
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from tests.bags.recordings import START, cdr, types_of

pytestmark = pytest.mark.usefixtures("folder")


def write_bag(folder: Path, storage: str) -> dict[str, list[dict[str, Any]]]:
    """Write a bag with messages of every type with rosbags, and return their values."""
    store = get_typestore(Stores.ROS2_KILTED)
    registry = TypeRegistry(Catalog((store_source("kilted"),)))
    values: dict[str, list[dict[str, Any]]] = {}
    with Writer(folder, version=8, storage_plugin=StoragePlugin[storage.upper()]) as writer:
        for name in sorted(store.types):
            if name not in registry:
                continue
            schema, rng = registry[name], random.Random(name)
            connection = writer.add_connection(f"/{name}", name, typestore=store)
            values[name] = [random_value(types_of(schema), name, rng) for _ in range(2)]
            for index, value in enumerate(values[name]):
                writer.write(connection, START + index, cdr(schema, value))
    return values


def read_with_rosbags(path: Path) -> list[tuple[str, str, int, bytes]]:
    """Return topic, type, time and data of every message."""
    with AnyReader([path]) as reader:
        return [(each.topic, each.msgtype, time, data) for each, time, data in reader.messages()]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_every_message_is_what_it_was(storage: str) -> None:
    values = write_bag(Path("in"), storage)
    count = 2 * len(values)
    assert convert_bag("in", "there.mcap").total.converted == count > 300
    assert convert_bag("there.mcap", "back", storage=storage).total.converted == count

    registry = TypeRegistry(Catalog((store_source("kilted"),)))
    with Path("there.mcap").open("rb") as file:
        decoded = list(make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    assert len(decoded) == count
    for _, channel, message, found in decoded:
        schema = registry[channel.topic[1:]]
        value = values[schema.type_name][message.log_time - START]
        expected = protobuf_message(types_of(schema), schema.type_name, value, schema.message_class())
        assert found.DESCRIPTOR.full_name == schema.message_class.DESCRIPTOR.full_name
        assert same_message(found, expected)

    before, after = read_with_rosbags(Path("in")), read_with_rosbags(Path("back"))
    assert len(before) == count and sorted(after) == sorted(before)
