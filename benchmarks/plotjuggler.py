"""What parsing messages with plugins of PlotJuggler costs in the host, and series of a bag.

    python benchmarks/plotjuggler.py

needs `[plotjuggler]`. Every row has microseconds a message and a ratio: both sides are measured in one run, taking
turns, and the fastest turn of each counts.
"""

from __future__ import annotations

import array
import tempfile
from collections.abc import Callable
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Any

from bag_maker import IMU, JOINT_STATES, SCAN, TF, Stream, record, write_mcap
from google.protobuf.descriptor import FieldDescriptor
from timing import seconds

from rosidl_adapter_proto.bags.bag import Bag, open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.plotjuggler.host import ArrayPolicy
from rosidl_adapter_proto.plotjuggler.series import read_series
from rosidl_adapter_proto.plotjuggler.topic_parsers import TopicParsers

COUNT = 20_000
BY_HAND = 1_000
WANTED = {IMU: "<= 3 us, >= 3"}
EVERYTHING = ArrayPolicy(clamp=True, maximum=10_000)


def flatten(message: Any, prefix: str, pairs: list[tuple[str, Any]]) -> None:
    """Flatten a protobuf message as one does in Python, without the types of values."""
    for field in message.DESCRIPTOR.fields:
        value, key = getattr(message, field.name), f"{prefix}/{field.name}"
        is_message = field.type == FieldDescriptor.TYPE_MESSAGE
        if not field.is_repeated:
            if is_message:
                flatten(value, key, pairs)
            else:
                pairs.append((key, value))
        elif is_message:
            for index, each in enumerate(value):
                flatten(each, f"{key}[{index}]", pairs)
        else:
            pairs.extend((f"{key}[{index}]", each) for index, each in enumerate(value))


def by_hand(message_class: Any, messages: list[bytes]) -> None:
    for data in messages:
        flatten(message_class.FromString(data), "", [])


def batch_of(bag: Bag, topic: str) -> tuple[list[bytes], Callable[[], object]]:
    """Return the messages of a topic, and what parses them in one batch."""
    messages = [each.data for each in bag.messages(topic)]
    parser = TopicParsers(bag.types, None, EVERYTHING).parser(bag.topics[topic])
    ends = [0, *accumulate(map(len, messages))]
    ranges = array.array("Q", [place for pair in pairwise(ends) for place in pair])
    data, places = memoryview(b"".join(messages)), _numbers(ranges)
    return messages, lambda: parser.parse(data, places)


def _numbers(ranges: array.array[int]) -> Any:
    import numpy

    return numpy.frombuffer(ranges, numpy.uint64).reshape(-1, 2)


def rows(folder: Path, stream: Stream, count: int) -> None:
    """Measure one type, and print its rows."""
    path, converted = folder / "cdr.mcap", folder / "protobuf.mcap"
    write_mcap(path, record([stream], count / stream.rate))
    convert_bag(path, converted, target_format="protobuf")
    cdr, protobuf = open_bag(path), open_bag(converted)
    _, from_cdr = batch_of(cdr, stream.topic)
    messages, from_protobuf = batch_of(protobuf, stream.topic)
    message_class = protobuf.schema(stream.topic).message_class
    few = messages[:BY_HAND]
    ours_cdr, ours_protobuf, python = seconds(
        from_cdr, from_protobuf, lambda: by_hand(message_class, few), turns=10
    )
    name, wanted = stream.type_name.rpartition("/")[2], WANTED.get(stream, "")
    theirs = python / len(few)
    show(f"{name}, protobuf.wasm, in batches", ours_protobuf / count, theirs, wanted)
    show(f"{name}, ros2msg.wasm, in batches", ours_cdr / count, theirs, wanted)
    path.unlink()
    converted.unlink()


def bag_rows(folder: Path) -> None:
    """Measure the series of a whole bag, and print its row."""
    path = folder / "bag.mcap"
    streams, length = (IMU, JOINT_STATES, TF), 300
    messages = list(record(streams, length))
    write_mcap(path, messages, compression="zstd")
    bag = open_bag(path)

    def python() -> None:
        for each in bag.messages():
            flatten(each.message, "", [])

    ours, theirs = seconds(lambda: read_series(bag), python, turns=3)
    show("series of a bag: Imu, JointState, TF", ours / len(messages), theirs / len(messages), "")


def show(work: str, ours: float, theirs: float, wanted: str) -> None:
    times = f"{ours * 1e6:9.2f} us {theirs * 1e6:9.2f} us"
    print(f"{work:40} {times} {theirs / ours:7.1f}  {wanted}", flush=True)


def main() -> None:
    """Measure, and print the table."""
    print(f"{'work':40} {'a message':>12} {'in Python':>12} {'ratio':>7}  wanted")
    with tempfile.TemporaryDirectory() as folder:
        rows(Path(folder), IMU, COUNT)
        rows(Path(folder), TF, COUNT // 4)
        rows(Path(folder), SCAN, COUNT // 20)
        bag_rows(Path(folder))


if __name__ == "__main__":
    main()
