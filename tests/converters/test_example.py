"""The plugin in `examples/converter_plugin`, installed as any package that we do not know."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from tests.programs import run

ROOT = Path(__file__).parents[2]

USE = """
from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.converters import Converter, SerializedBagMessage
from rosidl_adapter_proto.errors import Error

schema = TypeRegistry()["std_msgs/msg/Header"]
json = SerializedBagMessage(b'{"frame_id": "map", "stamp": {"sec": 1}}', "/header", 3, 2, 1)
for output_format in "protobuf", "cdr":
    converted = Converter("json", output_format).convert(json, schema)
    if output_format == "cdr":
        converted = Converter("cdr", "protobuf").convert(converted, schema)
    message = schema.message_class.FromString(converted.serialized_data)
    print(message.frame_id, message.stamp.sec, converted)
for use in (
    lambda: Converter("cdr", "json"),
    lambda: Converter("json", "cdr").convert(SerializedBagMessage(b"{"), schema),
    lambda: Converter("json", "cdr").convert(SerializedBagMessage(b'"\\xff"'), schema),
):
    try:
        use()
    except Error as error:
        print(type(error).__name__, error)
"""
PLACE = "ros_json_converter:JsonDeserializer, entry point of ros-json-converter 1.0.0"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Where Python finds the installed plugin, and this package."""
    folder = tmp_path_factory.mktemp("plugin")
    shutil.copytree(ROOT / "examples/converter_plugin", folder / "source")
    pip = (
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--no-index",
    )
    run(*pip, "--target", folder / "installed", folder / "source", folder=folder)
    return f"{folder / 'installed'}:{ROOT}"


def test_it_is_found(path: str, tmp_path: Path) -> None:
    command = (sys.executable, "-m", "rosidl_adapter_proto", "bag", "converters")
    printed = run(*command, folder=tmp_path, variables={"PYTHONPATH": path})
    assert f"json       reads          {PLACE}\n" in printed


def test_it_reads(path: str, tmp_path: Path) -> None:
    printed = run(sys.executable, "-c", USE, folder=tmp_path, variables={"PYTHONPATH": path})
    message = (
        "SerializedBagMessage(topic_name='/header', recv_timestamp=3, send_timestamp=2, sequence_number=1)"
    )
    *read, missing, broken, no_text = printed.splitlines()
    assert read == [f"map 1 {message}"] * 2
    assert missing == (
        f"ConverterError Could not find converter for format json: json_converter ({PLACE}) only reads it; "
        "formats that can be written: cdr, protobuf"
    )
    assert broken.startswith("ConversionError std_msgs/msg/Header: it is no such JSON: ")
    assert no_text.startswith("ConversionError std_msgs/msg/Header: it is no such JSON: 'utf-8' codec can't ")
