"""Write what fuzzing begins with: plans of types that have every kind of field, valid messages of them, and schemas.

    python core/fuzz/make_corpus.py DIRECTORY

makes `DIRECTORY/plans.bin` and one file for each input in `DIRECTORY/inputs`; `target.cpp` says what they mean.
"""

from __future__ import annotations

import random
import struct
import sys
from pathlib import Path

from google.protobuf.descriptor_pb2 import FileDescriptorSet

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "core" / "samples")]

from protobuf_types import class_of, descriptor_of, fill, general_file  # noqa: E402
from reference_cdr import write_cdr, write_ros1  # noqa: E402
from ros_types import describe, nasty_types, protobuf_class, protobuf_message, random_value  # noqa: E402

from rosidl_adapter_proto.transcode import _core  # noqa: E402
from rosidl_adapter_proto.transcode.plan import build_plan  # noqa: E402
from rosidl_adapter_proto.transcode.protobuf_plan import protobuf_plan  # noqa: E402

VALUES = 3
GROUP = b"\x0b\x10\x05\x13\x14\x1a\x02ab\x0c"
"""Field 1 as a group, with a number, text and another group in it."""
CHOSEN = (
    ("test/msg/Nasty", ["f_double_one", "f_Inner_many.leaf.text", "f_wstring_array"]),
    ("test/msg/Nasty", ["f_Inner_many"]),
    ("test/msg/Inner", ["leaves.wide"]),
    ("test/msg/Fixed", ["c"]),
)
"""Types and the fields that are read of them."""
RULE = "=" * 80
TEXTS = (
    f"Header header\ntime stamp\nPart[<=3] parts\n{RULE}\nMSG: std_msgs/Header\nstring frame_id\n"
    f"{RULE}\nMSG: test/Part\nother/Empty[2] nothing\n{RULE}\nMSG: other/Empty\n",
    "string<=5[] a\r\nwstring<=4[] b\n\tint8 A = 1 # one\nfloat64[3] c [1, 2, 3]\nchar d\nbyte[] e\nbool f true\n",
    f"{RULE}\nMSG: Root\nint64 plumless\nuint8 buckeroo\n{RULE}\nMSG: test/msg/Root\nint64 plumless\nuint8 buckeroo",
)
"""Definitions of `test/msg/Root`."""


def sized(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


CHANNEL = b"\4" + struct.pack("<Q", 5) + b"other"
"""A record that is no message."""


def chunk(number: int, *messages: bytes) -> bytes:
    """Make a chunk of a message for each way in which `target.cpp` treats those of a plan."""
    result = CHANNEL
    for way, data in enumerate(messages):
        numbers = struct.pack("<HIQQ", 4 * number + way, way, 1000 - way, 7)
        result += b"\5" + struct.pack("<Q", len(numbers) + len(data)) + numbers + data
    return result


def general_inputs(number: int) -> tuple[bytes, dict[str, bytes]]:
    """Return the plan of a message that does not come from ROS, which gets this number, and inputs for it."""
    file = general_file()
    descriptor = descriptor_of([file], "test.General")
    plan = protobuf_plan(descriptor)[0].pack()
    inputs = {"descriptor_set": b"\7" + FileDescriptorSet(file=[file]).SerializeToString()}
    both_ways = _core.Transcoder(plan, "test.General", 2**31 - 1)
    for i in range(VALUES):
        proto = fill(class_of(descriptor)(), random.Random(i)).SerializeToString()
        inputs[f"general_proto_{i}"] = bytes((1, number)) + proto
        inputs[f"general_cdr_{i}"] = bytes((0, number)) + both_ways.proto_to_cdr(proto)
    return plan, inputs


def main(directory: Path) -> None:
    types = nasty_types()
    inputs = directory / "inputs"
    inputs.mkdir(parents=True, exist_ok=True)
    plans: list[bytes] = []
    for name, fields in [*((name, None) for name in types), *CHOSEN]:
        for hashed in (True, False):
            message_class = protobuf_class(types, name, hashed=hashed)
            plan = build_plan(describe(types, name), message_class.DESCRIPTOR, fields=fields).pack()
            number = len(plans)
            plans.append(plan)
            rng = random.Random(f"{name} {fields} {hashed}")
            for i in range(VALUES):
                value = random_value(types, name, rng)
                cdr = write_cdr(types, name, value, big_endian=i % 2 == 1)
                proto = protobuf_message(types, name, value, message_class()).SerializeToString()
                ros1 = write_ros1(types, name, value)
                contents = {
                    "cdr": bytes((0, number)) + cdr,
                    "proto": bytes((1, number)) + proto,
                    "groups": bytes((1, number)) + GROUP + proto + GROUP,
                    "ros1": bytes((4, number)) + ros1,
                    "plan_cdr": b"\2" + sized(plan) + cdr,
                    "plan_proto": b"\3" + sized(plan) + proto,
                }
                if i == 0:
                    contents["chunk"] = b"\5" + chunk(number, cdr, cdr, proto, ros1)
                for kind, content in contents.items():
                    (inputs / f"{number}_{kind}_{i}").write_bytes(content)
    for number, text in enumerate(TEXTS):
        (inputs / f"text_{number}").write_bytes(b"\6" + text.encode())
    plan, others = general_inputs(len(plans))
    plans.append(plan)
    for name, content in others.items():
        (inputs / name).write_bytes(content)
    (directory / "plans.bin").write_bytes(b"".join(map(sized, plans)))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
