"""Messages of protobuf that are no ROS types: the plugin has the pairs of an independent flattening."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from rosidl_adapter_proto.plotjuggler.host import open_plugin
from tests.plotjuggler.flattening import flatten_protobuf

Field = descriptor_pb2.FieldDescriptorProto
LIMITS = {
    **dict.fromkeys(("int32", "sint32", "sfixed32"), (-(2**31), 2**31 - 1)),
    **dict.fromkeys(("uint32", "fixed32"), (0, 2**32 - 1)),
    **dict.fromkeys(("int64", "sint64", "sfixed64"), (-(2**63), 2**63 - 1)),
    **dict.fromkeys(("uint64", "fixed64"), (0, 2**64 - 1)),
}
SCALARS = (*LIMITS, "bool", "float", "double", "string", "bytes")
NUMPY = {"uint8": "UINT8", "bool": "BOOL", "string": "STRING"}


def described(syntax: str) -> descriptor_pb2.FileDescriptorSet:
    """Return a file with every kind of field."""
    file = descriptor_pb2.FileDescriptorProto(name="any.proto", package="any", syntax=syntax)
    color = file.enum_type.add(name="Color")
    for number, name in ((0, "RED"), (7, "BLUE"), (-1, "NONE")):
        color.value.add(name=name, number=number)
    inner = file.message_type.add(name="Inner")
    outer = file.message_type.add(name="Outer")
    for message in (inner, outer):
        for number, name in enumerate(SCALARS, 1):
            kind = getattr(Field, f"TYPE_{name.upper()}")
            message.field.add(name=f"one_{name}", number=number, type=kind, label=Field.LABEL_OPTIONAL)
            message.field.add(name=f"many_{name}", number=number + 50, type=kind, label=Field.LABEL_REPEATED)
    for number, (kind, type_name) in enumerate(
        ((Field.TYPE_ENUM, ".any.Color"), (Field.TYPE_MESSAGE, ".any.Inner"))
    ):
        name = type_name.rpartition(".")[2].lower()
        for label, prefix in ((Field.LABEL_OPTIONAL, "one"), (Field.LABEL_REPEATED, "many")):
            outer.field.add(
                name=f"{prefix}_{name}",
                number=200 + 10 * number + label,
                type=kind,
                type_name=type_name,
                label=label,
            )
    for number, key in enumerate(("string", "int32", "bool"), 300):
        entry = outer.nested_type.add(name=f"By{key.capitalize()}Entry")
        entry.options.map_entry = True
        entry.field.add(
            name="key", number=1, type=getattr(Field, f"TYPE_{key.upper()}"), label=Field.LABEL_OPTIONAL
        )
        entry.field.add(
            name="value",
            number=2,
            type=Field.TYPE_MESSAGE,
            type_name=".any.Inner",
            label=Field.LABEL_OPTIONAL,
        )
        outer.field.add(
            name=f"by_{key}",
            number=number,
            type=Field.TYPE_MESSAGE,
            type_name=f".any.Outer.{entry.name}",
            label=Field.LABEL_REPEATED,
        )
    return descriptor_pb2.FileDescriptorSet(file=[file])


def value(field: Any, rng: random.Random) -> Any:
    name = field.name.rpartition("_")[2]
    if name in LIMITS:
        return rng.choice((0, 1, *LIMITS[name], rng.randint(*LIMITS[name])))
    choices: dict[str, Any] = {
        "bool": rng.random() < 0.5,
        "float": rng.choice((0.0, -0.5, float("inf"))),
        "double": rng.choice((0.0, -0.0, rng.random())),
        "string": rng.choice(("", "map", "ä€😀")),
        "bytes": rng.randbytes(rng.randint(0, 4)),
        "color": rng.choice((0, 7, -1)),
    }
    return choices[name]


def fill(message: Message, rng: random.Random) -> None:
    """Set some fields of a message."""
    for field in message.DESCRIPTOR.fields:
        part = getattr(message, field.name)
        if rng.random() < 0.3:
            continue
        if field.name.startswith("by_"):
            for key in {"string": ("a", "b/c"), "int32": (-3, 4), "bool": (True,)}[field.name[3:]]:
                fill(part[key], rng)
        elif field.type == FieldDescriptor.TYPE_MESSAGE:
            for each in (
                [part] if field.name.startswith("one") else [part.add() for _ in range(rng.randint(0, 2))]
            ):
                fill(each, rng)
        elif field.name.startswith("one"):
            setattr(message, field.name, value(field, rng))
        else:
            part.extend(value(field, rng) for _ in range(rng.randint(0, 3)))


@pytest.mark.parametrize("syntax", ["proto2", "proto3"])
def test_every_kind_of_field(syntax: str, plugin_files: dict[str, Path]) -> None:
    files = described(syntax)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(files.file[0].SerializeToString())
    message_class = message_factory.GetMessageClass(pool.FindMessageTypeByName("any.Outer"))
    parser = open_plugin(plugin_files["protobuf"]).parser("/any", "any.Outer", files.SerializeToString())
    rng = random.Random(syntax)
    for _ in range(50):
        message = message_class()
        fill(message, rng)
        expected = [
            (key, NUMPY.get(kind, kind.upper()), each) for key, kind, each in flatten_protobuf(message)
        ]
        found = parser.parse(message.SerializeToString())
        assert found.refused is None
        pairs = [(pair.key, pair.kind.name, pair.value) for pair in found.pairs]
        assert sorted(map(repr, pairs)) == sorted(map(repr, expected))
