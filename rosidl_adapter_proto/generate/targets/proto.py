"""The target `proto`: `.proto` files."""

from __future__ import annotations

from rosidl_adapter_proto.generate.render import render
from rosidl_adapter_proto.generate.targets import Files, Generation
from rosidl_adapter_proto.schema.proto import ProtoFile


def proto_text(file: ProtoFile) -> str:
    """Return the text of a `.proto` file."""
    return render("proto/interface.proto.jinja", file=file)


def interface_files(generation: Generation, file: ProtoFile) -> Files:
    """Return the `.proto` file of an interface, which protoc has read already."""
    return {file.path: generation.texts[file.path].encode()}
