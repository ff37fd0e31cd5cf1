"""What time series of messages cost: a parser plugin in our host, against protobuf or rosbags and Python.

    python benchmarks/plotjuggler.py

needs the environment of the tests. Every row is a ratio: its two sides are measured in one run, taking turns, and the
fastest turn of each counts. All sides make a column of every number and text of the messages.
"""

from __future__ import annotations

import tempfile
from array import array
from collections.abc import Callable, Iterable
from itertools import accumulate
from pathlib import Path
from typing import Any

from bag_maker import IMU, JOINT_STATES, TF, Stream, record, typestore, write_mcap
from timing import seconds

from rosidl_adapter_proto.bags.bag import open_bag
from rosidl_adapter_proto.bags.types import protobuf_definition
from rosidl_adapter_proto.plotjuggler.host import Parser, open_plugin
from rosidl_adapter_proto.plotjuggler.plugins import plugin_path
from rosidl_adapter_proto.transcode import Transcoder

COUNT = 10_000
TURNS = 10
MICROSECONDS = 3
RATIO = 3


def joined(messages: list[bytes]) -> tuple[bytes, array[int]]:
    """Return messages as a batch has them."""
    ends = list(accumulate(map(len, messages)))
    return b"".join(messages), array(
        "Q", [edge for pair in zip([0, *ends], ends, strict=False) for edge in pair]
    )


def flatten_protobuf(messages: Iterable[Any]) -> dict[str, list[Any]]:
    """Make columns of messages of protobuf, in Python."""
    columns: dict[str, list[Any]] = {}

    def add(key: str, value: Any) -> None:
        if hasattr(value, "DESCRIPTOR"):
            for field in value.DESCRIPTOR.fields:
                add(f"{key}/{field.name}", getattr(value, field.name))
        elif isinstance(value, (int, float, str)):
            columns.setdefault(key, []).append(value)
        else:
            for index, each in enumerate(value):
                add(f"{key}[{index}]", each)

    for message in messages:
        add("", message)
    return columns


def flatten_rosbags(messages: Iterable[Any]) -> dict[str, list[Any]]:
    """Make columns of messages of rosbags, in Python."""
    columns: dict[str, list[Any]] = {}

    def add(key: str, value: Any) -> None:
        if hasattr(value, "__msgtype__"):
            for name in value.__dataclass_fields__:
                if name != "__msgtype__":
                    add(f"{key}/{name}", getattr(value, name))
        elif isinstance(value, (int, float, str)):
            columns.setdefault(key, []).append(value)
        else:
            for index, each in enumerate(value.tolist() if hasattr(value, "tolist") else value):
                add(f"{key}[{index}]", each)

    for message in messages:
        add("", message)
    return columns


def in_host(parser: Parser, messages: list[bytes]) -> Callable[[], object]:
    """Return what parses messages in a batch."""
    data, ranges = joined(messages)
    return lambda: parser.parse_batch(data, ranges)


def rows(folder: Path, stream: Stream) -> None:
    """Measure one type, and print its rows."""
    path = folder / f"{stream.topic[1:]}.mcap"
    recorded = list(record([stream], COUNT / stream.rate))
    write_mcap(path, recorded)
    cdr = [each.data for each in recorded]
    with open_bag(path) as bag:
        schema = bag.schema(stream.topic)
        text = bag.topics[stream.topic].definition.data
    protobuf = list(
        map(bytes, Transcoder(schema.type_description, schema.descriptor).cdr_to_proto_batch(cdr))
    )
    message_class = schema.message_class
    store = typestore()
    ros2msg = open_plugin(plugin_path("ros2msg")).parser(stream.topic, stream.type_name, text)
    flat = open_plugin(plugin_path("protobuf")).parser(
        stream.topic, schema.descriptor.full_name, protobuf_definition(schema).data
    )
    from_cdr, from_protobuf, python_cdr, python_protobuf = seconds(
        in_host(ros2msg, cdr),
        in_host(flat, protobuf),
        lambda: flatten_rosbags(store.deserialize_cdr(each, stream.type_name) for each in cdr),
        lambda: flatten_protobuf(map(message_class.FromString, protobuf)),
        turns=TURNS,
    )
    name = stream.type_name.rpartition("/")[2]
    wanted = (MICROSECONDS, RATIO) if stream is IMU else ("", "")
    show(f"{name}, CDR", "rosbags, flattened in Python", from_cdr, python_cdr, *wanted)
    show(f"{name}, protobuf", "protobuf, flattened in Python", from_protobuf, python_protobuf, *wanted)


def show(work: str, against: str, ours: float, theirs: float, most: object, least: object) -> None:
    wanted = f"<= {most} us, >= {least}" if most else ""
    times = f"{ours / COUNT * 1e6:8.2f} {theirs / COUNT * 1e6:8.2f}"
    print(f"{work:24} {against:32} {times} {theirs / ours:7.1f}  {wanted}", flush=True)


def main() -> None:
    """Measure, and print the table."""
    print(f"{'work':24} {'against':32} {'us':>8} {'against':>8} {'ratio':>7}  wanted")
    with tempfile.TemporaryDirectory() as folder:
        for stream in (IMU, JOINT_STATES, TF):
            rows(Path(folder), stream)


if __name__ == "__main__":
    main()
