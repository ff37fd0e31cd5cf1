"""What converting and reading bags costs, against what one does today, and against what any program has to do.

    python benchmarks/bags.py

Every row is a ratio: its sides are measured in one run, taking turns, and the fastest turn of each counts. Bags are
made from a seed (`bag_maker.py`). They are kept in memory where Linux has a file system for that: the speed of the disk
is not what is measured.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import bag_maker
import bag_peers
from bag_maker import IMAGE, IMU, JOINT_STATES, POINTS, SCAN, TF
from messages import Row
from timing import seconds

from rosidl_adapter_proto import adapter_for, open_bag
from rosidl_adapter_proto.bags.convert import convert_bag

SMALL_SECONDS = 1500
LARGE_SECONDS = 15
BY_HAND = 20_000
"""So many messages are converted or decoded by the slow ways; what is compared is messages per second."""
MEMORY = Path("/dev/shm")
COMPRESSIONS = ("", "lz4", "zstd")


def convert(source: Path, destination: Path, threads: int | None = None) -> None:
    convert_bag(source, destination, target_format="protobuf", threads=threads)


def small_rows(folder: Path) -> Iterator[Row]:
    """Yield what converting small messages costs."""
    messages = list(bag_maker.record([IMU, JOINT_STATES, TF], SMALL_SECONDS))
    for compression in COMPRESSIONS:
        bag_maker.write_mcap(folder / f"small{compression}.mcap", messages, compression=compression)
    written = folder / "written"
    out = written / "out.mcap"

    source = folder / "small.mcap"
    classes = {name: adapter_for(name).custom_type for name in bag_peers.COPIES}
    ours, by_hand = seconds(
        lambda: convert(source, out),
        lambda: bag_peers.convert_by_hand(source, out, classes, BY_HAND),
        folder=written,
    )
    ratio = (len(messages) / ours) / (BY_HAND / by_hand)
    yield Row("small messages: messages a second", "rosbags + attribute copy + mcap writer", ratio, ">= 50")
    convert(source, out)
    yield Row(
        "small messages: bytes", "the same messages in CDR", out.stat().st_size / source.stat().st_size, ""
    )
    out.unlink()

    for compression in COMPRESSIONS:
        source = folder / f"small{compression}.mcap"
        kind = compression or "not compressed"
        ours, loop = seconds(
            lambda source=source: convert(source, out),
            lambda source=source, compression=compression: bag_peers.copy_chunks(source, out, compression, 1),
            folder=written,
        )
        against = "a loop that unpacks and packs their chunks"
        yield Row(f"small messages, {kind}: times", against, ours / loop, "<= 1.5")
        for threads in sorted({1, os.cpu_count() or 1}):
            ours, chunks = seconds(
                lambda source=source, threads=threads: convert(source, out, threads),
                lambda source=source, compression=compression, threads=threads: bag_peers.copy_chunks(
                    source, out, compression, threads
                ),
                folder=written,
            )
            on = f"{threads} thread{'s' * (threads > 1)}"
            yield Row(f"small messages, {kind}, {on}: times", f"the same on {on}", ours / chunks, "")


def large_rows(folder: Path) -> Iterator[Row]:
    """Yield what converting images and clouds costs."""
    messages = list(bag_maker.record([IMAGE, POINTS], LARGE_SECONDS))
    written = folder / "written"
    out = written / "out.mcap"
    for compression in ("", "zstd"):
        source = folder / f"large{compression}.mcap"
        bag_maker.write_mcap(source, messages, compression=compression)
        ours, copy = seconds(
            lambda source=source: convert(source, out),
            lambda source=source, compression=compression: bag_peers.copy_with_library(
                source, out, compression
            ),
            folder=written,
        )
        work = f"images and clouds, {compression or 'not compressed'}: times"
        yield Row(work, "copying with the mcap library", ours / copy, "<= 1.2")


def sqlite3_rows(folder: Path) -> Iterator[Row]:
    """Yield what converting sqlite3 costs."""
    messages = bag_maker.record([IMU, JOINT_STATES, TF], SMALL_SECONDS / 10)
    bag_maker.write_folder(folder / "small", messages)
    (source,) = (folder / "small").glob("*.db3")
    written = folder / "written"
    out = written / "out.db3"
    ours, rows = seconds(
        lambda: convert(source, out), lambda: bag_peers.copy_rows(source, out), folder=written
    )
    yield Row("small messages, sqlite3: times", "copying the rows", ours / rows, "")


def reading_rows(folder: Path) -> Iterator[Row]:
    """Yield what reading messages costs."""
    for name, stream, length, stamp in (
        ("Imu", IMU, 500, "header.stamp"),
        ("TFMessage", TF, 1000, "transforms.header.stamp"),
        ("LaserScan 720", SCAN, 1000, "header.stamp"),
        ("Image 1920x1080", IMAGE, 30, "header.stamp"),
        ("PointCloud2", POINTS, 60, "header.stamp"),
    ):
        source = folder / "read.mcap"
        bag_maker.write_mcap(source, bag_maker.record([stream], length))
        yield from reading_rows_of(source, name, length * stream.rate, stamp)


def reading_rows_of(source: Path, name: str, count: int, stamp: str) -> Iterator[Row]:
    few = min(count, 5000)  # mcap-ros2-support is slow
    ours, stamps, rosbags, mcap_ros2 = seconds(
        lambda: read(source),
        lambda: read(source, [stamp]),
        lambda: bag_peers.read_with_rosbags(source, count),
        lambda: bag_peers.read_with_mcap_ros2(source, few),
    )
    yield Row(f"{name}: messages of run-time types", "rosbags", rosbags / ours, "")
    ratio = (count / ours) / (few / mcap_ros2)
    yield Row(f"{name}: messages of run-time types", "mcap-ros2-support", ratio, "")
    yield Row(f"{name}: only stamps", "all of the messages", ours / stamps, "")


def read(source: Path, fields: list[str] | None = None) -> None:
    with open_bag(source) as bag:
        for recorded in bag.messages(fields=fields):
            recorded.message  # noqa: B018


def main() -> None:
    """Measure, and print the table."""
    place = str(MEMORY) if MEMORY.is_dir() else None
    with tempfile.TemporaryDirectory(dir=place) as folder:
        Path(folder, "written").mkdir()
        print(f"{'work':52} {'against':42} {'ratio':>7}  wanted")
        for rows in (small_rows, large_rows, sqlite3_rows, reading_rows):
            for row in rows(Path(folder)):
                print(f"{row.work:52} {row.against:42} {row.ratio:7.2f}  {row.wanted}", flush=True)


if __name__ == "__main__":
    main()
