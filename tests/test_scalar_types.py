"""Every scalar type in every form a field can have, from its definition to where it is used."""

from __future__ import annotations

import importlib
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy
import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto

from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.errors import ConversionError, DefinitionError
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


def msg_spellings(row: Scalar) -> Iterator[tuple[FieldType, str]]:
    for element, bound in elements(row):
        for name in (f"{each}{bound}" for each in row.msg):
            yield element, f"{name} a"
            yield ArrayType(element, 3), f"{name}[3] a"
            yield SequenceType(element), f"{name}[] a"
            yield SequenceType(element, 3), f"{name}[<=3] a"


def idl_spellings(row: Scalar) -> Iterator[tuple[FieldType, str]]:
    for element, bound in elements(row):
        for name in (f"{each}{bound and '<4>'}" for each in (row.name, *row.idl)):
            yield element, f"{name} a;"
            yield ArrayType(element, 3), f"{name} a[3];"
            yield SequenceType(element), f"sequence<{name}> a;"
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
def test_values_in_protobuf(row: Scalar, tmp_path: Path) -> None:
    """A protobuf class takes default values as protobuf fields have them, the smallest and the largest ones."""
    package = f"scalars_{row.name.replace(' ', '_')}"
    field_types = list(dict(idl_spellings(row)))
    members = " ".join(
        line.replace(" a", f" a{number}") for number, line in enumerate(dict(idl_spellings(row)).values())
    )
    text = f"module {package} {{ module msg {{ struct Foo {{ {members} }}; }}; }};"
    registry = TypeRegistry.from_folders(write_package(tmp_path / package, {"msg/Foo.idl": text}))
    message_class = registry[f"{package}/msg/Foo"].message_class
    for value in EXTREMES[row.family](row):
        fields = [
            Field(f"a{number}", each, value if type_parts(each).shape is Shape.SINGLE else (value,) * 3)
            for number, each in enumerate(field_types)
        ]
        defaults = {each.name: proto_field(each).default for each in fields}
        message = message_class.FromString(message_class(**defaults).SerializeToString())
        for name, default in defaults.items():
            found = getattr(message, name)
            assert (tuple(found) if isinstance(default, tuple) else found) == default


@pytest.mark.parametrize("row", SCALARS.values(), ids=SCALARS)
def test_generated_adapters(row: Scalar, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Generated adapters convert to a ROS message and back, and through CDR if the type has a form there."""
    lines = dict(idl_spellings(replace(row, idl=())))
    fields = [Field(f"a{number}", field_type) for number, field_type in enumerate(lines)]
    members = " ".join(
        line.replace(" a", f" {field.name}") for field, line in zip(fields, lines.values(), strict=True)
    )
    generated = generate_foo(f"generated_{row.name.replace(' ', '_')}", members, tmp_path, monkeypatch)
    generated.FooAdapter.ros_message_type = lambda: ros_message(fields)

    for value in EXTREMES[row.family](row):
        defaults = {
            field.name: proto_field(
                replace(
                    field, default=value if type_parts(field.type).shape is Shape.SINGLE else (value,) * 3
                )
            ).default
            for field in fields
        }
        message = generated.Foo(**defaults)

        converted = generated.FooAdapter.convert_to_ros_message(message)

        assert vars(converted).keys() == {field.name for field in fields}
        assert generated.FooAdapter.convert_to_custom(converted) == message
        if row.cdr is not None:
            assert generated.FooAdapter.from_cdr(generated.FooAdapter.to_cdr(message)) == message


def generate_foo(package: str, members: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Generate a message `Foo`, and return its module."""
    text = f"module {package} {{ module msg {{ struct Foo {{ {members} }}; }}; }};"
    write_package(folder / package, {"msg/Foo.idl": text})
    catalog = Catalog((folder_source(folder / package),))
    generate(Request((package,)), catalog, folder / "out", Options(python_root=f"{package}_root"))
    monkeypatch.syspath_prepend(folder / "out" / "python")
    return importlib.import_module(f"{package}_root.{package}.msg")


CHARACTERS = "char one; wchar wide; sequence<char, 3> many; sequence<wchar, 3> wides; wchar two[2];"


@pytest.fixture
def characters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    generated = generate_foo("characters", CHARACTERS, tmp_path, monkeypatch)
    generated.FooAdapter.ros_message_type = SimpleNamespace
    return generated


def test_characters(characters: Any) -> None:
    """Wide characters are UTF-16 code units, of which text in protobuf has pairs as one character."""
    message = characters.Foo(
        one=0x7F, wide=0xD800, many="a\x7f", wides="a\N{GRINNING FACE}", two="\N{GRINNING FACE}"
    )
    converted = characters.FooAdapter.convert_to_ros_message(message)
    assert vars(converted) == {
        "one": "\x7f",
        "wide": "\ud800",
        "many": ["a", "\x7f"],
        "wides": ["a", "\ud83d", "\ude00"],
        "two": ["\ud83d", "\ude00"],
    }
    assert characters.FooAdapter.convert_to_custom(converted) == message
    cdr = characters.FooAdapter.to_cdr(message)
    units = b"\3\0\0\0a\0\x3d\xd8\x00\xde\x3d\xd8\x00\xde"
    assert cdr == b"\0\1\0\0\x7f\0\x00\xd8\2\0\0\0a\x7f\0\0" + units
    assert characters.FooAdapter.from_cdr(cdr) == message


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"one": 0x80}, "one"),
        ({"one": 200}, "one"),
        ({"one": 256}, "one"),
        ({"wide": 0x10000}, "wide"),
        ({"many": "a\x80"}, "many[1]"),
        ({"many": "abcd"}, "many"),
        ({"wides": "ab\N{GRINNING FACE}"}, "wides"),
        ({"two": "a"}, "two"),
        ({"two": "a\N{GRINNING FACE}"}, "two"),
    ],
)
def test_protobuf_characters_that_ros_does_not_have(
    characters: Any, fields: dict[str, Any], field: str
) -> None:
    message = characters.Foo(**fields)
    for convert in (characters.FooAdapter.to_cdr, characters.FooAdapter.convert_to_ros_message):
        with pytest.raises(ConversionError) as caught:
            convert(message)
        assert caught.value.field_path == field


@pytest.mark.parametrize(
    ("fields", "field"),
    [
        ({"one": "\x80"}, "one"),
        ({"many": ["a", "\xff"]}, "many[1]"),
        ({"wides": ["a", "\ud83d", "b"]}, "wides"),
        ({"wides": ["\N{GRINNING FACE}"]}, "wides[0]"),
        ({"two": ["\ude00", "\ud83d"]}, "two"),
    ],
)
def test_ros_characters_that_protobuf_does_not_have(
    characters: Any, fields: dict[str, Any], field: str
) -> None:
    values = {"one": "a", "wide": "b", "many": [], "wides": [], "two": ["c", "d"], **fields}
    with pytest.raises(ConversionError) as caught:
        characters.FooAdapter.convert_to_custom(SimpleNamespace(**values))
    assert caught.value.field_path == field


@pytest.mark.parametrize(
    ("cdr", "field"),
    [
        (b"\x80\0" + bytes(14), "one"),
        (bytes(4) + b"\2\0\0\0a\xff" + bytes(10), "many[1]"),
        (bytes(8) + b"\2\0\0\0\x3d\xd8b\0" + bytes(4), "wides[0]"),
        (bytes(12) + b"\x00\xde\x3d\xd8", "two[0]"),
    ],
)
def test_cdr_characters_that_protobuf_does_not_have(characters: Any, cdr: bytes, field: str) -> None:
    with pytest.raises(ConversionError) as caught:
        characters.FooAdapter.from_cdr(b"\0\1\0\0" + cdr)
    assert caught.value.field_path == field


def test_a_default_value_that_ros_does_not_have() -> None:
    text = "module pkg { module msg { struct Foo { @default(value='\\xe9') char a; }; }; };"
    with pytest.raises(DefinitionError, match=r"233 does not fit char: use a whole number from 0 to 127"):
        parse_idl(text, NAME, "Foo.idl")


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
