"""What tests and fuzzing of the transcoder share: types, protobuf classes made from them, and values in every form.

A value of a message is a dictionary; from it come the ROS object, the protobuf message and CDR, each in its own way.
"""

from __future__ import annotations

import functools
import importlib
import json
import random
import struct
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from rosidl_adapter_proto.interfaces.description import TypeDescription
from rosidl_adapter_proto.interfaces.scalars import NESTED_TYPE_ID, SCALARS, CdrForm
from rosidl_adapter_proto.transcode import Transcoder

Types = dict[str, dict[str, Any]]
Value = dict[str, Any]

ROWS = {name: row for name, row in SCALARS.items() if row.cdr is not None}
"""Every scalar type that has a form in CDR."""

_FORMATS = {
    CdrForm.BOOLEAN: "?",
    CdrForm.UINT8: "B",
    CdrForm.INT8: "b",
    CdrForm.CHAR: "B",
    CdrForm.UINT16: "H",
    CdrForm.INT16: "h",
    CdrForm.WCHAR: "H",
    CdrForm.UINT32: "I",
    CdrForm.INT32: "i",
    CdrForm.FLOAT: "f",
    CdrForm.UINT64: "Q",
    CdrForm.INT64: "q",
    CdrForm.DOUBLE: "d",
}
"""What `struct` calls each form of numbers."""

NUMBER_FORMATS = {name: _FORMATS[row.cdr] for name, row in ROWS.items() if row.cdr and not row.is_string}
INTEGERS = {name: each for name, each in NUMBER_FORMATS.items() if ROWS[name].bits}
FLOATS = {name: each for name, each in NUMBER_FORMATS.items() if ROWS[name].largest_float}

TYPE_IDS = {"nested": NESTED_TYPE_ID, **{name: row.type_id for name, row in SCALARS.items()}}
BOUNDED_TYPE_IDS = {
    name: row.bounded_type_id for name, row in SCALARS.items() if row.bounded_type_id is not None
}
ELEMENT_NAMES = {number: name for ids in (TYPE_IDS, BOUNDED_TYPE_IDS) for name, number in ids.items()}


def _protobuf_type(name: str) -> Any:
    return getattr(FieldDescriptor, f"TYPE_{name.upper()}")


SINGLE = {
    "nested": FieldDescriptor.TYPE_MESSAGE,
    **{name: _protobuf_type(row.protobuf) for name, row in ROWS.items()},
}
"""The protobuf type of each IDL type, as numbers of `FieldDescriptorProto.Type`."""

TEXT_OR_BYTES = {name: _protobuf_type(row.many) for name, row in ROWS.items() if not row.repeated}
"""Those whose arrays and sequences are one protobuf field that is not repeated."""


def element_name(field: dict[str, Any]) -> str:
    """Return the IDL name of a field's element."""
    return ELEMENT_NAMES[(field["type"]["type_id"] - 1) % 48 + 1]


def shape(field: dict[str, Any]) -> str:
    """Return `single`, `array`, `bounded` or `unbounded`."""
    return ("single", "array", "bounded", "unbounded")[(field["type"]["type_id"] - 1) // 48]


@functools.cache
def installed_types() -> Types:
    """Return each struct of the interfaces in the running Python environment."""
    types: Types = {}
    for namespace in ("msg", "srv", "action"):
        for path in sorted(Path(sys.prefix, "share").glob(f"*/{namespace}/*.json")):
            description = json.loads(path.read_text())["type_description_msg"]
            for each in (description["type_description"], *description["referenced_type_descriptions"]):
                types[each["type_name"]] = each
    return types


def installed_messages() -> list[str]:
    """Return the names of the structs that are messages, not services or actions."""
    return [
        name
        for name, each in installed_types().items()
        if not any(field["name"] in ("request_message", "send_goal_service") for field in each["fields"])
    ]


def describe(types: Types, name: str) -> TypeDescription:
    """Return the full type description of one of `types`."""
    found: dict[str, dict[str, Any]] = {}

    def visit(each: str) -> None:
        for field in types[each]["fields"]:
            nested = field["type"]["nested_type_name"]
            if nested and nested not in found:
                found[nested] = types[nested]
                visit(nested)

    visit(name)
    result: Any = {
        "type_description": types[name],
        "referenced_type_descriptions": [found[each] for each in sorted(found)],
    }
    return result


def struct_type(name: str, /, **fields: str) -> Types:
    """Make a type from fields like `x="int32"`, `a="float[3]"`, `s="string<5>[<=2]"`, `m="test/msg/Inner[]"`."""
    described = []
    for field, text in fields.items():
        element, bracket, size = text.partition("[")
        bound, offset, capacity = 0, 0, 0
        if bracket:
            size = size.rstrip("]")
            offset = 144 if not size else 96 if size.startswith("<=") else 48
            capacity = int(size.lstrip("<=") or 0)
        if element.endswith(">"):
            element, _, bound_text = element[:-1].partition("<")
            bound = int(bound_text)
        type_id = BOUNDED_TYPE_IDS[element] if bound else TYPE_IDS.get(element, 1)
        described.append(
            {
                "name": field,
                "type": {
                    "type_id": type_id + offset,
                    "capacity": capacity,
                    "string_capacity": bound,
                    "nested_type_name": element if "/" in element else "",
                },
                "default_value": "",
            }
        )
    return {name: {"type_name": name, "fields": described}}


def hash_number(name: str) -> int:
    """Return the field number of rosidl_typesupport_protobuf."""
    number = zlib.crc32(name.encode()) % (2**29 - 1 - 1000) + 1
    return number + 1000 if number >= 19000 else number


def protobuf_class(types: Types, name: str, *, hashed: bool = True) -> type[Any]:
    """Make the protobuf class of a type, with hash numbers or in the order of declaration."""
    pool = descriptor_pool.DescriptorPool()

    def add(each: dict[str, Any], added: set[str]) -> None:
        """Add the file of a type after those of its parts."""
        if each["type_name"] in added:
            return
        added.add(each["type_name"])
        for field in each["fields"]:
            if field["type"]["nested_type_name"]:
                add(types[field["type"]["nested_type_name"]], added)
        package, namespace, message = each["type_name"].split("/")
        file = descriptor_pb2.FileDescriptorProto(
            name=f"{each['type_name']}.proto", package=f"{package}.{namespace}.pb", syntax="proto3"
        )
        proto = file.message_type.add(name=message)
        for index, field in enumerate(each["fields"]):
            element = element_name(field)
            one_field = shape(field) == "single" or element in TEXT_OR_BYTES
            field_proto = proto.field.add(
                name=field["name"],
                number=hash_number(field["name"]) if hashed else index + 1,
                label=1 if one_field else 3,
                type=(
                    SINGLE[element]
                    if shape(field) == "single"
                    else TEXT_OR_BYTES.get(element, SINGLE[element])
                ),
                json_name=f"j{index}",
            )
            nested = field["type"]["nested_type_name"]
            if nested:
                field_proto.type_name = ".{}.{}.pb.{}".format(*nested.split("/"))
                if f"{nested}.proto" not in file.dependency:
                    file.dependency.append(f"{nested}.proto")
        pool.AddSerializedFile(file.SerializeToString())

    add(types[name], set())
    package, namespace, message = name.split("/")
    descriptor = pool.FindMessageTypeByName(f"{package}.{namespace}.pb.{message}")
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(descriptor)
    return message_factory.MessageFactory(pool).GetPrototype(descriptor)  # before protobuf 4.22


def transcoder(
    types: Types, name: str, *, hashed: bool = True, **options: Any
) -> tuple[Transcoder, type[Any]]:
    """Return the transcoder of a type and its protobuf class."""
    message_class = protobuf_class(types, name, hashed=hashed)
    return Transcoder(describe(types, name), message_class.DESCRIPTOR, **options), message_class


# Values -------------------------------------------------------------------------------------------------------------

CHARACTERS = "abcdefgh XYZ09_/\u00e9\u00df\u20ac\u4e2d\U0001f600"
SIZES = (0, 0, 1, 2, 3, 9)
PAIR = (0xD83D, 0xDE00)
TEXT = 0.5


def random_value(types: Types, name: str, rng: random.Random) -> Value:
    """Return a value of a type; about a third of everything is zero or empty."""
    return {field["name"]: _random_field(types, field, rng) for field in types[name]["fields"]}


def _random_field(types: Types, field: dict[str, Any], rng: random.Random) -> Any:
    kind = shape(field)
    if kind == "single":
        return _random_element(types, field, rng)
    capacity = field["type"]["capacity"]
    size = capacity if kind == "array" else rng.choice(SIZES)
    size = min(size, capacity) if kind == "bounded" else size
    if element_name(field) == "wchar" and rng.random() < TEXT:
        return [*PAIR * (size // 2), *[0x61] * (size % 2)]
    return [_random_element(types, field, rng, repeated=True) for _ in range(size)]


def _random_element(types: Types, field: dict[str, Any], rng: random.Random, repeated: bool = False) -> Any:
    element = element_name(field)
    if element == "nested":
        return random_value(types, field["type"]["nested_type_name"], rng)
    if field["name"] == "structure_needs_at_least_one_member" or rng.random() < 0.3:
        return "" if "string" in element else 0
    if element in ("string", "wstring"):
        bound = field["type"]["string_capacity"] or 40
        return "".join(rng.choices(CHARACTERS, k=rng.randint(0, bound)))
    if element == "boolean":
        return rng.random() < 0.5
    if element in FLOATS:
        largest = min(ROWS[element].largest_float, 1e6)
        value = rng.choice((-0.0, float("inf"), float("-inf"), rng.uniform(-largest, largest), rng.random()))
        return struct.unpack(FLOATS[element], struct.pack(FLOATS[element], value))[0]
    if element == "char" or (element == "wchar" and repeated):
        return rng.choice((0x20, 0x41, 0x7F))
    bits = struct.calcsize(INTEGERS[element]) * 8
    low = -(1 << bits - 1) if INTEGERS[element].islower() else 0
    return rng.choice(
        (low, low + (1 << bits) - 1, rng.randrange(low, low + (1 << bits)), 1, low + (1 << bits - 1) - 1)
    )


def protobuf_message(types: Types, name: str, value: Value, message: Message) -> Message:
    """Fill a protobuf message; every nested message is present, as in ROS."""
    for field in types[name]["fields"]:
        field_name, element, content = field["name"], element_name(field), value[field["name"]]
        nested = field["type"]["nested_type_name"]
        if shape(field) == "single":
            if nested:
                part = getattr(message, field_name)
                part.SetInParent()
                protobuf_message(types, nested, content, part)
            else:
                setattr(message, field_name, _protobuf_value(element, content))
        elif nested:
            for each in content:
                protobuf_message(types, nested, each, getattr(message, field_name).add())
        elif element in TEXT_OR_BYTES:
            raw = struct.pack(f"<{len(content)}{INTEGERS[element]}", *content)
            text = {"char": "ascii", "wchar": "utf-16-le"}.get(element)
            setattr(message, field_name, raw.decode(text) if text else raw)
        else:
            getattr(message, field_name).extend(_protobuf_value(element, each) for each in content)
    return message


def _protobuf_value(element: str, value: Any) -> Any:
    if element == "wstring":
        return value.encode("utf-16-le", "surrogatepass")
    return bool(value) if element == "boolean" else value


def same_message(left: Message, right: Message) -> bool:
    """Compare bit by bit: -0.0 is not 0.0, NaN is NaN."""
    return left.SerializeToString(deterministic=True) == right.SerializeToString(deterministic=True)


def ros_class(name: str) -> Any:
    """Return the rclpy class of a type, those inside of services and actions included."""
    package, namespace, message = name.split("/")
    module = importlib.import_module(f"{package}.{namespace}")
    if namespace == "msg":
        return getattr(module, message)
    base, _, part = message.rpartition("_")
    if namespace == "srv":
        return getattr(getattr(module, base), part)
    if part in ("Goal", "Result", "Feedback"):
        return getattr(getattr(module, base), part)
    if part == "FeedbackMessage":
        return getattr(module, base).Impl.FeedbackMessage
    action, _, service = base.rpartition("_")
    return getattr(getattr(getattr(module, action).Impl, f"{service}Service"), part)


def ros_object(types: Types, name: str, value: Value) -> Any:
    """Make the ROS object of a value."""
    result = ros_class(name)()
    for field in types[name]["fields"]:
        field_name, element = field["name"], element_name(field)
        if field_name == "structure_needs_at_least_one_member":
            continue
        single = shape(field) == "single"
        content = [value[field_name]] if single else value[field_name]
        nested = field["type"]["nested_type_name"]
        if nested:
            content = [ros_object(types, nested, each) for each in content]
        elif element == "octet":
            content = [bytes([each]) for each in content]
        elif element == "boolean":
            content = [bool(each) for each in content]
        elif element in FLOATS:
            content = [float(each) for each in content]
        setattr(result, field_name, content[0] if single else content)
    return result


def fields_of(types: Types, name: str) -> Iterator[tuple[str, str, str]]:
    """Yield name, element and shape of each field."""
    for field in types[name]["fields"]:
        yield field["name"], element_name(field), shape(field)


def nasty_types() -> Types:
    """Return types with every kind of field that there is, `test/msg/Nasty` and its parts."""
    fields: dict[str, str] = {}
    for element in (
        *NUMBER_FORMATS,
        "string",
        "wstring",
        "string<3>",
        "wstring<3>",
        "test/msg/Fixed",
        "test/msg/Inner",
    ):
        stem = "f_" + element.rpartition("/")[2].replace("<", "_").replace(">", "")
        fields[f"{stem}_one"] = element
        fields[f"{stem}_array"] = f"{element}[3]"
        fields[f"{stem}_bounded"] = f"{element}[<=2]"
        fields[f"{stem}_many"] = f"{element}[]"
    return {
        **struct_type("test/msg/Empty", structure_needs_at_least_one_member="uint8"),
        **struct_type(
            "test/msg/Fixed",
            a="uint8",
            b="double",
            c="int16",
            d="float[2]",
            e="uint8[3]",
            f="test/msg/Empty",
            g="boolean",
        ),
        **struct_type("test/msg/Leaf", text="string", empties="test/msg/Empty[]", wide="wstring"),
        **struct_type("test/msg/Inner", leaf="test/msg/Leaf", x="float", leaves="test/msg/Leaf[]", n="uint8"),
        **struct_type("test/msg/Nasty", **fields),
    }
