"""Protobuf messages that do not come from ROS: descriptors made from few words, and messages with random values."""

from __future__ import annotations

import random
import struct
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.message import Message

from rosidl_adapter_proto.interfaces.scalars import SCALARS
from rosidl_adapter_proto.transcode.plan import PROTOBUF_TYPES, is_repeated
from rosidl_adapter_proto.transcode.protobuf_plan import SCALAR_OPTION, is_map_entry, tell_scalar

SCALAR_TYPES = [name for name in PROTOBUF_TYPES if name not in ("message", "group", "enum")]
LIMITS = {
    FieldDescriptor.CPPTYPE_INT32: (-(2**31), 2**31 - 1),
    FieldDescriptor.CPPTYPE_INT64: (-(2**63), 2**63 - 1),
    FieldDescriptor.CPPTYPE_UINT32: (0, 2**32 - 1),
    FieldDescriptor.CPPTYPE_UINT64: (0, 2**64 - 1),
}


def varint(value: int) -> bytes:
    result = b""
    while value >= 0x80:
        result += bytes([value & 0x7F | 0x80])
        value >>= 7
    return result + bytes([value])


def add_message(
    file: descriptor_pb2.FileDescriptorProto, name: str, /, **fields: str
) -> descriptor_pb2.DescriptorProto:
    """Add a message with fields such as `int32`, `repeated .test.Node`, `enum .test.Color`, `map string int32`."""
    message = file.message_type.add(name=name)
    for number, (field, text) in enumerate(fields.items(), 1):
        *words, last = text.split()
        if words == ["map", *words[1:]] and words:
            entry = message.nested_type.add(name=f"{field.title()}Entry")
            entry.options.map_entry = True
            add_field(entry, "key", 1, words[1:])
            add_field(entry, "value", 2, [last])
            words, last = ["repeated"], f".{file.package}.{name}.{entry.name}"
        add_field(message, field, number, [*words, last])
    return message


def add_field(message: descriptor_pb2.DescriptorProto, name: str, number: int, words: list[str]) -> None:
    label = 3 if words[0] == "repeated" else 1
    type_name = words[-1] if words[-1].startswith(".") else ""
    kind = (
        "enum" if "enum" in words else "group" if "group" in words else "message" if type_name else words[-1]
    )
    field = message.field.add(name=name, number=number, label=label, type=PROTOBUF_TYPES[kind])
    if type_name:
        field.type_name = type_name


def set_option(field: descriptor_pb2.FieldDescriptorProto, content: bytes) -> None:
    """Add the option that tells the ROS type of a field, whatever it says."""
    field.options.MergeFromString(varint(SCALAR_OPTION << 3 | 2) + bytes([len(content)]) + content)


def general_file() -> descriptor_pb2.FileDescriptorProto:
    """Return a file with the message `test.General`, which has everything that messages can have."""
    file = descriptor_pb2.FileDescriptorProto(name="general.proto", package="test", syntax="proto2")
    enum = file.enum_type.add(name="Color", options=descriptor_pb2.EnumOptions(allow_alias=True))
    for number, name in ((0, "BLACK"), (7, "RED"), (-3, "DARK"), (7, "ALSO_RED")):
        enum.value.add(name=name, number=number)
    add_message(file, "Nothing")
    add_message(file, "Node", name="string", left=".test.Node", more="repeated .test.Node")
    general = add_message(
        file,
        "General",
        **{f"one_{name}": name for name in SCALAR_TYPES},
        **{f"many_{name}": f"repeated {name}" for name in SCALAR_TYPES},
        color="enum .test.Color",
        colors="repeated enum .test.Color",
        nothing=".test.Nothing",
        nothings="repeated .test.Nothing",
        tree=".test.Node",
        counts="map string sint64",
        nodes="map int32 .test.Node",
        small="int32",
        wide="bytes",
        letters="string",
    )
    for field, name in zip(general.field[-3:], ("int8", "wstring", "char"), strict=True):
        tell_scalar(field, SCALARS[name])
    group = general.nested_type.add(name="Group")
    add_field(group, "inside", 1, ["int32"])
    add_field(general, "group", 100, ["group", ".test.General.Group"])
    return file


def descriptor_of(files: list[descriptor_pb2.FileDescriptorProto], name: str) -> Descriptor:
    pool = descriptor_pool.DescriptorPool()
    for file in files:
        pool.AddSerializedFile(file.SerializeToString())
    return pool.FindMessageTypeByName(name)


def class_of(descriptor: Descriptor) -> type[Any]:
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(descriptor)
    return message_factory.MessageFactory().GetPrototype(descriptor)  # before protobuf 4.22


def fill(message: Message, rng: random.Random, depth: int = 0) -> Message:
    """Fill about two thirds of the fields with random values; messages nest at most 3 deep."""
    for field in message.DESCRIPTOR.fields:
        if field.type == FieldDescriptor.TYPE_GROUP or rng.random() < 1 / 3:
            continue
        if field.message_type is not None and depth == 3:
            continue
        if field.message_type is not None and is_map_entry(field.message_type):
            fill_map(getattr(message, field.name), field.message_type, rng, depth)
        elif is_repeated(field):
            values = getattr(message, field.name)
            for _ in range(rng.randrange(1, 4)):
                if field.message_type is not None:
                    fill(values.add(), rng, depth + 1)
                else:
                    values.append(value_of(field, rng))
        elif field.message_type is not None:
            part = getattr(message, field.name)
            part.SetInParent()
            fill(part, rng, depth + 1)
        else:
            setattr(message, field.name, value_of(field, rng))
    return message


def fill_map(values: Any, entry: Descriptor, rng: random.Random, depth: int) -> None:
    for _ in range(rng.randrange(1, 4)):
        key = value_of(entry.fields_by_name["key"], rng)
        value = entry.fields_by_name["value"]
        if value.message_type is not None:
            fill(values[key], rng, depth + 1)
        else:
            values[key] = value_of(value, rng)


def value_of(field: FieldDescriptor, rng: random.Random) -> Any:
    if field.enum_type is not None:
        return rng.choice(field.enum_type.values).number
    if field.type == FieldDescriptor.TYPE_BYTES:
        return rng.randbytes(2 * rng.randrange(3))
    if field.type == FieldDescriptor.TYPE_STRING:
        return rng.choice(("", "a", "bc9"))
    if field.type == FieldDescriptor.TYPE_BOOL:
        return rng.random() < 1 / 2
    if field.cpp_type in LIMITS:
        low, high = LIMITS[field.cpp_type]
        if field.name == "small":
            low, high = -128, 127
        return rng.choice((0, low, high, max(low, -1), 1, rng.randint(low, high)))
    return struct.unpack("<f", struct.pack("<f", rng.uniform(-1e6, 1e6)))[0]
