"""The types of members, constants and typedefs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from rosidl_adapter_proto.interfaces.idl.expressions import positive
from rosidl_adapter_proto.interfaces.idl.file import File, FullName, Node, Type
from rosidl_adapter_proto.interfaces.idl.names import candidates, scoped_name
from rosidl_adapter_proto.interfaces.idl.rosidl_parser import size_literal
from rosidl_adapter_proto.interfaces.idl.syntax import BASIC_TYPES
from rosidl_adapter_proto.interfaces.model import (
    NAMESPACES,
    ArrayType,
    FieldType,
    SequenceType,
    StringType,
    TypeName,
)
from rosidl_adapter_proto.interfaces.problem import wide_string_warning

_PATH_LENGTH = len(dataclasses.fields(TypeName))


def read_type(file: File, scope: FullName, node: Node) -> Type:
    """Read the type that stands before the names of members, constants or typedefs (rules 21 to 41)."""
    return _TYPE_READERS[node.data](file, scope, node)


def declared_type(file: File, scope: FullName, base: Type, declarator: Node) -> Type:
    """Return the type that a declarator makes of the type before it: `long a[3]` is an array of `long`."""
    identifier, *sizes = declarator.children
    if not sizes:
        return base
    if len(sizes) > 1 or isinstance(base.type, ArrayType):
        message = f"'{identifier}': an array of more than one dimension is not supported by ROS 2"
        raise file.problem(message, identifier)
    if isinstance(base.type, SequenceType):
        message = f"'{identifier}': an array of sequences is not supported by ROS 2: put them in a message"
        raise file.problem(message, identifier)
    return base._replace(type=ArrayType(base.type, positive(file, scope, sizes[0].children[0])))


def _basic_type(file: File, scope: FullName, node: Node) -> Type:
    return Type(BASIC_TYPES[" ".join(node.children)])


def _string_type(file: File, scope: FullName, node: Node) -> Type:
    keyword, *bound = node.children
    return Type(StringType(keyword == "wstring", positive(file, scope, bound[1]) if bound else None))


def _sequence_type(file: File, scope: FullName, node: Node) -> Type:
    _, _, element_node, *bound = node.children
    message = "a sequence of {} is not supported by ROS 2: put them in a message"
    if element_node.data == "sequence_type":
        raise file.problem(message.format("sequences"), node)
    element = read_type(file, scope, element_node)
    if isinstance(element.type, (ArrayType, SequenceType)):
        raise file.problem(message.format(_plural(element.type)), node)
    size = positive(file, scope, bound[1]) if len(bound) > 1 else None
    if size is None and element_node.data == "wide_string_type" and len(element_node.children) > 1:
        size = _bound_as_in_ros(file, element_node, element.type)
    return element._replace(type=SequenceType(element.type, size))


def _bound_as_in_ros(file: File, node: Node, element: FieldType) -> int | None:
    """Return the bound that `rosidl_parser` gives to a sequence of wide strings: that of the strings, by mistake.

    It is what is installed and hashed. Where a name or an expression stands for it, ROS 2 refuses the definition.
    """
    assert isinstance(element, StringType)
    expression = node.children[2]
    if element.bound is None or size_literal(expression) is None:
        return None
    file.warnings.append(f"{file.location(node)}: {wide_string_warning(element.bound)}")
    return element.bound


def _named_type(file: File, scope: FullName, node: Node) -> Type:
    """Return what a typedef or an enum stands for; any other name is that of a message."""
    for candidate in candidates(scope, node):
        if candidate in file.types:
            return file.types[candidate]
    absolute, path = scoped_name(node)
    *modules, name = path
    if not modules and name in file.typedefs:
        return file.typedefs[name]
    relative = not absolute and (not modules or (len(modules) == 1 and modules[0] in NAMESPACES))
    full_path = (*scope[: _PATH_LENGTH - len(path)], *path) if relative else path
    if len(full_path) != _PATH_LENGTH:
        message = f"unknown type '{'::'.join(path)}': define it above, or write package::msg::Name"
        raise file.problem(message, node)
    file.messages.setdefault(full_path, node)
    return Type(TypeName(*full_path))


def _nested_type(file: File, scope: FullName, node: Node) -> Type:
    message = (
        f"a type defined inside another is not supported by ROS 2: give the {node.children[0]} its own place"
    )
    raise file.problem(message, node)


_TYPE_READERS: dict[str, Callable[[File, FullName, Node], Type]] = {
    "base_type_spec": _basic_type,
    "string_type": _string_type,
    "wide_string_type": _string_type,
    "sequence_type": _sequence_type,
    "scoped_name": _named_type,
    "nested_dcl": _nested_type,
}


def _plural(type: ArrayType | SequenceType) -> str:
    return "arrays" if isinstance(type, ArrayType) else "sequences"
