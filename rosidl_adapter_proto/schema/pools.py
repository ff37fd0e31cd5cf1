"""Where protobuf classes are that are made at run time.

A descriptor pool holds one version of each file. Classes of the default pool are shared with generated code, whichever
comes first; a registry with other versions has a pool of its own, for all its types.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from threading import RLock
from typing import Any, NamedTuple

from google.protobuf import descriptor_pool, reflection
from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message

from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.schema.generated import generated_module, import_if_there
from rosidl_adapter_proto.schema.proto import ProtoFile
from rosidl_adapter_proto.schema.typemap import proto_path

MessageClass = type[Message]


class File(NamedTuple):
    """The `.proto` file of an interface, as plain data and as a serialized FileDescriptorProto."""

    proto: ProtoFile
    serialized: bytes

    @property
    def interface(self) -> TypeName:
        """The name of the interface."""
        return self.proto.source.name


class RefusedError(Exception):
    """A pool does not take a file: it has another version, or a message of the same name."""


lock = RLock()
"""Held while something is looked for in pools and put into them."""

_own_pools: dict[Hashable, DescriptorPool] = {}
"""The pools of registries with other versions, by what decides their files: kept for good, as their classes are."""

_kept_classes: set[MessageClass] = set()
"""Every class that was made: releases of protobuf before 4.22 crash where that of a nested message is gone."""

_promised: dict[TypeName, str] = {}
"""Definitions of registries that share the default pool: their files come into it when they are asked for."""


def default_pool() -> DescriptorPool:
    """Return the pool of generated code."""
    return descriptor_pool.Default()


def own_pool(key: Hashable) -> DescriptorPool:
    """Return the pool of all registries that have the same files.

    Args:
        key: What decides the files.
    """
    return _own_pools.setdefault(key, DescriptorPool())


def promise(name: TypeName, text: str) -> None:
    """Keep the place of an interface in the default pool from other versions than that of a definition."""
    _promised.setdefault(name, text)


def is_promised_otherwise(name: TypeName, text: str) -> bool:
    """Tell whether the place of an interface in the default pool is kept for another version."""
    return _promised.get(name, text) != text


def in_default_pool(interface: TypeName) -> FileDescriptor | None:
    """Return the file of an interface in the default pool, in whatever version."""
    return _find(default_pool(), proto_path(interface))


def import_generated_code(interface: TypeName, python_root: str) -> None:
    """Import generated code of an interface, if there is any.

    If another version came into the default pool first, generated code could not be imported any more.
    """
    import_if_there(f"{generated_module(interface, python_root)}_pb2")


def load(pool: DescriptorPool, files: Sequence[File], python_root: str) -> FileDescriptor:
    """Return the last of some files in a pool, and make the classes of all messages.

    Args:
        pool: Where they are, or are put.
        files: A file and all that it imports, what is imported first.
        python_root: As for `message_class`.

    Raises:
        RefusedError: The pool does not take them.
    """
    for file in files:
        descriptor = _find(pool, file.proto.path) or _added(pool, file)
        if descriptor.serialized_pb != file.serialized:
            raise RefusedError(f"there is another version of {file.proto.path}")
        messages = descriptor.message_types_by_name.values()
        _kept_classes.update(message_class(each, file.interface, python_root) for each in messages)
    return descriptor


def message_class(descriptor: Descriptor, interface: TypeName, python_root: str) -> MessageClass:
    """Return the class of a message, which is the one that there is if generated code has made it already.

    Else it gets the module that generated code would give it: if that comes later, it takes this class.

    Args:
        descriptor: The message.
        interface: The interface that it is part of.
        python_root: The namespace package of generated code.
    """
    return _made(descriptor, f"{generated_module(interface, python_root)}_pb2")


def kept_class(descriptor: Descriptor) -> MessageClass:
    """Return the class of a message that is not one of ours, and make those of all messages in its files.

    Args:
        descriptor: A message in any pool.
    """
    with lock:
        waiting, files = [descriptor.file], {descriptor.file.name: descriptor.file}
        while waiting:
            for each in waiting.pop().dependencies:
                if each.name not in files:
                    files[each.name] = each
                    waiting.append(each)
        messages = [each for file in files.values() for each in file.message_types_by_name.values()]
        while messages:
            message = messages.pop()
            _kept_classes.add(_made(message, message.file.package))
            messages.extend(message.nested_types)
        return _made(descriptor, descriptor.file.package)


def _made(descriptor: Descriptor, module: str) -> MessageClass:
    metaclass: Any = reflection.GeneratedProtocolMessageType
    made: MessageClass = metaclass(
        descriptor.name, (Message,), {"DESCRIPTOR": descriptor, "__module__": module}
    )
    return made


def _find(pool: DescriptorPool, path: str) -> FileDescriptor | None:
    try:
        return pool.FindFileByName(path)
    except KeyError:
        return None


def _added(pool: DescriptorPool, file: File) -> FileDescriptor:
    try:
        pool.AddSerializedFile(file.serialized)
    except TypeError as error:
        raise RefusedError(str(error)) from None
    return pool.FindFileByName(file.proto.path)
