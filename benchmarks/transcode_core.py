"""The transcoder against rclpy's own serialization and against copying the message, as ratios.

    python benchmarks/transcode_core.py

needs an environment with rclpy and sensor_msgs. Each row is measured in one run: the two sides take turns, and the
fastest turn of each counts.
"""

from __future__ import annotations

import array
import sys
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Image, Imu, LaserScan

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "transcode"))

from ros_types import installed_types, transcoder

TURNS = 15
SECONDS_PER_TURN = 0.02


@dataclass(frozen=True)
class Row:
    """One comparison; `factor` is how many times faster than the peer, or how many times its time."""

    work: str
    peer: str
    factor: float

    def __str__(self) -> str:
        return f"{self.work:<42} {self.peer:<34} {self.factor:>8.2f}x"


def ratio(first: Callable[[], object], second: Callable[[], object]) -> float:
    """Return the time of the first divided by that of the second."""
    timers = [timeit.Timer(first), timeit.Timer(second)]
    numbers = [max(1, int(SECONDS_PER_TURN / (timer.timeit(10) / 10))) for timer in timers]
    best = [float("inf"), float("inf")]
    for _ in range(TURNS):
        for i, timer in enumerate(timers):
            best[i] = min(best[i], timer.timeit(numbers[i]) / numbers[i])
    return best[0] / best[1]


def imu() -> Any:
    message = Imu()
    message.header.frame_id = "imu_link"
    message.header.stamp.sec, message.header.stamp.nanosec = 1_700_000_000, 5_000_000
    for vector in (message.orientation, message.angular_velocity, message.linear_acceleration):
        vector.x, vector.y, vector.z = 0.1, 0.2, 9.8
    for name in ("orientation", "angular_velocity", "linear_acceleration"):
        setattr(message, f"{name}_covariance", [0.5] * 9)
    return message


def laser_scan() -> Any:
    message = LaserScan(angle_min=-3.1, angle_max=3.1, angle_increment=0.01, range_max=30.0)
    message.header.frame_id = "laser"
    message.ranges = array.array("f", [1.5] * 720)
    message.intensities = array.array("f", [2.5] * 720)
    return message


def image() -> Any:
    message = Image(width=1920, height=1080, encoding="rgb8", step=1920 * 3)
    message.data = array.array("B", bytes(1920 * 1080 * 3))
    return message


def rows(name: str, label: str, message: Any, *, copy: bool = False) -> list[Row]:
    transcode, message_class = transcoder(installed_types(), name)
    cdr = serialize_message(message)
    proto = transcode.cdr_to_proto(cdr)
    protobuf = message_class.FromString(proto)

    def serialize() -> bytes:
        return serialize_message(message)

    def deserialize() -> object:
        return deserialize_message(cdr, type(message))

    def to_proto() -> bytes:
        return transcode.cdr_to_proto(cdr)

    def to_protobuf() -> object:
        return message_class.FromString(transcode.cdr_to_proto(cdr))

    def to_cdr() -> bytes:
        return transcode.proto_to_cdr(proto)

    def from_protobuf() -> bytes:
        return transcode.proto_to_cdr(protobuf.SerializeToString())

    if copy:
        cdr_copy, proto_copy = bytearray(cdr), bytearray(proto)
        return [
            Row(f"{label}: CDR to protobuf", "memcpy, times", ratio(to_proto, lambda: bytes(cdr_copy))),
            Row(f"{label}: protobuf to CDR", "memcpy, times", ratio(to_cdr, lambda: bytes(proto_copy))),
        ]
    return [
        Row(f"{label}: CDR to protobuf", "deserialize_message, faster", ratio(deserialize, to_proto)),
        Row(
            f"{label}: CDR to protobuf object", "deserialize_message, faster", ratio(deserialize, to_protobuf)
        ),
        Row(f"{label}: protobuf to CDR", "serialize_message, faster", ratio(serialize, to_cdr)),
        Row(f"{label}: protobuf object to CDR", "serialize_message, faster", ratio(serialize, from_protobuf)),
    ]


def main() -> None:
    print(f"{'work':<42} {'against':<34} {'ratio':>9}")
    for row in (
        *rows("sensor_msgs/msg/Imu", "Imu", imu()),
        *rows("sensor_msgs/msg/LaserScan", "LaserScan 720", laser_scan()),
        *rows("sensor_msgs/msg/Image", "Image 1920x1080 rgb8", image(), copy=True),
    ):
        print(row)


if __name__ == "__main__":
    main()
