"""Every scalar type in every form a field can have, from its definition to where it is used."""

from __future__ import annotations

import importlib
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from math import isinf
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy
import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto

from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.errors import ConversionError, SchemaError
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
    Family.FLOATING_POINT: lambda row: (-row.largest_float, row.largest_float),
    Family.OCTET: lambda row: row.range,
    Family.CHARACTER: lambda row: (0, row.largest_character),
    Family.STRING: lambda row: ("", "a\N{GRINNING FACE}"),
    Family.WSTRING: lambda row: ("", "a\N{GRINNING FACE}"),
}
"""Two values of each type, the smallest and the largest where there are such."""

REFUSED: Mapping[Family, Callable[[Scalar], tuple[ScalarValue, ...]]] = {
    Family.BOOLEAN: lambda row: (-1, 2),
    Family.INTEGER: lambda row: (row.range[0] - 1, row.range[1] + 1),
    Family.FLOATING_POINT: lambda row: (
        () if isinf(row.smallest_infinite) else (-row.smallest_infinite, row.smallest_infinite)
    ),
    Family.OCTET: lambda row: (row.range[0] - 1, row.range[1] + 1),
    Family.CHARACTER: lambda row: (row.largest_character + 1,),
    Family.STRING: lambda row: (),
    Family.WSTRING: lambda row: (),
}
"""The values next to the extremes that a type does not have; what strings refuse, their own tests say."""


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
    assert EXTREMES.keys() == REFUSED.keys() == set(Family)


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
    for fields, adapter in adapters_of(row, "scalars", tmp_path, monkeypatch):
        for value in EXTREMES[row.family](row):
            check_there_and_back(adapter, row, fields, value)


@pytest.mark.parametrize("row", SCALARS.values(), ids=SCALARS)
def test_values_that_a_type_does_not_have(
    row: Scalar, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first ones outside are errors from ROS, and from protobuf wherever a message can hold them."""
    for fields, adapter in adapters_of(row, "refused", tmp_path, monkeypatch):
        for field in fields:
            held = [check_refused(adapter, row, fields, field, value) for value in REFUSED[row.family](row)]
            assert not is_single(field) or any(held) == (proto_field(field).limits is not None)


def adapters_of(
    row: Scalar, prefix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[list[Field], Any]]:
    """Yield adapters of messages that have a row in every form and under every name, with their fields."""
    package = f"{prefix}_{row.name.replace(' ', '_')}"
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
            yield fields, adapter


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


def check_refused(adapter: Any, row: Scalar, fields: list[Field], field: Field, value: ScalarValue) -> bool:
    """Put a value that is refused into a field, between two others if there can be several.

    Returns:
        Whether a protobuf message can hold it.
    """
    good = EXTREMES[row.family](row)[0]
    values = value if is_single(field) else (good, value, good)
    paths = {field.name} if is_single(field) else {field.name, f"{field.name}[1]"}

    message = ros_message(fields)
    for each in fields:
        setattr(message, each.name, ros_values(row, good if is_single(each) else (good,) * 3))
    assert adapter.convert_to_custom(message)  # so that it is the value that is refused
    setattr(message, field.name, ros_values(row, values))
    with pytest.raises(ConversionError) as error:
        adapter.convert_to_custom(message)
    assert error.value.field_path in paths

    message = custom_message(adapter, field, values)
    if message is None:
        return False
    with pytest.raises(ConversionError) as error:
        adapter.convert_to_ros_message(message)
    assert error.value.field_path in paths
    if row.cdr is not None:
        with pytest.raises(ConversionError) as error:
            adapter.to_cdr(message)
        assert error.value.field_path in paths
        if not isinstance(getattr(message, field.name), str):
            assert "from {:.17g} to {:.17g}".format(*EXTREMES[row.family](row)) in error.value.reason
    return True


def ros_values(row: Scalar, values: Any) -> Any:
    """Return a value, or several, as ROS has them."""
    if isinstance(values, tuple):
        return [ros_values(row, each) for each in values]
    return chr(values) if row.family is Family.CHARACTER else values


def custom_message(adapter: Any, field: Field, values: Any) -> Any:
    """Return a protobuf message with a value, or several, in a field; None if protobuf cannot hold them."""
    proto = proto_field(field)
    value = values
    try:
        if isinstance(values, tuple) and not proto.repeated:
            value = bytes(values) if proto.type == "bytes" else "".join(map(chr, values))
        message = adapter.custom_type(**{field.name: value})
    except ValueError:
        return None
    found = getattr(message, field.name)
    if isinstance(found, str):
        found = memoryview(found.encode("utf-16-le")).cast("H")  # what ROS counts: above 0xFFFF, a pair
    return message if (tuple(found) if isinstance(values, tuple) else found) == values else None


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
    """They are the extremes, where there are any: where protobuf has more, see `check_refused`."""
    limits = proto_field(Field("a", BasicType(row.name) if not row.is_string else StringType())).limits
    assert limits == (EXTREMES[row.family](row) if limits and REFUSED[row.family](row) else None)
