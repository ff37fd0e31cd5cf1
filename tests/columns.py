"""What columns of messages must hold, told by their protobuf objects; and types to make columns of."""

from __future__ import annotations

import struct
from typing import Any

import pyarrow as pa
from ros_types import Types, describe, element_name, protobuf_class, shape

from rosidl_adapter_proto.schema.registry import Schema

EMPTY = "structure_needs_at_least_one_member"
CHARACTERS = {"char": "ascii", "wchar": "utf-16-le"}
NANOSECONDS = {"builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration"}


def schema_of(types: Types, name: str) -> Schema:
    """Return the schema of a type whose protobuf class is in a pool of its own."""
    nothing: Any = None
    made: Any = protobuf_class(types, name)
    return Schema(name, "", describe(types, name), nothing, nothing, None, {}, made)


def row_of(types: Types, name: str, message: Any) -> dict[str, Any]:
    """Return the values that a protobuf message has in columns; nothing of what has no fields."""
    row = {each["name"]: _field(types, each, message) for each in types[name]["fields"]}
    return {field: value for field, value in row.items() if value is not None}


def _field(types: Types, field: dict[str, Any], message: Any) -> Any:
    name, element, nested = field["name"], element_name(field), field["type"]["nested_type_name"]
    if name == EMPTY or (nested and is_empty(types, nested)):
        return None
    value = getattr(message, name)
    if shape(field) == "single":
        return _element(types, field, value)
    if element in ("uint8", "octet"):
        return value
    if element == "int8":
        return list(struct.unpack(f"{len(value)}b", value))
    if element in CHARACTERS:
        raw = value.encode(CHARACTERS[element])
        return list(struct.unpack(f"{len(value)}B" if element == "char" else f"<{len(raw) // 2}H", raw))
    return [_element(types, field, each) for each in value]


def _element(types: Types, field: dict[str, Any], value: Any) -> Any:
    nested = field["type"]["nested_type_name"]
    if nested in NANOSECONDS:
        return value.sec * 10**9 + value.nanosec
    if nested:
        return row_of(types, nested, value)
    return value.decode("utf-16-le") if element_name(field) == "wstring" else value


def is_empty(types: Types, name: str) -> bool:
    """Tell whether a type has no fields, and so have the messages in it."""
    parts = [each["type"]["nested_type_name"] for each in types[name]["fields"] if each["name"] != EMPTY]
    return all(part and is_empty(types, part) for part in parts)


def rows_of(batch: pa.RecordBatch) -> list[dict[str, Any]]:
    """Return the rows of a record batch; times are nanoseconds."""
    batch.validate(full=True)
    columns = [each.cast(_without_times(each.type)).to_pylist() for each in batch.columns]
    return [dict(zip(batch.schema.names, row, strict=True)) for row in zip(*columns, strict=True)]


def _without_times(data_type: pa.DataType) -> pa.DataType:
    if pa.types.is_temporal(data_type):
        return pa.int64()
    if pa.types.is_struct(data_type):
        return pa.struct([each.with_type(_without_times(each.type)) for each in data_type])
    if pa.types.is_list(data_type) or pa.types.is_fixed_size_list(data_type):
        size = data_type.list_size if pa.types.is_fixed_size_list(data_type) else -1
        item = data_type.value_field
        return pa.list_(item.with_type(_without_times(item.type)), size)
    return data_type
