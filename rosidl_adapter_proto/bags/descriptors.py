"""The descriptors of protobuf messages in recordings: serialized `FileDescriptorSet`s.

A recording has a file with all that it imports (https://mcap.dev/spec/registry#protobuf). Messages of one recording may
have other fields or numbers than those of another, or than generated code: each set has a descriptor pool of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache

from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError

from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.interfaces.description import TypeDescription, described_type
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.interfaces.scalars import Scalar
from rosidl_adapter_proto.schema.pools import MessageClass, kept_class
from rosidl_adapter_proto.schema.typemap import proto_full_name
from rosidl_adapter_proto.transcode.protobuf_plan import tell_scalar

MAXIMUM_SIZE = 16 * 2**20
"""The largest descriptor set that is read, in bytes."""


def descriptor_set(descriptor: Descriptor, type_description: TypeDescription | None = None) -> bytes:
    """Return the file of a message and all that it imports, what is imported first, as a serialized set.

    Args:
        descriptor: The message.
        type_description: The ROS type of the message (REP-2011): what its protobuf fields do not tell of it, such as
            that bytes are numbers from -128 to 127, is then in a private option of these fields.
    """
    files: dict[str, FileDescriptorProto] = {}
    waiting: list[FileDescriptor] = [descriptor.file]
    while waiting:
        file = waiting.pop()
        if file.name not in files:
            files[file.name] = FileDescriptorProto.FromString(file.serialized_pb)
            waiting.extend(file.dependencies)
    if type_description is not None:
        _tell_scalars(files, type_description)
    return FileDescriptorSet(file=_in_order(files)).SerializeToString(deterministic=True)


def _tell_scalars(files: Mapping[str, FileDescriptorProto], type_description: TypeDescription) -> None:
    types = (type_description["type_description"], *type_description["referenced_type_descriptions"])
    fields = {
        f"{proto_full_name(TypeName.parse(each['type_name']))}.{field['name']}": field["type"]
        for each in types
        for field in each["fields"]
    }
    for file in files.values():
        for message in file.message_type:
            for field in message.field:
                ros_type = fields.get(f"{file.package}.{message.name}.{field.name}")
                element = ros_type and described_type(ros_type)[1]
                if isinstance(element, Scalar):
                    tell_scalar(field, element)


def recorded_class(data: bytes, full_name: str) -> MessageClass:
    """Return the class of the messages that a recording describes; the same set gives the same class.

    Args:
        data: The serialized set.
        full_name: The full name of the message.

    Raises:
        BagError: The set is damaged or not complete, or does not have the message.
    """
    try:
        descriptor = _pool(data).FindMessageTypeByName(full_name)
    except KeyError:
        raise BagError(f"its protobuf descriptor has no message {full_name!r}") from None
    return kept_class(descriptor)


@lru_cache(maxsize=64)
def _pool(data: bytes) -> DescriptorPool:
    """Return a pool that has the files of a set."""
    if len(data) > MAXIMUM_SIZE:
        raise BagError(f"its protobuf descriptor has more than {MAXIMUM_SIZE} bytes")
    try:
        files = FileDescriptorSet.FromString(data).file
    except DecodeError as error:
        raise BagError(f"its protobuf descriptor is damaged: {error}") from None
    by_name = {each.name: each for each in files}
    if not all(isinstance(each, str) for each in by_name):  # protobuf gives bytes for what is no text
        raise BagError("its protobuf descriptor has a file whose name is not UTF-8")
    if len(by_name) != len(files):
        raise BagError("its protobuf descriptor has two files of the same name")
    pool = DescriptorPool()
    for file in _in_order(by_name):
        try:
            pool.AddSerializedFile(file.SerializeToString())
        except (TypeError, ValueError) as error:
            raise BagError(
                f"protobuf does not take the file {file.name!r} of its descriptor: {error}"
            ) from None
    return pool


def _in_order(files: dict[str, FileDescriptorProto]) -> Iterator[FileDescriptorProto]:
    """Yield files behind those that they import, without recursion, since a chain may be long.

    Raises:
        BagError: One that is imported is missing, or files import each other.
    """
    done: set[str] = set()
    for first in files:
        path: dict[str, Iterator[str]] = {}
        waiting = [] if first in done else [first]
        while waiting:
            name = waiting.pop()
            path[name] = iter(files[name].dependency)
            while path and not waiting:
                current = next(reversed(path))
                needed = next((each for each in path[current] if each not in done), None)
                if needed is None:
                    del path[current]
                    done.add(current)
                    yield files[current]
                elif needed in path:
                    raise BagError(f"files of its protobuf descriptor import each other: {', '.join(path)}")
                elif needed not in files:
                    raise BagError(
                        f"its protobuf descriptor has no file {needed!r}, which {current!r} imports"
                    )
                else:
                    waiting.append(needed)
