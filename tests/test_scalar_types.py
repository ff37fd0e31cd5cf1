"""Every scalar type in every form a field can have, from its definition to where it is used."""

from __future__ import annotations

import importlib
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy
import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto

from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.description import described_type, field_type_description
from rosidl_adapter_proto.interfaces.find import folder_source
from rosidl_adapter_proto.interfaces.idl import parse_idl
from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    Field,
    FieldType,
    Message,
    ScalarValue,
    SequenceType,
    Shape,
    StringType,
    TypeName,
    type_parts,
)
from rosidl_adapter_proto.interfaces.msg import parse_msg
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Family, Scalar
from rosidl_adapter_proto.schema.descriptor import file_descriptor
from rosidl_adapter_proto.schema.numbering import HashNumbering
from rosidl_adapter_proto.schema.proto import ProtoField, proto_file
from tests.folders import write_package

NAME = TypeName("pkg", "msg", "Foo")

EXTREMES: Mapping[Family, Callable[[Scalar], tuple[ScalarValue, ScalarValue]]] = {
    Family.BOOLEAN: lambda row: (False, True),
    Family.INTEGER: lambda row: row.range,
    Family.FLOATING_POINT: lambda row: (-1.5, 2.0**127),
    Family.OCTET: lambda row: row.range,
    Family.CHARACTER: lambda row: (0, row.largest_character),
    Family.STRING: lambda row: ("", "a\N{GRINNING FACE}"),
    Family.WSTRING: lambda row: ("", "a\N{GRINNING FACE}"),
}
"""Two values of each type, the smallest and the largest where there are such."""


def elements(row: Scalar) -> Iterator[tuple[BasicType | StringType, str]]:
    """Yield the type of a row in the model, and what its name is followed by; strings also with a bound."""
    if row.is_string:
        yield StringType(row.family is Family.WSTRING), ""
        yield StringType(row.family is Family.WSTRING, 4), "<=4"
    else:
        yield BasicType(row.name), ""


def unbounded(element: BasicType | StringType) -> SequenceType:
    """Return a sequence without a bound; ROS 2's parser takes that of wide strings for one."""
    bound = element.bound if isinstance(element, StringType) and element.wide else None
    return SequenceType(element, bound)


def msg_spellings(row: Scalar) -> Iterator[tuple[FieldType, str]]:
    for element, bound in elements(row):
        for name in (f"{each}{bound}" for each in row.msg):
            yield element, f"{name} a"
            yield ArrayType(element, 3), f"{name}[3] a"
            yield unbounded(element), f"{name}[] a"
            yield SequenceType(element, 3), f"{name}[<=3] a"


def idl_spellings(row: Scalar) -> Iterator[tuple[FieldType, str]]:
    for element, bound in elements(row):
        for name in (f"{each}{bound and '<4>'}" for each in (row.name, *row.idl)):
            yield element, f"{name} a;"
            yield ArrayType(element, 3), f"{name} a[3];"
            yield unbounded(element), f"sequence<{name}> a;"
            yield SequenceType(element, 3), f"sequence<{name}, 3> a;"


FORMS = [
    pytest.param(row, field_type, id=line.removesuffix(" a;"))
    for row in SCALARS.values()
    for field_type, line in dict(idl_spellings(replace(row, idl=()))).items()
]
forms = pytest.mark.parametrize(("row", "field_type"), FORMS)


def proto_field(field: Field) -> ProtoField:
    (message,) = proto_file(Message(NAME, (field,)), HashNumbering(), lambda name: name).messages
    (found,) = message.fields
    return found


def test_there_are_values_of_every_family() -> None:
    assert EXTREMES.keys() == set(Family)


@pytest.mark.parametrize("row", SCALARS.values(), ids=SCALARS)
def test_definitions(row: Scalar) -> None:
    for field_type, line in msg_spellings(row):
        assert parse_msg(line, NAME, "Foo.msg").fields == (Field("a", field_type),)
    for field_type, line in idl_spellings(row):
        message = parse_idl(f"module pkg {{ module msg {{ struct Foo {{ {line} }}; }}; }};", NAME, "Foo.idl")
        assert message == Message(NAME, (Field("a", field_type),))


@forms
def test_descriptions(row: Scalar, field_type: FieldType) -> None:
    parts = type_parts(field_type)
    assert parts.element is row
    assert described_type(field_type_description(field_type)) == parts


@forms
def test_protobuf_fields_and_descriptors(row: Scalar, field_type: FieldType) -> None:
    field = proto_field(Field("a", field_type))
    is_single = field.shape is Shape.SINGLE
    assert field.element is row
    assert (field.type, field.repeated) == (
        (row.protobuf, False) if is_single else (row.many, row.many == row.protobuf)
    )
    message = Message(NAME, (Field("a", field_type),))
    (described,) = (
        file_descriptor(proto_file(message, HashNumbering(), lambda name: name)).message_type[0].field
    )
    assert described.type == getattr(FieldDescriptorProto, f"TYPE_{field.type.upper()}")
    assert (described.label == FieldDescriptorProto.LABEL_REPEATED) == field.repeated


@pytest.mark.parametrize("row", SCALARS.values(), ids=SCALARS)
def test_from_definitions_to_cdr(row: Scalar, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A value goes from protobuf to ROS and back, and through CDR if the type has a form there.

    It does so in every form of a field, under every name that a definition may use, in `.msg` and in `.idl`, and with
    adapters that are generated and ones that are made at run time.
    """
    package = f"scalars_{row.name.replace(' ', '_')}"
    of_idl, members = named_fields(idl_spellings(row))
    of_msg, lines = named_fields(msg_spellings(row))
    definitions = {
        "msg/Idl.idl": f"module {package} {{ module msg {{ struct Idl {{ {' '.join(members)} }}; }}; }};",
        "msg/Msg.msg": "\n".join(lines),
    }
    catalog = Catalog((folder_source(write_package(tmp_path / package, definitions)),))
    generate(Request((package,)), catalog, tmp_path / "out", Options(python_root=f"{package}_root"))
    monkeypatch.syspath_prepend(tmp_path / "out" / "python")
    generated = importlib.import_module(f"{package}_root.{package}.msg")
    registry = TypeRegistry(catalog)

    for name, fields in (("Idl", of_idl), ("Msg", of_msg)):
        adapters = (getattr(generated, f"{name}Adapter"), adapter_for(f"{package}/msg/{name}", registry))
        assert len({each.custom_type for each in adapters}) == 1
        for adapter in adapters:
            adapter.ros_message_type = partial(ros_message, fields)
            for value in EXTREMES[row.family](row):
                check_there_and_back(adapter, row, fields, value)


def named_fields(spellings: Iterator[tuple[FieldType, str]]) -> tuple[list[Field], list[str]]:
    """Return a field of each type with a name of its own, and the lines that define them."""
    fields, lines = [], []
    for number, (field_type, line) in enumerate(spellings):
        fields.append(Field(f"a{number}", field_type))
        lines.append(line.replace(" a", f" a{number}"))
    return fields, lines


def check_there_and_back(adapter: Any, row: Scalar, fields: list[Field], value: ScalarValue) -> None:
    """Put a value into every field, three times where there can be several, and convert there and back."""
    values = {
        each.name: proto_field(replace(each, default=value if is_single(each) else (value,) * 3)).default
        for each in fields
    }
    message = adapter.custom_type(**values)
    for name, expected in values.items():
        found = getattr(message, name)
        assert (tuple(found) if isinstance(expected, tuple) else found) == expected

    converted = adapter.convert_to_ros_message(message)

    assert vars(converted).keys() == values.keys()
    assert adapter.convert_to_custom(converted) == message
    if row.cdr is None and fields:
        with pytest.raises(
            SchemaError, match=f"{row.name} has no one layout in CDR and cannot be transcoded"
        ):
            adapter.to_cdr(message)
    else:
        assert adapter.from_cdr(adapter.to_cdr(message)) == message


def is_single(field: Field) -> bool:
    return type_parts(field.type).shape is Shape.SINGLE


def ros_message(fields: list[Field]) -> SimpleNamespace:
    """Return a new ROS message, as far as the adapters look at what is in it before they fill it."""
    message = SimpleNamespace()
    for field in fields:
        shape, element, capacity, _ = type_parts(field.type)
        assert isinstance(element, Scalar)
        if element.typecode and shape is Shape.ARRAY:
            setattr(message, field.name, numpy.zeros(capacity or 0, numpy.dtype(element.typecode)))
        elif element.typecode and shape is Shape.SEQUENCE:
            setattr(message, field.name, array(element.typecode))
    return message


@pytest.mark.parametrize("row", SCALARS.values(), ids=SCALARS)
def test_limits(row: Scalar) -> None:
    """Numbers that protobuf has and ROS has not are outside the limits."""
    limits = proto_field(Field("a", BasicType(row.name) if not row.is_string else StringType())).limits
    narrow = {"octet", "char", "wchar", "int8", "uint8", "int16", "uint16"}
    assert limits == (EXTREMES[row.family](row) if row.name in narrow else None)
