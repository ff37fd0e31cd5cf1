"""Where protobuf classes are that are made at run time: in the pool of generated code, if that can have them.

A descriptor pool holds one version of each file. Classes of the default pool are shared with generated code, whichever
comes first; what that cannot have, since it has another version, goes into another pool.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from threading import RLock
from typing import Any, NamedTuple

from google.protobuf import descriptor_pool, reflection
from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.schema.proto import ProtoFile
from rosidl_adapter_proto.schema.typemap import DEFAULT_PYTHON_ROOT

MessageClass = type[Message]


class File(NamedTuple):
    """The `.proto` file of an interface, as plain data and as a serialized FileDescriptorProto."""

    proto: ProtoFile
    serialized: bytes

    @property
    def interface(self) -> TypeName:
        """The name of the interface."""
        return self.proto.source.name


class _RefusedError(Exception):
    """A pool has another version of a file or message, or does not take it at all."""


_lock = RLock()

_other_pools: list[DescriptorPool] = []
"""Pools for versions of types that the default pool cannot have."""

_kept_classes: set[MessageClass] = set()
"""Every class that was made: releases of protobuf before 4.22 crash where that of a nested message is gone."""


def load(files: Sequence[File]) -> FileDescriptor:
    """Return the last of some files in the first pool that can have them all, and make the classes of all messages.

    Args:
        files: A file and all that it imports, what is imported first.

    Raises:
        SchemaError: Not even a new pool takes them.
    """
    default = descriptor_pool.Default()
    with _lock:
        if not _other_version(default, files):
            for file in files:
                if _find(default, file) is None:
                    _import_generated_code(file.interface)
        for pool in (default, *_other_pools):
            try:
                return _load_into(pool, files)
            except _RefusedError:
                continue
        pool = DescriptorPool()
        try:
            descriptor = _load_into(pool, files)
        except _RefusedError as error:
            name = files[-1].interface
            raise SchemaError(f"{name}: protobuf does not take what it becomes: {error}") from None
        _other_pools.append(pool)
        return descriptor


def message_class(descriptor: Descriptor, interface: TypeName) -> MessageClass:
    """Return the class of a message, which is the one that there is if generated code has made it already.

    Else it gets the module that generated code would give it: if that comes later, it takes this class.

    Args:
        descriptor: The message.
        interface: The interface that it is part of.
    """
    contents = {"DESCRIPTOR": descriptor, "__module__": _generated_module(interface)}
    metaclass: Any = reflection.GeneratedProtocolMessageType
    made: MessageClass = metaclass(descriptor.name, (Message,), contents)
    return made


def _load_into(pool: DescriptorPool, files: Sequence[File]) -> FileDescriptor:
    if other := _other_version(pool, files):
        raise _RefusedError(f"there is another version of {other.proto.path}")
    for file in files:
        descriptor = _find(pool, file) or _added(pool, file)
        messages = descriptor.message_types_by_name.values()
        _kept_classes.update(message_class(each, file.interface) for each in messages)
    return descriptor


def _other_version(pool: DescriptorPool, files: Sequence[File]) -> File | None:
    """Return the first file that a pool has in another version."""
    found = ((each, _find(pool, each)) for each in files)
    return next((each for each, there in found if there and there.serialized_pb != each.serialized), None)


def _find(pool: DescriptorPool, file: File) -> FileDescriptor | None:
    try:
        return pool.FindFileByName(file.proto.path)
    except KeyError:
        return None


def _added(pool: DescriptorPool, file: File) -> FileDescriptor:
    try:
        pool.AddSerializedFile(file.serialized)
    except TypeError as error:
        raise _RefusedError(str(error)) from None
    return pool.FindFileByName(file.proto.path)


def _generated_module(interface: TypeName) -> str:
    """Return the module that generated code has the protobuf classes of an interface in."""
    return f"{DEFAULT_PYTHON_ROOT}.{interface.package}.{interface.namespace}.{interface.name}_pb2"


def _import_generated_code(interface: TypeName) -> None:
    """Import generated code of an interface, if there is any.

    If another version came into the default pool first, generated code could not be imported any more.
    """
    module = _generated_module(interface)
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        if not f"{module}.".startswith(f"{error.name}."):  # what is missing is something that it needs
            raise
