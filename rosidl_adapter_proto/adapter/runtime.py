"""Adapters made at run time, from definitions alone: classes with all that generated ones have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from graphlib import TopologicalSorter
from threading import RLock
from typing import Any
from weakref import WeakKeyDictionary

from rosidl_adapter_proto.adapter.arrays import packed_fields
from rosidl_adapter_proto.adapter.base import ActionAdapter, FieldInfo, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.adapter.contract import constant_name
from rosidl_adapter_proto.adapter.interpreted import fills
from rosidl_adapter_proto.adapter.messages import check_custom, finish_custom, finish_ros_message
from rosidl_adapter_proto.adapter.values import CONVERSION_ERRORS, conversion_error
from rosidl_adapter_proto.interfaces.description import TypeDescription
from rosidl_adapter_proto.interfaces.model import Message, TypeName
from rosidl_adapter_proto.schema.conversion import NAMED_PARTS, has_defaults, message_conversion, ros_class
from rosidl_adapter_proto.schema.proto import ProtoMessage
from rosidl_adapter_proto.schema.registry import Schema, TypeRegistry

_lock = RLock()
"""Held while adapters are made, so that two threads never make one twice."""

_made: WeakKeyDictionary[TypeRegistry, dict[TypeName, Any]] = WeakKeyDictionary()
"""The adapters of each registry."""


def adapter_for(type_name: str, registry: TypeRegistry | None = None) -> Any:
    """Return the adapter of a type, without generated code.

    It is made of the definition when it is first asked for, and is the same class from then on. It has all that a
    generated adapter has, and is taken wherever one is. Where the process holds generated code of the same version of
    the type, the protobuf class is that of the generated code. The adapter is not: constants and default values come
    from the definition that the registry has, which a type hash does not tell apart.

    Args:
        type_name: The ROS name of a message, service or action, such as `sensor_msgs/msg/Imu`.
        registry: Where types come from. By default what is installed when this is first called, else the embedded
            store; one registry for the whole process.

    Returns:
        A subclass of `TypeAdapter`, `ServiceAdapter` or `ActionAdapter`.

    Raises:
        DefinitionError: There is no such type, something that it refers to is missing, or a definition is not valid.
        SchemaError: A type cannot be mapped to protobuf.
        TypeError: The name is no text, or the registry is none.
    """
    if registry is not None and not isinstance(registry, TypeRegistry):
        raise TypeError(f"registry must be a TypeRegistry, not {type(registry).__name__}")
    with _lock:
        if registry is None:
            registry = _default_registry()
        return _adapter(registry[type_name])


@cache
def _default_registry() -> TypeRegistry:
    return TypeRegistry()


def _adapter(schema: Schema) -> Any:
    """Return an adapter; those of all that it refers to are made before it."""
    made = _made.setdefault(schema.registry, {})
    name = TypeName.parse(schema.type_name)
    if name not in made:
        if schema.parts:
            made[name] = _group_adapter(schema)
        else:
            for each in _innermost_first(schema.type_description):
                if each not in made:
                    made[each] = _message_adapter(schema.registry[each], made)
    return made[name]


def _innermost_first(description: TypeDescription) -> Iterable[TypeName]:
    """Return the names of a message and all in it, each behind those that it refers to."""
    structs = (description["type_description"], *description["referenced_type_descriptions"])
    nested = {
        each["type_name"]: {field["type"]["nested_type_name"] for field in each["fields"]} - {""}
        for each in structs
    }
    return map(TypeName.parse, TopologicalSorter(nested).static_order())


def _group_adapter(schema: Schema) -> Any:
    base = ServiceAdapter if "request" in schema.parts else ActionAdapter
    parts = {part: _adapter(each) for part, each in schema.parts.items()}
    custom_types = {
        NAMED_PARTS[part]: each.custom_type for part, each in parts.items() if part in NAMED_PARTS
    }
    return _class(schema, base, {**parts, **custom_types})


def _message_adapter(schema: Schema, adapters: Mapping[TypeName, Any]) -> Any:
    proto = schema.message
    assert proto is not None  # it has no parts
    return _class(
        schema,
        TypeAdapter,
        {
            "custom_type": schema.message_class,
            "fields": tuple(
                FieldInfo(
                    each.name,
                    each.type_id,
                    each.capacity or 0,
                    each.string_bound or 0,
                    adapters[each.element] if isinstance(each.element, TypeName) else None,
                )
                for each in proto.fields
            ),
            "defaults": {
                each.name: list(each.default) if isinstance(each.default, tuple) else each.default
                for each in proto.fields
                if each.default is not None
            },
            "has_defaults": has_defaults(proto.source, lambda name: _source(schema.registry[name])),
            **{constant_name(name, proto.name): value for name, value in schema.constants.items()},
            **_conversions(proto, adapters),
        },
    )


def _source(schema: Schema) -> Message:
    assert schema.message is not None  # what a field refers to is a message
    return schema.message.source


def _class(schema: Schema, base: type[Any], attributes: Mapping[str, Any]) -> Any:
    name = TypeName.parse(schema.type_name)
    identity = {
        "__doc__": f"The adapter of {schema.type_name}, made at run time.",
        "__module__": __name__,
        "type_name": schema.type_name,
        "type_hash": schema.type_hash,
        "ros_class": ros_class(name, schema.file.source),
    }
    return type(f"{name.name}Adapter", (base,), {**identity, **attributes})


def _conversions(proto: ProtoMessage, adapters: Mapping[TypeName, Any]) -> dict[str, Any]:
    """Return the conversions of an adapter, as generated ones have them."""
    type_name = str(proto.type_name)
    conversion = message_conversion(proto)
    both = [(field.name, *fills(field, how, adapters)) for field, how in conversion.fields]
    fill_custom_fields = [(name, to_custom) for name, to_custom, _ in both]
    fill_ros_fields = [(name, to_ros) for name, _, to_ros in both]
    packed_numbers = conversion.packed_numbers

    def fill_custom(source: Any, message: Any) -> None:
        type(message).SetInParent(message)
        field = ""
        try:
            for field, fill in fill_custom_fields:  # noqa: B007  # errors name it
                fill(source, message, ())
        except CONVERSION_ERRORS as error:
            raise conversion_error(type_name, field, error) from None

    def fill_ros_message(source: Any, message: Any) -> None:
        field = ""
        try:
            arrays = packed_fields(source, *packed_numbers) if packed_numbers else ()
            for field, fill in fill_ros_fields:  # noqa: B007  # errors name it
                fill(source, message, arrays)
        except CONVERSION_ERRORS as error:
            raise conversion_error(type_name, field, error) from None

    def convert_to_custom(source: Any, destination: Any = None) -> Any:
        message = adapters[proto.type_name].custom_type()
        fill_custom(source, message)
        return finish_custom(message, destination)

    def convert_to_ros_message(source: Any, destination: Any = None) -> Any:
        adapter = adapters[proto.type_name]
        check_custom(source, adapter)
        message = adapter.ros_message_type()
        fill_ros_message(source, message)
        return finish_ros_message(message, destination, adapter)

    functions = (convert_to_ros_message, convert_to_custom, fill_ros_message, fill_custom)
    return {each.__name__: staticmethod(each) for each in functions}
