"""Characters of `.idl`: what ROS and protobuf have of them, and that every way of conversion agrees."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.errors import ConversionError, DefinitionError
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source
from rosidl_adapter_proto.interfaces.idl import parse_idl
from rosidl_adapter_proto.interfaces.model import TypeName
from tests.folders import write_package

CHARACTERS = "char one; wchar wide; sequence<char, 3> many; sequence<wchar, 3> wides; wchar two[2];"


@pytest.fixture(params=["generated", "run time"])
def adapter(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """An adapter of a message that has them, whose ROS message is a namespace."""
    package = f"characters_{request.param.replace(' ', '_')}"
    text = f"module {package} {{ module msg {{ struct Foo {{ {CHARACTERS} }}; }}; }};"
    catalog = Catalog((folder_source(write_package(tmp_path / package, {"msg/Foo.idl": text})),))
    if request.param == "generated":
        generate(Request((package,)), catalog, tmp_path / "out", Options(python_root=f"{package}_root"))
        monkeypatch.syspath_prepend(tmp_path / "out" / "python")
        made: Any = importlib.import_module(f"{package}_root.{package}.msg").FooAdapter
    else:
        made = adapter_for(f"{package}/msg/Foo", TypeRegistry(catalog))
    made.ros_message_type = SimpleNamespace
    return made


def test_characters(adapter: Any) -> None:
    """Wide characters are UTF-16 code units, of which text in protobuf has pairs as one character."""
    message = adapter.custom_type(
        one=0x7F, wide=0xD800, many="a\x7f", wides="a\N{GRINNING FACE}", two="\N{GRINNING FACE}"
    )
    converted = adapter.convert_to_ros_message(message)
    assert vars(converted) == {
        "one": "\x7f",
        "wide": "\ud800",
        "many": ["a", "\x7f"],
        "wides": ["a", "\ud83d", "\ude00"],
        "two": ["\ud83d", "\ude00"],
    }
    assert adapter.convert_to_custom(converted) == message
    cdr = adapter.to_cdr(message)
    units = b"\3\0\0\0a\0\x3d\xd8\x00\xde\x3d\xd8\x00\xde"
    assert cdr == b"\0\1\0\0\x7f\0\x00\xd8\2\0\0\0a\x7f\0\0" + units
    assert adapter.from_cdr(cdr) == message


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
def test_protobuf_characters_that_ros_does_not_have(adapter: Any, fields: dict[str, Any], field: str) -> None:
    message = adapter.custom_type(**fields)
    for convert in (adapter.to_cdr, adapter.convert_to_ros_message):
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
def test_ros_characters_that_protobuf_does_not_have(adapter: Any, fields: dict[str, Any], field: str) -> None:
    values = {"one": "a", "wide": "b", "many": [], "wides": [], "two": ["c", "d"], **fields}
    with pytest.raises(ConversionError) as caught:
        adapter.convert_to_custom(SimpleNamespace(**values))
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
def test_cdr_characters_that_protobuf_does_not_have(adapter: Any, cdr: bytes, field: str) -> None:
    with pytest.raises(ConversionError) as caught:
        adapter.from_cdr(b"\0\1\0\0" + cdr)
    assert caught.value.field_path == field


def test_a_default_value_that_ros_does_not_have() -> None:
    text = "module pkg { module msg { struct Foo { @default(value='\\xe9') char a; }; }; };"
    with pytest.raises(DefinitionError, match=r"233 does not fit char: use a whole number from 0 to 127"):
        parse_idl(text, TypeName("pkg", "msg", "Foo"), "Foo.idl")
