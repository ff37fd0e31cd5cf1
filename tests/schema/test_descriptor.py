"""Descriptors made without protoc, compared with those that protoc makes of the same files."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto

from rosidl_adapter_proto.generate.protoc import compile_protos
from rosidl_adapter_proto.generate.render import render
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import closure
from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source
from rosidl_adapter_proto.interfaces.model import ArrayType, BasicType, Field, Message, SequenceType, TypeName
from rosidl_adapter_proto.interfaces.msg import parse_msg
from rosidl_adapter_proto.schema.descriptor import file_descriptor
from rosidl_adapter_proto.schema.numbering import HashNumbering, Numbering, SequentialNumbering
from rosidl_adapter_proto.schema.proto import ProtoFile, proto_file

# protoc before 26 has an option for fields with the same JSON name, but does not heed it in proto3.
PROTOC_TAKES_JSON_CONFLICTS = tuple(map(int, version("grpcio-tools").split(".")[:2])) >= (1, 66)

FOO = TypeName("pkg", "msg", "Foo")


def proto_files(catalog: Catalog, numbering: Numbering, *, events: bool) -> list[ProtoFile]:
    """Return the `.proto` file of everything that a catalog has."""
    return [
        proto_file(catalog.definition(each).interface, numbering, catalog.definition_name, events=events)
        for each in closure(catalog, catalog.packages, events=events)
    ]


def assert_equal_to_protoc(files: list[ProtoFile]) -> None:
    """Compare the bytes of each file's descriptor with protoc's."""
    texts = {file.path: render("proto/interface.proto.jinja", file=file) for file in files}
    expected = compile_protos(texts, texts)
    found = {file.path: file_descriptor(file).SerializeToString(deterministic=True) for file in files}
    differing = [path for path in expected if found[path] != expected[path]]
    for path in differing[:1]:
        assert FileDescriptorProto.FromString(found[path]) == FileDescriptorProto.FromString(expected[path])
    assert (found.keys(), differing) == (expected.keys(), [])


@pytest.mark.parametrize("numbering", [HashNumbering(), SequentialNumbering("lock", {})])
@pytest.mark.parametrize("events", [False, True])
def test_everything_that_is_installed(numbering: Numbering, events: bool, ros_prefix: Path) -> None:
    files = proto_files(Catalog((*prefix_sources(), store_source())), numbering, events=events)
    assert len(files) > 200
    assert sum(file.service is not None for file in files) > 20
    assert_equal_to_protoc(files)


@pytest.mark.parametrize("distribution", store.distributions())
def test_every_store(distribution: str) -> None:
    files = proto_files(Catalog((store_source(distribution),)), HashNumbering(), events=False)
    assert len(files) > 100
    assert_equal_to_protoc(files)


def test_removed_fields() -> None:
    numbering = SequentialNumbering("lock", {})
    for text in ("int8 b\nint8 a\nint8 c\nint8 d\nint8 e", "int8 c"):
        file = proto_file(parse_msg(text, FOO, "Foo.msg"), numbering, lambda name: name)
    assert file.messages[0].reserved_numbers == (1, 2, 4, 5)
    assert_equal_to_protoc([file])


def test_fields_that_share_a_json_name() -> None:
    message = Message(FOO, tuple(Field(each, BasicType("int8")) for each in ("x_1", "x1")))
    file = proto_file(message, HashNumbering(), lambda name: name)
    assert file.messages[0].has_json_conflict
    options = file_descriptor(file).message_type[0].options
    assert options.SerializeToString() == b"\x58\x01"
    if PROTOC_TAKES_JSON_CONFLICTS:
        assert_equal_to_protoc([file])


def test_names_that_mean_something_in_proto_files() -> None:
    names = ("message", "package", "repeated", "oneof", "syntax", "reserved", "bool", "bytes", "option")
    types = (BasicType("boolean"), SequenceType(FOO.sibling("Inner")), ArrayType(BasicType("char"), 2))
    fields = tuple(Field(name, types[index % len(types)]) for index, name in enumerate(names))
    inner = Message(FOO.sibling("Inner"), (Field("enum", BasicType("wchar")),))
    assert_equal_to_protoc(
        [proto_file(each, HashNumbering(), lambda name: name) for each in (inner, Message(FOO, fields))]
    )
