"""Write the inputs that fuzzing begins with: valid messages of a type that has every kind of field.

    python core/fuzz/make_corpus.py DIRECTORY

makes `DIRECTORY/plan.bin` and one file for each input in `DIRECTORY/inputs`; `target.cpp` says what they mean.
"""

from __future__ import annotations

import random
import struct
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "transcode")]

from reference_cdr import write_cdr  # noqa: E402
from ros_types import describe, nasty_types, protobuf_class, protobuf_message, random_value  # noqa: E402

from rosidl_adapter_proto.transcode.plan import build_plan  # noqa: E402

VALUES = 6


def main(directory: Path) -> None:
    types = nasty_types()
    inputs = directory / "inputs"
    inputs.mkdir(parents=True, exist_ok=True)
    for name in types:
        message_class = protobuf_class(types, name)
        plan = build_plan(describe(types, name), message_class.DESCRIPTOR).pack()
        short = name.rpartition("/")[2]
        sized_plan = struct.pack("<I", len(plan)) + plan
        rng = random.Random(name)
        for i in range(VALUES):
            value = random_value(types, name, rng)
            cdr = write_cdr(types, name, value, big_endian=i % 2 == 1)
            proto = protobuf_message(types, name, value, message_class()).SerializeToString()
            contents = {"plan_cdr": b"\2" + sized_plan + cdr, "plan_proto": b"\3" + sized_plan + proto}
            if short == "Nasty":
                (directory / "plan.bin").write_bytes(plan)
                contents = {"cdr": b"\0" + cdr, "proto": b"\1" + proto}
            for kind, content in contents.items():
                (inputs / f"{short}_{kind}_{i}").write_bytes(content)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
