"""Targets: what turns the `.proto` files of a run into the content of files. `generate/outputs.py` lists them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rosidl_adapter_proto.generate.request import Request
from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.schema.proto import ProtoFile

Files = Mapping[str, bytes]
"""The content of files by their paths, with slashes."""

Progress = Callable[[int, int], None]
"""Is told how many interfaces are done, and how many there are."""


@dataclass(frozen=True)
class Generation:
    """All that a target may ask of a run.

    Attributes:
        request: What was asked for.
        options: How to generate.
        catalog: Knows every type.
        files: The `.proto` file of each interface that is generated.
        texts: The text of each `.proto` file, by path, and of those that they import.
        descriptors: What protoc made of each file: its serialized FileDescriptorProto, by path.
    """

    request: Request
    options: Options
    catalog: Catalog
    files: tuple[ProtoFile, ...]
    texts: Mapping[str, str]
    descriptors: Mapping[str, bytes]
