"""What tables of messages cost, against the fastest way through protobuf and against what people do today.

    python benchmarks/tables.py

needs the environment of the tests, with ptars and pandas. Every row is a ratio: its two sides are measured in one run,
taking turns, and the fastest turn of each counts.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pandas
import ptars
from bag_maker import IMU, JOINT_STATES, SCAN, Stream, record, write_mcap
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from timing import seconds

from rosidl_adapter_proto.bags.bag import open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.table import record_batches, write_table
from rosidl_adapter_proto.transcode import Transcoder
from rosidl_adapter_proto.transcode.arrow import ColumnReader

COUNT = 10_000
TURNS = 20
WANTED = 5


def show(work: str, against: str, ours: float, theirs: float, count: int, wanted: str = "") -> None:
    rates = f"{count / ours:12,.0f} {count / theirs:12,.0f}"
    print(f"{work:38} {against:44} {rates} {theirs / ours:7.1f}  {wanted}", flush=True)


def data_frame(path: Path, topic: str) -> Any:
    """Make a data frame as people do with rosbags: a row is a dictionary of all fields."""

    def row(message: Any, prefix: str = "") -> dict[str, Any]:
        values: dict[str, Any] = {}
        for name, value in vars(message).items():
            if hasattr(value, "__msgtype__"):
                values |= row(value, f"{prefix}{name}.")
            elif name != "__msgtype__":
                values[prefix + name] = value
        return values

    with AnyReader([path]) as reader:
        connections = [each for each in reader.connections if each.topic == topic]
        return pandas.DataFrame(
            row(reader.deserialize(data, connection.msgtype))
            for connection, _, data in reader.messages(connections)
        )


def messages_of(path: Path) -> list[bytes]:
    """Return the messages of a file as the mcap library reads them."""
    with path.open("rb") as file:
        return [message.data for _, _, message in make_reader(file).iter_messages()]


def rows(folder: Path, stream: Stream) -> None:
    """Measure one type, and print its rows."""
    path = folder / f"{stream.topic[1:]}.mcap"
    recorded = list(record([stream], COUNT / stream.rate))
    write_mcap(path, recorded, compression="zstd")
    cdr = [each.data for each in recorded]
    bag = open_bag(path)
    schema = bag.schema(stream.topic)
    transcoder = Transcoder(schema.type_description, schema.descriptor)
    handler = ptars.HandlerPool([schema.descriptor.file]).get_for_message(schema.descriptor)
    protobuf = list(map(bytes, transcoder.cdr_to_proto_batch(cdr)))
    from_cdr, from_protobuf = ColumnReader(schema), ColumnReader(schema, serialization_format="protobuf")

    name = stream.type_name.rpartition("/")[2]
    ours, ours_protobuf, theirs, transcoded = seconds(
        lambda: list(from_cdr.record_batches(cdr)),
        lambda: list(from_protobuf.record_batches(protobuf)),
        lambda: handler.list_to_record_batch(protobuf),
        lambda: handler.list_to_record_batch(list(map(bytes, transcoder.cdr_to_proto_batch(cdr)))),
        turns=TURNS,
    )
    show(
        f"{name}, CDR to record batches",
        "CDR, our transcoder, ptars",
        ours,
        transcoded,
        COUNT,
        f">= {WANTED}",
    )
    show("", "protobuf, ptars", ours, theirs, COUNT)
    show(f"{name}, protobuf to record batches", "protobuf, ptars", ours_protobuf, theirs, COUNT)

    def to_parquet() -> None:
        output = folder / "table.parquet"
        write_table(bag, stream.topic, output)
        output.unlink()

    converted = folder / f"{stream.topic[1:]}_protobuf.mcap"
    convert_bag(path, converted, target_format="protobuf")
    read, written, through_protobuf, framed = seconds(
        lambda: [batch.num_rows for batch in record_batches(bag, stream.topic)],
        to_parquet,
        lambda: handler.list_to_record_batch(messages_of(converted)),
        lambda: data_frame(path, stream.topic),
        turns=TURNS,
    )
    # Large messages are as fast as chunks are decompressed.
    wanted = "" if stream is SCAN else f">= {WANTED}"
    show(
        f"{name}, bag to record batches",
        "bag of protobuf, mcap library, ptars",
        read,
        through_protobuf,
        COUNT,
        wanted,
    )
    show("", "rosbags, pandas.DataFrame", read, framed, COUNT)
    show(f"{name}, bag to Parquet", "rosbags, pandas.DataFrame", written, framed, COUNT)


def main() -> None:
    """Measure, and print the table."""
    print(f"{'work':38} {'against':44} {'messages/s':>12} {'against':>12} {'ratio':>7}  wanted")
    with tempfile.TemporaryDirectory() as folder:
        for stream in (IMU, JOINT_STATES, SCAN):
            rows(Path(folder), stream)


if __name__ == "__main__":
    main()
