"""Makes bags as ROS 2 records them, for benchmarks and tests: the same ones from the same seed, with nothing of ours.

Messages are made and serialized by rosbags, and files are written by the mcap library or by rosbags.

    python benchmarks/bag_maker.py FOLDER

makes a folder of two seconds of every kind of message.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from heapq import merge
from pathlib import Path
from typing import Any

import numpy
from rosbags.typesys import Stores, get_typestore

START = 1_700_000_000_000_000_000
"""When every bag begins, in nanoseconds since 1970."""

QOS = (
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n  deadline:\n    sec: 9223372036\n"
    "    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n"
    "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  avoid_ros_namespace_conventions: false"
)
JOINTS = [f"joint_{side}_{number}" for side in ("left", "right") for number in range(6)]
FRAMES = ["base_link", "torso", "head", "camera_link", "imu_link", "laser"]


@cache
def typestore() -> Any:
    """Return the message definitions of ROS 2 Kilted."""
    return get_typestore(Stores.ROS2_KILTED)


def ros(type_name: str, /, **fields: Any) -> Any:
    """Return a message of a type such as `sensor_msgs/Imu`."""
    package, _, short = type_name.partition("/")
    return typestore().types[f"{package}/msg/{short}"](**fields)


def header(time: int, frame: str) -> Any:
    stamp = ros("builtin_interfaces/Time", sec=time // 10**9, nanosec=time % 10**9)
    return ros("std_msgs/Header", stamp=stamp, frame_id=frame)


def vector(name: str, values: Iterable[float]) -> Any:
    return ros(name, **dict(zip("xyzw", map(float, values), strict=False)))


def imu(random: Any, time: int) -> Any:
    return ros(
        "sensor_msgs/Imu",
        header=header(time, "imu_link"),
        orientation=vector("geometry_msgs/Quaternion", random.normal(size=4)),
        orientation_covariance=random.random(9),
        angular_velocity=vector("geometry_msgs/Vector3", random.normal(size=3)),
        angular_velocity_covariance=random.random(9),
        linear_acceleration=vector("geometry_msgs/Vector3", random.normal(size=3)),
        linear_acceleration_covariance=random.random(9),
    )


def joint_state(random: Any, time: int) -> Any:
    position, velocity, effort = random.normal(size=(3, len(JOINTS)))
    head = header(time, "")
    return ros(
        "sensor_msgs/JointState",
        header=head,
        name=JOINTS,
        position=position,
        velocity=velocity,
        effort=effort,
    )


def tf(random: Any, time: int) -> Any:
    return ros("tf2_msgs/TFMessage", transforms=[transform(random, time, frame) for frame in FRAMES])


def transform(random: Any, time: int, frame: str) -> Any:
    moved = ros(
        "geometry_msgs/Transform",
        translation=vector("geometry_msgs/Vector3", random.normal(size=3)),
        rotation=vector("geometry_msgs/Quaternion", random.normal(size=4)),
    )
    return ros(
        "geometry_msgs/TransformStamped", header=header(time, "map"), child_frame_id=frame, transform=moved
    )


def laser_scan(random: Any, time: int) -> Any:
    limits = {"angle_min": -3.0, "angle_max": 3.0, "angle_increment": 6 / 720, "time_increment": 0.0}
    ranges, intensities = random.random((2, 720), dtype=numpy.float32)
    return ros(
        "sensor_msgs/LaserScan",
        header=header(time, "laser"),
        **limits,
        scan_time=0.05,
        range_min=0.1,
        range_max=30.0,
        ranges=ranges,
        intensities=intensities,
    )


def image(random: Any, time: int, height: int = 1080, width: int = 1920) -> Any:
    """Return an image that compresses about as those of cameras do: smooth, with a little noise."""
    rows, columns = numpy.ogrid[:height, :width]
    smooth = ((rows + columns + time // 10**7) // 8).astype(numpy.uint8)[..., None]
    noise = random.integers(0, 4, (height, width, 3), dtype=numpy.uint8)
    return ros(
        "sensor_msgs/Image",
        header=header(time, "camera_link"),
        height=height,
        width=width,
        encoding="rgb8",
        is_bigendian=0,
        step=width * 3,
        data=(smooth + noise).reshape(-1),
    )


def small_image(random: Any, time: int) -> Any:
    return image(random, time, 48, 64)


def point_cloud(random: Any, time: int) -> Any:
    fields = [
        ros("sensor_msgs/PointField", name=name, offset=4 * index, datatype=7, count=1)
        for index, name in enumerate(("x", "y", "z", "intensity"))
    ]
    points = 32_768
    data = random.normal(size=points * 4).astype(numpy.float32).view(numpy.uint8)
    return ros(
        "sensor_msgs/PointCloud2",
        header=header(time, "laser"),
        height=1,
        width=points,
        fields=fields,
        is_bigendian=False,
        point_step=16,
        row_step=16 * points,
        data=data,
        is_dense=True,
    )


@dataclass(frozen=True)
class Stream:
    """What one topic of a bag has: messages of one type, at a rate per second."""

    topic: str
    type_name: str
    rate: int
    make: Callable[[Any, int], Any]


IMU = Stream("/imu", "sensor_msgs/msg/Imu", 200, imu)
JOINT_STATES = Stream("/joint_states", "sensor_msgs/msg/JointState", 50, joint_state)
TF = Stream("/tf", "tf2_msgs/msg/TFMessage", 50, tf)
SCAN = Stream("/scan", "sensor_msgs/msg/LaserScan", 20, laser_scan)
IMAGE = Stream("/camera/image", "sensor_msgs/msg/Image", 2, image)
SMALL_IMAGE = Stream("/camera/image", "sensor_msgs/msg/Image", 2, small_image)
POINTS = Stream("/points", "sensor_msgs/msg/PointCloud2", 10, point_cloud)


@dataclass(frozen=True)
class Recorded:
    """A message as it is recorded."""

    log_time: int
    stream: Stream
    sequence: int
    data: bytes


def record(streams: Iterable[Stream], seconds: float, seed: int = 0) -> Iterator[Recorded]:
    """Yield the messages of some topics in the order of time."""

    def one(stream: Stream, random: Any) -> Iterator[Recorded]:
        for sequence in range(int(seconds * stream.rate)):
            time = START + sequence * 10**9 // stream.rate
            message = stream.make(random, time)
            data = typestore().serialize_cdr(message, stream.type_name)
            yield Recorded(time, stream, sequence, bytes(data))

    sources = [one(stream, numpy.random.default_rng([seed, index])) for index, stream in enumerate(streams)]
    return merge(*sources, key=lambda recorded: recorded.log_time)


def write_mcap(
    path: Path, messages: Iterable[Recorded], *, compression: str = "", chunk_size: int = 786_432
) -> None:
    """Write a file as rosbag2 does, whose chunks are of this size.

    Args:
        path: The file.
        messages: What is in it.
        compression: `lz4`, `zstd` or empty.
        chunk_size: How large a chunk becomes before it is written, in bytes.
    """
    from mcap.writer import CompressionType, Writer

    compressions = {"": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_size, compression=compressions[compression])
        writer.start(profile="ros2", library="bag_maker")
        channels: dict[Stream, int] = {}
        for each in messages:
            if each.stream not in channels:
                name = each.stream.type_name
                definition, hashed = definition_and_hash(name)
                schema = writer.register_schema(name, "ros2msg", definition.encode())
                metadata = {"offered_qos_profiles": QOS, "topic_type_hash": hashed}
                channels[each.stream] = writer.register_channel(each.stream.topic, "cdr", schema, metadata)
            writer.add_message(
                channels[each.stream], each.log_time, each.data, each.log_time - 1000, each.sequence
            )
        writer.finish()


def write_folder(
    path: Path, messages: Iterable[Recorded], *, storage: str = "sqlite3", compression: str = ""
) -> None:
    """Write a folder as rosbag2 does.

    Args:
        path: The folder.
        messages: What is in it.
        storage: `sqlite3` or `mcap`.
        compression: Whether each `file`, each `message` or nothing is compressed with zstd.
    """
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    plain = Writer(path, version=8, storage_plugin=StoragePlugin[storage.upper()])
    if compression:
        plain.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with plain as writer:
        connections: dict[Stream, Any] = {}
        for each in messages:
            if each.stream not in connections:
                name = each.stream.type_name
                definition, hashed = definition_and_hash(name)
                connections[each.stream] = writer.add_connection(
                    each.stream.topic, name, msgdef=definition, rihs01=hashed
                )
            writer.write(connections[each.stream], each.log_time, each.data)


@cache
def definition_and_hash(type_name: str) -> tuple[str, str]:
    """Return the text of a type with all that it refers to, and its hash (REP-2011)."""
    return typestore().generate_msgdef(type_name, ros_version=2)[0], typestore().hash_rihs01(type_name)


if __name__ == "__main__":
    write_folder(
        Path(sys.argv[1]), record([IMU, JOINT_STATES, TF, SCAN, SMALL_IMAGE, POINTS], 2), storage="mcap"
    )
