"""Every type of the ROS wheels: both plugins have the series that an independent flattening has."""

from __future__ import annotations

import random
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy
import pytest
from mcap.writer import CompressionType, Writer
from ros_types import installed_messages, installed_types, random_value, ros_object

from rosidl_adapter_proto import TypeRegistry, open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.types import ros_definition
from rosidl_adapter_proto.plotjuggler.host import open_plugin
from rosidl_adapter_proto.plotjuggler.series import Series, read_series
from tests.plotjuggler.flattening import FlatPair, flatten_ros

MESSAGES = 5
Collected = dict[tuple[str, str, str], tuple[list[int], list[Any]]]


@pytest.fixture(scope="module")
def flattened(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Collected]:
    """A bag with random messages of every type, each on the topic of its name, and their series."""
    serialization = pytest.importorskip("rclpy.serialization", reason="needs a ROS installation")
    path = tmp_path_factory.mktemp("every_type") / "bag.mcap"
    registry, types = TypeRegistry(events=True), installed_types()
    expected: Collected = {}
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start(profile="ros2")
        for name in installed_messages():
            definition = ros_definition(registry[name])
            schema = writer.register_schema(name, definition.encoding, definition.data)
            channel = writer.register_channel(f"/{name}", "cdr", schema)
            rng = random.Random(name)
            for time in range(MESSAGES):
                message = ros_object(types, name, random_value(types, name, rng))
                writer.add_message(channel, time, serialization.serialize_message(message), time)
                add(expected, f"/{name}", time, flatten_ros(message))
        writer.finish()  # type: ignore[no-untyped-call]
    return path, expected


def add(collected: Collected, topic: str, time: int, pairs: Iterable[FlatPair]) -> None:
    for key, kind, value in pairs:
        times, values = collected.setdefault((topic, key, kind), ([], []))
        times.append(time)
        values.append(value)


def difference(found: Iterable[Series], expected: Collected) -> list[object]:
    """Return which series are not as expected, bit by bit."""
    missing = dict(expected)
    wrong: list[object] = []
    for series in found:
        key = series.topic, series.key, series.type_name
        times, values = missing.pop(key, ([], []))
        if isinstance(series.values, list):
            is_same = series.values == values
        else:
            is_same = series.values.tobytes() == numpy.array(values, series.values.dtype).tobytes()
        if series.times.tolist() != times or not is_same:
            wrong.append((key, series.times, series.values, times, values))
    return [*wrong, *missing.items()]


def test_ros2msg(flattened: tuple[Path, Collected], plugin_files: dict[str, Path]) -> None:
    path, expected = flattened
    found = read_series(open_bag(path), plugin=open_plugin(plugin_files["ros2msg"]))
    assert found.warnings == ()
    assert difference(found.series, expected) == []


def test_protobuf(flattened: tuple[Path, Collected], plugin_files: dict[str, Path], tmp_path: Path) -> None:
    path, expected = flattened
    convert_bag(path, tmp_path / "protobuf.mcap", target_format="protobuf")
    bag = open_bag(tmp_path / "protobuf.mcap")
    found = read_series(bag, plugin=open_plugin(plugin_files["protobuf"]))
    assert found.warnings == ()
    assert difference(found.series, expected) == []
