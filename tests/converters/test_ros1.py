"""ROS 1: read as rosbags writes it, never written, and its types beside those of ROS 2."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy
import pytest
from ros_types import Types, element_name, protobuf_message, random_value, same_message, shape

from rosidl_adapter_proto import ConversionError, ConverterError, Schema, TypeRegistry
from rosidl_adapter_proto.converters import Converter, SerializedBagMessage
from rosidl_adapter_proto.converters.ros1 import Ros1Deserializer, check_ros2_type
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from rosidl_adapter_proto.interfaces.scalars import SCALARS
from tests.folders import write_package

HEADER = "std_msgs/msg/Header"


@pytest.fixture(scope="module")
def ros1() -> TypeRegistry:
    return TypeRegistry(Catalog((store_source("noetic"),)))


@pytest.fixture(scope="module")
def ros2() -> TypeRegistry:
    return TypeRegistry(Catalog((store_source("lyrical"),)))


def types_of(schema: Schema) -> Types:
    description = schema.type_description
    structs = (description["type_description"], *description["referenced_type_descriptions"])
    return {each["type_name"]: dict(each) for each in structs}


def rosbags_object(store: Any, types: Types, name: str, value: dict[str, Any]) -> Any:
    """Make what rosbags serializes; the value gets such times and durations as both ROS 1 and ROS 2 have."""
    for part in {
        "builtin_interfaces/msg/Time": ("sec",),
        "builtin_interfaces/msg/Duration": ("nanosec",),
    }.get(name, ()):
        value[part] &= 0x7FFFFFFF
    fields = {}
    for field in types[name]["fields"]:
        content, element = value[field["name"]], element_name(field)
        single = shape(field) == "single"
        if element == "nested":
            nested = field["type"]["nested_type_name"]
            made = [rosbags_object(store, types, nested, each) for each in ([content] if single else content)]
            content = made[0] if single else made
        elif not single and element != "string":
            code = SCALARS[element].typecode
            content = numpy.array(content, numpy.dtype(code) if code else bool)
        fields[field["name"]] = content
    return store.types[name](**fields)


def test_every_type(ros1: TypeRegistry) -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    converter = Converter("ros1", "protobuf")
    names = [each for each in store.types if each in ros1]
    assert len(names) > 150
    for name in names:
        schema = ros1[name]
        types = types_of(schema)
        rng = random.Random(name)
        for _ in range(3):
            value = random_value(types, name, rng)
            data = bytes(store.serialize_ros1(rosbags_object(store, types, name, value), name))
            message = converter.convert(SerializedBagMessage(data), schema)
            found = schema.message_class.FromString(bytes(message.serialized_data))
            assert same_message(found, protobuf_message(types, name, value, schema.message_class())), name


@pytest.mark.parametrize("serialization_format", ["ros1", "rosbag_v2"])
def test_both_names(serialization_format: str, ros1: TypeRegistry) -> None:
    data = b"\7\0\0\0" + b"\1\0\0\0\2\0\0\0" + b"\3\0\0\0map"
    message = Converter(serialization_format, "protobuf").convert(SerializedBagMessage(data), ros1[HEADER])
    header: Any = ros1[HEADER].message_class.FromString(bytes(message.serialized_data))
    assert (header.seq, header.stamp.sec, header.stamp.nanosec, header.frame_id) == (7, 1, 2, "map")


def test_a_message_is_filled(ros1: TypeRegistry) -> None:
    message: Any = ros1["std_msgs/msg/String"].message_class(data="before")
    Ros1Deserializer().deserialize(SerializedBagMessage(b"\2\0\0\0hi"), ros1["std_msgs/msg/String"], message)
    assert message.data == "hi"


def test_what_is_no_message(ros1: TypeRegistry) -> None:
    with pytest.raises(ConversionError, match=r"^std_msgs/msg/String.data at byte 0: "):
        Converter("ros1", "protobuf").convert(SerializedBagMessage(b"\2\0"), ros1["std_msgs/msg/String"])


def test_to_cdr_without_seq(ros1: TypeRegistry, ros2: TypeRegistry) -> None:
    check_ros2_type(ros1[HEADER], ros2[HEADER])
    data = b"\7\0\0\0" + b"\1\0\0\0\2\0\0\0" + b"\3\0\0\0map"
    cdr = Converter("ros1", "cdr").convert(SerializedBagMessage(data, "/h"), ros1[HEADER], ros2[HEADER])
    body = b"\1\0\0\0\2\0\0\0" + b"\4\0\0\0map\0"
    assert cdr == SerializedBagMessage(b"\0\1\0\0" + body, "/h")


LOST = {
    "sensor_msgs/msg/CameraInfo": "sensor_msgs/msg/CameraInfo.D is not in sensor_msgs/msg/CameraInfo of ROS 2",
    "stereo_msgs/msg/DisparityImage": "stereo_msgs/msg/DisparityImage.T is not in "
    "stereo_msgs/msg/DisparityImage of ROS 2",
}
"""Of what both distributions have, what does not fit."""


def test_every_type_that_both_have(ros1: TypeRegistry, ros2: TypeRegistry) -> None:
    refused = {}
    names = [each for each in ros1 if each in ros2]
    for name in names:
        try:
            check_ros2_type(ros1[name], ros2[name])
        except ConverterError as error:
            refused[name] = str(error)
    assert len(names) > 100
    assert refused == {
        name: f"{text}, and would be lost; convert to protobuf instead" for name, text in LOST.items()
    }


def schema(texts: dict[str, str], name: str = "a/msg/A", **options: Any) -> Schema:
    return TypeRegistry.from_texts(texts, **options)[name]


@pytest.mark.parametrize(
    ("before", "after", "text"),
    [
        ({"a": "int32 x"}, {"a": "int32 x\nint32 more"}, None),
        ({"a": "int8 x\nint8[] xs"}, {"a": "byte x\nbyte[] xs"}, None),
        ({"a": "string[] x"}, {"a": "string<=3[<=2] x"}, None),
        ({"a": ""}, {"a": "int32 x"}, None),
        ({"a": "B b", "b": "int8 x"}, {"a": "C b", "c": "int8 x"}, None),
        ({"a": "int32 x"}, {"a": "int32 y"}, "A.x is not in a/msg/A of ROS 2"),
        ({"a": "uint32 seq"}, {"a": "uint32 sequence"}, "A.seq is not in a/msg/A of ROS 2"),
        ({"a": "int32 x"}, {"a": "int64 x"}, "A.x is int32 in ROS 1 and int64 in ROS 2"),
        ({"a": "int32[] x"}, {"a": "int32[3] x"}, "A.x is int32[] in ROS 1 and int32[3] in ROS 2"),
        ({"a": "int32[2] x"}, {"a": "int32[3] x"}, "A.x is int32[2] in ROS 1 and int32[3] in ROS 2"),
        ({"a": "int8 x"}, {"a": "B x", "b": "int8 x"}, "A.x is int8 in ROS 1 and a/msg/B in ROS 2"),
        (
            {"a": "B b", "b": "int8 x"},
            {"a": "B b", "b": "uint8 x"},
            "B.x is int8 in ROS 1 and uint8 in ROS 2",
        ),
        (
            {"a": "B[] b", "b": "C c", "c": "int8 x"},
            {"a": "B[] b", "b": "C c", "c": "int8 y"},
            "C.x is not in a/msg/C of ROS 2",
        ),
    ],
)
def test_what_would_be_lost(before: dict[str, str], after: dict[str, str], text: str | None) -> None:
    types = [schema({f"a/msg/{name.upper()}": each for name, each in one.items()}) for one in (before, after)]
    if text is None:
        check_ros2_type(*types)
        return
    with pytest.raises(ConverterError) as error:
        check_ros2_type(*types)
    assert str(error.value) == f"a/msg/{text}, and would be lost; convert to protobuf instead"


def test_other_field_numbers(tmp_path: Path) -> None:
    lock_file = tmp_path / "rosidl-proto.lock"
    write_package(tmp_path / "a", {"msg/A.msg": "int32 x\n"})
    options = Options(numbering="sequential", lock_file=lock_file)
    generate(Request(("a",)), Catalog((folder_source(tmp_path / "a"),)), tmp_path / "out", options)
    numbered = TypeRegistry.from_folders(tmp_path / "a", lock_file=lock_file)["a/msg/A"]

    with pytest.raises(ConverterError) as error:
        check_ros2_type(schema({"a/msg/A": "int32 x"}), numbered)
    assert str(error.value) == (
        "a/msg/A.x has field number 215755280 for ROS 1 and 1 for ROS 2, and would be lost; "
        "convert to protobuf instead"
    )
