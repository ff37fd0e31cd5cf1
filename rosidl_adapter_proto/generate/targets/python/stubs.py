"""Type stubs of protobuf classes."""

from __future__ import annotations

import keyword
from collections.abc import Mapping
from dataclasses import dataclass

from rosidl_adapter_proto.adapter.contract import is_plain_field
from rosidl_adapter_proto.generate.targets.python.comments import docstring_lines
from rosidl_adapter_proto.generate.targets.python.names import Names
from rosidl_adapter_proto.interfaces.model import Interface, TypeName
from rosidl_adapter_proto.schema.proto import ProtoField, ProtoMessage


@dataclass(frozen=True)
class StubField:
    """A field in the type stub: what it is when it is read, and what the constructor takes."""

    name: str
    is_attribute: bool
    is_message: bool
    type: str
    argument: str
    comment: tuple[str, ...]


@dataclass(frozen=True)
class StubMessage:
    """A message class in the type stub; fields named like keywords of Python are only in `all_names`.

    Fields named like attributes of every protobuf message are arguments of the constructor only.
    """

    name: str
    comment: tuple[str, ...]
    fields: tuple[StubField, ...]
    all_names: tuple[str, ...]
    self_name: str

    @property
    def attributes(self) -> tuple[StubField, ...]:
        """The fields that are plain attributes."""
        return tuple(each for each in self.fields if each.is_attribute and is_plain_field(each.name))

    @property
    def properties(self) -> tuple[StubField, ...]:
        """The fields that cannot be assigned: messages and repeated fields."""
        return tuple(each for each in self.fields if not each.is_attribute and is_plain_field(each.name))

    @property
    def message_fields(self) -> tuple[StubField, ...]:
        """The fields that can be asked for with `HasField`."""
        return tuple(each for each in self.fields if each.is_message)


_SCALAR_TYPES: Mapping[str, str] = {
    "bool": "_builtins.bool",
    "string": "_builtins.str",
    "bytes": "_builtins.bytes",
    "float": "_builtins.float",
    "double": "_builtins.float",
    **dict.fromkeys(("int32", "uint32", "fixed32", "sfixed32", "fixed64", "sfixed64"), "_builtins.int"),
}


def stub(proto: ProtoMessage, interface: Interface, names: Names) -> StubMessage:
    """Return the stub of a message of an interface."""
    return StubMessage(
        proto.name,
        docstring_lines(proto.comment),
        tuple(
            _stub_field(each, interface, names) for each in proto.fields if not keyword.iskeyword(each.name)
        ),
        tuple(each.name for each in proto.fields),
        "_self" if any(each.name == "self" for each in proto.fields) else "self",
    )


def _stub_field(proto: ProtoField, interface: Interface, names: Names) -> StubField:
    element = proto.element
    if isinstance(element, TypeName):
        plain = element.name
        if names.catalog.definition_name(element) != interface.name:
            plain = f"{stub_alias(names.module(element, 'pb2'))}.{element.name}"
        read = f"_containers.RepeatedCompositeFieldContainer[{plain}]" if proto.repeated else plain
        argument = f"_typing.Iterable[{plain}]" if proto.repeated else plain
    else:
        plain = _SCALAR_TYPES[proto.type]
        read = f"_containers.RepeatedScalarFieldContainer[{plain}]" if proto.repeated else plain
        argument = f"_typing.Iterable[{plain}]" if proto.repeated else plain
    is_message = isinstance(element, TypeName) and not proto.repeated
    return StubField(
        proto.name,
        not proto.repeated and not is_message,
        is_message,
        read,
        argument,
        docstring_lines(proto.comment),
    )


def stub_alias(module: str) -> str:
    """Return what a module is called in a type stub: no field can be called so, as the package itself could be."""
    return "_" + "_".join(module.split(".")[-3:])
