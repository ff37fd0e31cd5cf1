"""What messages cost: protobuf through the transcoder, against rclpy and against adapters as a user would write them.

    python benchmarks/messages.py

needs an environment with rclpy and sensor_msgs. Every row is a ratio: its two sides are measured in one run, taking
turns, and the fastest turn of each counts.
"""

from __future__ import annotations

import array
import os
import subprocess
import sys
import tempfile
import time
import timeit
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosidl_adapter_proto import adapter_for
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source

TURNS = 60
SECONDS_PER_TURN = 0.005
MESSAGES_PER_TURN = {"Imu": 1000, "LaserScan": 1000, "Image": 30}


@dataclass(frozen=True)
class Row:
    """One comparison: `ratio` is the time of the peer divided by that of the work, or the other way round."""

    work: str
    against: str
    ratio: float
    wanted: str


def seconds(*calls: Callable[[], object], turns: int = TURNS) -> list[float]:
    """Return the time that each call takes."""
    timers = [timeit.Timer(call) for call in calls]
    for timer in timers:
        timer.timeit(1)  # what is made at the first use does not count
    numbers = [max(1, int(SECONDS_PER_TURN / (timer.timeit(5) / 5))) for timer in timers]
    best = [float("inf")] * len(timers)
    for _ in range(turns):
        for index, (timer, number) in enumerate(zip(timers, numbers, strict=True)):
            best[index] = min(best[index], timer.timeit(number) / number)
    return best


def ros_imu() -> Any:
    """Return a message of a few hundred bytes."""
    from sensor_msgs.msg import Imu

    message = Imu()
    message.header.frame_id = "imu_link"
    message.header.stamp.sec, message.header.stamp.nanosec = 1_700_000_000, 5_000_000
    for vector in (message.orientation, message.angular_velocity, message.linear_acceleration):
        vector.x, vector.y, vector.z = 0.1, 0.2, 9.8
    for name in ("orientation", "angular_velocity", "linear_acceleration"):
        setattr(message, f"{name}_covariance", [0.5] * 9)
    return message


def ros_laser_scan() -> Any:
    """Return a message with two arrays of 720 numbers."""
    from sensor_msgs.msg import LaserScan

    message = LaserScan(angle_min=-3.0, angle_max=3.0, angle_increment=0.5, range_max=30.0)
    message.header.frame_id = "laser"
    message.ranges = array.array("f", [1.5] * 720)
    message.intensities = array.array("f", [2.5] * 720)
    return message


def ros_image() -> Any:
    """Return a message of 6 MB."""
    from sensor_msgs.msg import Image

    message = Image(width=1920, height=1080, encoding="rgb8", step=1920 * 3)
    message.data = array.array("B", bytes(1920 * 1080 * 3))
    return message


# Adapters as a user would write them: attribute by attribute.


def copy_header(source: Any, target: Any) -> None:
    target.header.stamp.sec = source.header.stamp.sec
    target.header.stamp.nanosec = source.header.stamp.nanosec
    target.header.frame_id = source.header.frame_id


def copy_vector(source: Any, target: Any, names: str) -> None:
    for name in names:
        setattr(target, name, getattr(source, name))


def copy_imu(source: Any, target: Any, assign: Callable[[Any, str, Any], None]) -> Any:
    copy_header(source, target)
    copy_vector(source.orientation, target.orientation, "xyzw")
    copy_vector(source.angular_velocity, target.angular_velocity, "xyz")
    copy_vector(source.linear_acceleration, target.linear_acceleration, "xyz")
    for name in ("orientation", "angular_velocity", "linear_acceleration"):
        assign(target, f"{name}_covariance", getattr(source, f"{name}_covariance"))
    return target


def copy_laser_scan(source: Any, target: Any, assign: Callable[[Any, str, Any], None]) -> Any:
    copy_header(source, target)
    for name in ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time"):
        setattr(target, name, getattr(source, name))
    target.range_min, target.range_max = source.range_min, source.range_max
    assign(target, "ranges", source.ranges)
    assign(target, "intensities", source.intensities)
    return target


def assign_to_protobuf(target: Any, name: str, values: Any) -> None:
    getattr(target, name).extend(values)


def assign_to_ros(target: Any, name: str, values: Any) -> None:
    setattr(target, name, list(values))


def serialization_rows(
    name: str, message: Any, adapter: Any, copy: Callable[..., Any], wanted: str
) -> Iterator[Row]:
    """Yield the publish and subscribe paths of a type, without the middleware."""
    from rclpy.serialization import deserialize_message, serialize_message

    ros_class, custom, codec = type(message), adapter.convert_to_custom(message), adapter.codec
    data = serialize_message(message)
    ours, plain, native = seconds(
        lambda: codec.to_cdr(custom),
        lambda: serialize_message(copy(custom, ros_class(), assign_to_ros)),
        lambda: serialize_message(message),
    )
    yield Row(f"{name}: publish", "plain adapter + serialize_message", plain / ours, wanted)
    yield Row(
        f"{name}: publish", "serialize_message of the native message", native / ours, ">= 5" * (name == "Imu")
    )
    ours, plain, native = seconds(
        lambda: codec.from_cdr(data),
        lambda: copy(deserialize_message(data, ros_class), adapter.custom_type(), assign_to_protobuf),
        lambda: deserialize_message(data, ros_class),
    )
    yield Row(f"{name}: subscribe", "deserialize_message + plain adapter", plain / ours, wanted)
    yield Row(f"{name}: subscribe", "deserialize_message to the native message", native / ours, "")


def object_rows(name: str, message: Any, adapter: Any, copy: Callable[..., Any]) -> Iterator[Row]:
    """Yield the conversions between objects."""
    ros_class, custom = type(message), adapter.convert_to_custom(message)
    ours, plain = seconds(
        lambda: adapter.convert_to_custom(message),
        lambda: copy(message, adapter.custom_type(), assign_to_protobuf),
    )
    wanted = ">= 10" if name == "LaserScan 720" else ""
    yield Row(f"{name}: ROS object to protobuf", "attribute by attribute", plain / ours, wanted)
    ours, plain = seconds(
        lambda: adapter.convert_to_ros_message(custom),
        lambda: copy(custom, ros_class(), assign_to_ros),
    )
    yield Row(f"{name}: protobuf to ROS object", "attribute by attribute", plain / ours, wanted)


def run_time_rows(name: str, message: Any, generated: Any) -> Iterator[Row]:
    """Yield the conversions between objects by an adapter made at run time; through CDR both do the same."""
    made, custom = adapter_for(generated.type_name), generated.convert_to_custom(message)
    against = "the generated adapter"
    ours, theirs = seconds(
        lambda: made.convert_to_custom(message), lambda: generated.convert_to_custom(message)
    )
    yield Row(f"{name}: ROS object to protobuf, made at run time", against, theirs / ours, "")
    ours, theirs = seconds(
        lambda: made.convert_to_ros_message(custom), lambda: generated.convert_to_ros_message(custom)
    )
    yield Row(f"{name}: protobuf to ROS object, made at run time", against, theirs / ours, "")


def memcpy_rows(message: Any, adapter: Any) -> Iterator[Row]:
    """Yield what transcoding a large message takes, in times of copying it."""
    data = adapter.to_cdr(adapter.convert_to_custom(message))
    proto = adapter.transcoder.cdr_to_proto(data)
    writable, writable_proto = bytearray(data), bytearray(proto)
    ours, copy = seconds(lambda: adapter.transcoder.cdr_to_proto(data), lambda: bytes(writable))
    yield Row("Image 1920x1080: CDR to protobuf, times", "memcpy of the message", ours / copy, "<= 1.5")
    ours, copy = seconds(lambda: adapter.transcoder.proto_to_cdr(proto), lambda: bytes(writable_proto))
    yield Row("Image 1920x1080: protobuf to CDR, times", "memcpy of the message", ours / copy, "<= 1.5")


BATCHES = {"Imu": 200_000, "Image": 20}
BATCH_TURNS = 15


def batch_rows(name: str, message: Any, adapter: Any) -> Iterator[Row]:
    """Yield what batches into one kept buffer save, over single calls and by a second thread."""
    transcoder = adapter.transcoder
    data = adapter.codec.to_cdr(adapter.convert_to_custom(message))
    messages = [bytes(memoryview(data)) for _ in range(BATCHES[name])]
    protos = [transcoder.cdr_to_proto(each) for each in messages]
    for way, single, batch, inputs in (
        ("CDR to protobuf", transcoder.cdr_to_proto, transcoder.cdr_to_proto_batch, messages),
        ("protobuf to CDR", transcoder.proto_to_cdr, transcoder.proto_to_cdr_batch, protos),
    ):
        kept = bytearray(len(batch(inputs).buffer))
        singles, one, two = seconds(
            lambda single=single, inputs=inputs: [single(each) for each in inputs],
            lambda batch=batch, inputs=inputs, kept=kept: batch(inputs, into=kept),
            lambda batch=batch, inputs=inputs, kept=kept: batch(inputs, threads=2, into=kept),
            turns=BATCH_TURNS,
        )
        work = f"{name}: {way}, batch"
        yield Row(f"{work} into a kept buffer", "single calls, results kept", singles / one, ">= 1")
        yield Row(f"{work} on 2 threads", "on 1 thread", one / two, ">= 1.6")


def field_rows(name: str, message: Any, adapter: Any, field: str, wanted: str) -> Iterator[Row]:
    """Yield what reading one small field costs."""
    codec, data = adapter.codec, adapter.codec.to_cdr(adapter.convert_to_custom(message))
    chosen, whole = seconds(lambda: codec.from_cdr(data, fields=(field,)), lambda: codec.from_cdr(data))
    yield Row(f"{name}: only {field}", "all of the message", whole / chosen, wanted)


NODES = ("Imu", "LaserScan", "Image")
SIDES = ("native", "protobuf")
PROCESSES = 4
KEPT_MEMORY = {"MALLOC_TRIM_THRESHOLD_": "1000000000", "MALLOC_MMAP_THRESHOLD_": "1000000000"}


def node_rows(packages: Path) -> Iterator[Row]:
    """Yield the processor time per message through a publisher and a subscription of rclpy, native against ours.

    Each side is measured in processes of its own, as nodes are: what a message costs depends much on what malloc has
    been through. The last row is for processes that never give memory back.
    """
    for name, variables, note in (
        *((name, {}, "") for name in NODES),
        ("Image", KEPT_MEMORY, ", malloc keeps memory"),
    ):
        best = dict.fromkeys(SIDES, float("inf"))
        for _ in range(PROCESSES):
            for side in SIDES:
                command = [sys.executable, __file__, "node", name, side]
                environment = {**os.environ, **variables, "PYTHONPATH": str(packages)}
                printed = subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True).stdout
                best[side] = min(best[side], float(printed))
        ratio = best["native"] / best["protobuf"]
        yield Row(
            f"{name}: publisher to subscription{note}", "native, processor time", ratio, "" if note else "> 1"
        )


def processor_seconds(name: str, side: str) -> float:
    """Return the processor time that a message takes through a publisher and a subscription, in this process."""
    import rclpy
    import rosidl_proto.sensor_msgs.msg
    from rclpy.executors import SingleThreadedExecutor

    from rosidl_adapter_proto.ros import Node

    message = {"Imu": ros_imu, "LaserScan": ros_laser_scan, "Image": ros_image}[name]()
    message_type: Any = type(message)
    if side == "protobuf":
        message_type = getattr(rosidl_proto.sensor_msgs.msg, f"{name}Adapter")
        message = message_type.convert_to_custom(message)
    rclpy.init()
    node = Node("benchmark")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    received = 0

    def receive(_: Any) -> None:
        nonlocal received
        received += 1

    node.create_subscription(message_type, "topic", receive, 10)
    publisher = node.create_publisher(message_type, "topic", 10)
    while publisher.get_subscription_count() == 0:
        executor.spin_once(timeout_sec=0.1)
    best, count = float("inf"), MESSAGES_PER_TURN[name]
    for _ in range(5):
        start = time.process_time()
        for number in range(received + 1, received + 1 + count):
            publisher.publish(message)
            while received < number:
                executor.spin_once(timeout_sec=5.0)
        best = min(best, (time.process_time() - start) / count)
    node.destroy_node()
    rclpy.shutdown()
    return best


SIZES = """
import pickle, sys
from importlib import import_module
for name in ("Imu", "LaserScan", "Image", "PoseArray"):
    package = "geometry_msgs" if name == "PoseArray" else "sensor_msgs"
    adapter = getattr(import_module(f"rosidl_proto.{package}.msg"), f"{name}Adapter")
    print(len(adapter.from_cdr(pickle.load(sys.stdin.buffer)).SerializeToString()))
"""


def size_rows(folder: Path, catalog: Catalog, messages: list[Any]) -> Iterator[tuple[str, int, int, int]]:
    """Yield bytes per message: CDR, protobuf with hash numbers, protobuf with sequential numbers."""
    import pickle

    from rclpy.serialization import serialize_message

    data = [serialize_message(message) for message in messages]
    sizes = {}
    for numbering in ("hash", "sequential"):
        options = Options(numbering=numbering, lock_file=folder / "rosidl-proto.lock")
        generate(Request(("sensor_msgs", "geometry_msgs")), catalog, folder / numbering, options)
        environment = {**os.environ, "PYTHONPATH": str(folder / numbering / "python")}
        process = subprocess.run(
            [sys.executable, "-c", SIZES],
            input=b"".join(map(pickle.dumps, data)),
            env=environment,
            stdout=subprocess.PIPE,
            check=True,
        )
        sizes[numbering] = [int(line) for line in process.stdout.split()]
    for index, message in enumerate(messages):
        yield type(message).__name__, len(data[index]), sizes["hash"][index], sizes["sequential"][index]


def main() -> None:
    """Measure, and print both tables."""
    from geometry_msgs.msg import Pose, PoseArray

    catalog = Catalog((*prefix_sources(), store_source()))
    with tempfile.TemporaryDirectory() as folder:
        generate(Request(("sensor_msgs",)), catalog, Path(folder, "generated"))
        sys.path.insert(0, f"{folder}/generated/python")
        from rosidl_proto.sensor_msgs.msg import ImageAdapter, ImuAdapter, LaserScanAdapter

        imu, scan, image = ros_imu(), ros_laser_scan(), ros_image()
        print(f"{'work':52} {'against':42} {'ratio':>7}  wanted")
        for rows in (
            serialization_rows("Imu", imu, ImuAdapter, copy_imu, ">= 30"),
            serialization_rows("LaserScan 720", scan, LaserScanAdapter, copy_laser_scan, ">= 50"),
            memcpy_rows(image, ImageAdapter),
            batch_rows("Imu", imu, ImuAdapter),
            batch_rows("Image", image, ImageAdapter),
            field_rows("LaserScan 720", scan, LaserScanAdapter, "header.stamp", ""),
            field_rows("Image 1920x1080", image, ImageAdapter, "header.stamp", ">= 50"),
            object_rows("Imu", imu, ImuAdapter, copy_imu),
            object_rows("LaserScan 720", scan, LaserScanAdapter, copy_laser_scan),
            run_time_rows("Imu", imu, ImuAdapter),
            node_rows(Path(folder, "generated/python")),
        ):
            for row in rows:
                print(f"{row.work:52} {row.against:42} {row.ratio:7.2f}  {row.wanted}", flush=True)

        print(f"\n{'bytes per message':20} {'CDR':>10} {'hash':>10} {'sequential':>10}")
        for name, *sizes in size_rows(
            Path(folder), catalog, [imu, scan, image, PoseArray(poses=[Pose()] * 100)]
        ):
            print(f"{name:20} " + " ".join(f"{size:10}" for size in sizes))


if __name__ == "__main__":
    if sys.argv[1:2] == ["node"]:
        print(processor_seconds(*sys.argv[2:]))
    else:
        main()
