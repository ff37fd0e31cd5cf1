"""Every type, CDR to protobuf to CDR: the values are equal, as ROS and a reference writer of CDR have them."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import pytest
from reference_cdr import CdrWriter
from ros_types import (
    Types,
    installed_messages,
    installed_types,
    protobuf_message,
    random_value,
    ros_class,
    ros_object,
    same_message,
)

from rosidl_adapter_proto import Schema, TypeRegistry
from rosidl_adapter_proto.converters import (
    Converter,
    ConverterRegistry,
    SerializationFormatConverter,
    SerializedBagMessage,
)
from rosidl_adapter_proto.converters.cdr import CdrConverter
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from tests.folders import write_package
from tests.things import DEFINITIONS

VALUES = 3


@pytest.fixture(scope="module")
def things(tmp_path_factory: pytest.TempPathFactory) -> TypeRegistry:
    """The package `things`, and the embedded store."""
    folder = write_package(tmp_path_factory.mktemp("src") / "things", DEFINITIONS)
    return TypeRegistry(Catalog((folder_source(folder), store_source("lyrical"))))


def messages(registry: TypeRegistry, names: list[str]) -> Iterator[Schema]:
    """Yield the schema of every message of some interfaces, those in services and actions included."""
    for name in names:
        open_schemas = [registry[name]]
        for schema in open_schemas:
            open_schemas.extend(schema.parts.values())
        yield from (each for each in open_schemas if not each.parts)


def types_of(schema: Schema) -> Types:
    description = schema.type_description
    structs = (description["type_description"], *description["referenced_type_descriptions"])
    return {each["type_name"]: dict(each) for each in structs}


def check(schema: Schema, cdr_format: str, registry: ConverterRegistry) -> None:
    """Check that messages of random values come back as they were, and are what they should be between."""
    types, name = types_of(schema), schema.type_name
    rng = random.Random(name)
    values = [random_value(types, name, rng) for _ in range(VALUES)]
    cdr = [SerializedBagMessage(CdrWriter(types).message(name, each).bytes(), "/topic", 1) for each in values]

    converted = Converter(cdr_format, "protobuf", registry).convert_batch(cdr, schema)
    protobuf = [each for each in converted if isinstance(each, SerializedBagMessage)]
    for value, message in zip(values, protobuf, strict=True):
        found = schema.message_class.FromString(bytes(message.serialized_data))
        assert same_message(found, protobuf_message(types, name, value, schema.message_class()))
    assert Converter("protobuf", cdr_format, registry).convert_batch(protobuf, schema) == cdr


class ObjectConverter(SerializationFormatConverter):
    """CDR, as plugins do it that have only `deserialize` and `serialize`."""

    def __init__(self) -> None:
        self.cdr = CdrConverter()

    def deserialize(self, *arguments: Any) -> None:
        self.cdr.deserialize(*arguments)

    def serialize(self, *arguments: Any) -> None:
        self.cdr.serialize(*arguments)


@pytest.mark.parametrize("cdr_format", ["cdr", "object"])
def test_without_ros(cdr_format: str, things: TypeRegistry) -> None:
    registry = ConverterRegistry()
    registry.register("object_converter", ObjectConverter)
    names = [each for each in things if cdr_format == "cdr" or each.startswith("things/")]
    for schema in messages(things, names):
        check(schema, cdr_format, registry)


def test_with_ros() -> None:
    """Messages that rclpy has serialized come back such that rclpy finds them equal."""
    serialization = pytest.importorskip("rclpy.serialization", reason="needs a ROS installation")
    registry, types = TypeRegistry(events=True), installed_types()
    there, back = Converter("cdr", "protobuf"), Converter("protobuf", "cdr")
    for name in installed_messages():
        ros = ros_object(types, name, random_value(types, name, random.Random(name)))
        recorded = SerializedBagMessage(serialization.serialize_message(ros))
        cdr = back.convert(there.convert(recorded, registry[name]), registry[name])
        assert serialization.deserialize_message(bytes(cdr.serialized_data), ros_class(name)) == ros
