"""The bag that the page about plots draws: a robot that walks on the spot.

    python -m tests.plotjuggler.walk FOLDER

makes it as the folder `walk` in FOLDER.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy

from benchmarks.bag_maker import START, Stream, header, record, ros, vector, write_folder

JOINTS = ("hip", "knee", "ankle")
_STEP = 1.25  # seconds


def _phase(time: int) -> float:
    return 2 * math.pi * (time - START) / 1e9 / _STEP


def _joint_state(random: Any, time: int) -> Any:
    phase = _phase(time)
    hip, knee = 0.4 * math.sin(phase), 0.5 - 0.5 * math.cos(phase) ** 3
    return ros(
        "sensor_msgs/JointState",
        header=header(time, ""),
        name=list(JOINTS),
        position=numpy.array([hip, knee, hip - knee]),
        velocity=numpy.zeros(0),
        effort=numpy.zeros(0),
    )


def _imu(random: Any, time: int) -> Any:
    phase = _phase(time)
    rates = 0.1 * math.sin(phase), 0.6 * math.sin(phase) + 0.25 * math.sin(3 * phase), 0.0
    still = vector("geometry_msgs/Vector3", (0, 0, 0))
    nothing = numpy.zeros(9)
    return ros(
        "sensor_msgs/Imu",
        header=header(time, "imu_link"),
        orientation=vector("geometry_msgs/Quaternion", (0, 0, 0, 1)),
        orientation_covariance=nothing,
        angular_velocity=vector("geometry_msgs/Vector3", rates),
        angular_velocity_covariance=nothing,
        linear_acceleration=still,
        linear_acceleration_covariance=nothing,
    )


def _contact(random: Any, time: int) -> Any:
    return ros("std_msgs/Bool", data=math.sin(_phase(time)) < 0)


STREAMS = (
    Stream("/joint_states", "sensor_msgs/msg/JointState", 50, _joint_state),
    Stream("/imu", "sensor_msgs/msg/Imu", 200, _imu),
    Stream("/foot/contact", "std_msgs/msg/Bool", 20, _contact),
)


def write_walk(folder: Path) -> None:
    """Write the bag `walk` into a folder."""
    write_folder(folder / "walk", record(STREAMS, 5), storage="mcap")


if __name__ == "__main__":
    write_walk(Path(sys.argv[1]))
