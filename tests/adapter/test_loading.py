"""What generated modules do when they are imported."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from rosidl_adapter_proto.adapter import add_descriptor_file


def test_same_descriptor_twice(things: SimpleNamespace) -> None:
    descriptor = things.msg.Part.DESCRIPTOR.file
    assert add_descriptor_file(descriptor.name, descriptor.serialized_pb, "elsewhere.py") is descriptor


def test_different_descriptor_of_the_same_name(things: SimpleNamespace) -> None:
    descriptor = things.msg.Part.DESCRIPTOR.file
    other = things.msg.Type.DESCRIPTOR.file.serialized_pb.replace(b"things/msg/Type", b"things/msg/Part")
    with pytest.raises(ImportError) as caught:
        add_descriptor_file(descriptor.name, other, "elsewhere.py")
    text = str(caught.value)
    assert text.startswith(f"elsewhere.py and {things.folder}")
    assert "bring different versions of things/msg/Part.proto into one process" in text
    assert text.endswith("generate both from the same definitions, with the same options")


def test_import_is_light(things: SimpleNamespace) -> None:
    """Importing a generated adapter loads nothing that only generating needs, no transcoder, and no ROS."""
    program = (
        "import sys, json; from things_root.things.msg import EverythingAdapter; "
        "print(json.dumps(sorted(sys.modules)))"
    )
    path = f"{things.folder / 'python'}:{Path(__file__).parents[2]}"
    output = subprocess.run(
        [sys.executable, "-c", program], env={"PYTHONPATH": path}, capture_output=True, check=True, text=True
    ).stdout
    modules = set(json.loads(output))
    heavy = {"jinja2", "black", "lark", "rosbags", "grpc_tools", "rclpy", "numpy", "click", "dataclasses"}
    assert not heavy & {name.partition(".")[0] for name in modules}
    package = "rosidl_adapter_proto"
    parts = ("arrays", "base", "contract", "lazy", "loading", "messages", "values")
    assert {name for name in modules if name.partition(".")[0] == package} == {
        package,
        f"{package}.errors",
        f"{package}.adapter",
        *(f"{package}.adapter.{part}" for part in parts),
    }
