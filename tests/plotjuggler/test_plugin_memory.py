"""Our plugins where there is little memory: what cannot be done gives 0, and nothing ever traps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from protobuf_types import add_message

from rosidl_adapter_proto.plotjuggler.plugins import plugin_path
from tests.plotjuggler.released_host import ReleasedHost
from tests.plotjuggler.topics import ENCODINGS, topics

MEBIBYTE = 1 << 20
STEP = 64 * 1024
RULE = "=" * 80


def created(plugin: Path, limit: int, type_name: bytes, schema: bytes) -> bool:
    """Return whether a parser is made where the memory may not be larger; a trap is an error."""
    host = ReleasedHost(plugin, memory_limit=limit)
    addresses = []
    for text in (type_name, schema):
        address = host.call("malloc", len(text) + 1)
        if address == 0:
            return False
        host.memory.write(host.store, text + b"\0", address)
        addresses.append(address)
    return host.call("pj_parser_create", 0, *addresses) > 0


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_any_limit(plugin: Path, encoding: str) -> None:
    topic = topics(encoding)[0]
    enough = [
        created(plugin, limit, topic.type_name.encode(), topic.schema)
        for limit in range(MEBIBYTE - 5 * STEP, 5 * MEBIBYTE, STEP)
    ]
    assert enough == sorted(enough)
    assert not enough[0] and enough[-1]


def files(*texts: FileDescriptorProto) -> bytes:
    return FileDescriptorSet(file=texts).SerializeToString()


def many_fields() -> bytes:
    file = FileDescriptorProto(name="a", package="a", syntax="proto3")
    add_message(file, "T", **{f"f{index:x}": "repeated int32" for index in range(20_000)})
    return files(file)


def many_nested_fields() -> bytes:
    """Return messages of all kinds in each other, as often as is read."""
    file = FileDescriptorProto(name="a", package="a", syntax="proto3")
    add_message(file, "T", a=".a.T", b=".a.U", c=".a.V")
    add_message(file, "U", a=".a.T", b=".a.U", c=".a.V")
    add_message(file, "V", a=".a.T", b=".a.U", x="int32")
    return files(file)


def many_types() -> bytes:
    """Return types with the longest names."""
    file = FileDescriptorProto(name="a", package="p" * 500, syntax="proto3")
    for index in range(49_000):
        file.message_type.add(name=f"{index:x}")
    add_message(file, "T", x="int32")
    return files(file)


def many_enum_values() -> bytes:
    """Return an enum with the longest names, and fields that have as many values as is read."""
    file = FileDescriptorProto(name="a", package="a", syntax="proto3")
    enum = file.enum_type.add(name="E")
    for index in range(100):
        enum.value.add(name=f"{index:x}".rjust(500, "v"), number=index)
    add_message(file, "T", **{f"f{index:x}": "enum .a.E" for index in range(990)})
    return files(file)


def many_constants() -> bytes:
    return "".join(f"byte A{index:X}=1\n" for index in range(250_000)).encode()


def many_definitions(package: str) -> bytes:
    fields = "\n".join(f"T{index} t{index}" for index in range(9_990))
    definitions = (f"\n{RULE}\nMSG: {package}T{index}\nbyte x" for index in range(9_990))
    return (fields + "".join(definitions)).encode()


def lines(count: int, kind: str, rest: str = "") -> bytes:
    return ("".join(f"{kind} a{index:x}\n" for index in range(count)) + rest).encode()


LARGE: dict[str, tuple[str, bytes, Callable[[], bytes]]] = {
    "many fields": ("protobuf", b"a.T", many_fields),
    "many nested fields": ("protobuf", b"a.T", many_nested_fields),
    "many types": ("protobuf", b"p" * 500 + b".T", many_types),
    "many values": ("protobuf", b"a.T", many_enum_values),
    "many lines": ("ros2msg", b"a/T", lambda: lines(20_000, "byte")),
    "many fields of messages": (
        "ros2msg",
        b"a/T",
        lambda: lines(19_999, "U", f"{RULE}\nMSG: a/U\nbyte x"),
    ),
    "many definitions": ("ros2msg", b"a/T", lambda: many_definitions("a/")),
    "many definitions of long names": ("ros2msg", b"p" * 254 + b"/T", lambda: many_definitions("")),
    "many constants": ("ros2msg", b"a/T", many_constants),
    "many rules": ("ros2msg", b"a/T", lambda: f"{RULE}\nMSG: a/T\n".encode() * 46_000),
    "too long a name": ("ros2msg", b"a/T", lambda: b"byte " + b"a" * 4_000_000),
}


@pytest.mark.parametrize("kind", LARGE)
def test_large_schemas(kind: str) -> None:
    encoding, type_name, schema = LARGE[kind]
    text = schema()
    plugin = plugin_path(encoding)
    limits = [len(text) + part * MEBIBYTE for part in (2, 3, 5, 8, 13, 21, 34, 55, 89, 144)]
    enough = [created(plugin, limit, type_name, text) for limit in [*limits, 256 * MEBIBYTE]]
    assert enough == sorted(enough)
    assert not enough[0]
    assert enough[-1] == (kind != "too long a name")
