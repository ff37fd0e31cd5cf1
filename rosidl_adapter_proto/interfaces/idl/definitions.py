"""Reads the definitions of a file: modules, constants, enums, typedefs and structs."""

from __future__ import annotations

from rosidl_adapter_proto.interfaces.idl.annotations import read_notes
from rosidl_adapter_proto.interfaces.idl.expressions import complement_mask, constant_value
from rosidl_adapter_proto.interfaces.idl.file import MAX_NESTING, File, FullName, Node, Type, placed
from rosidl_adapter_proto.interfaces.idl.names import plain_name
from rosidl_adapter_proto.interfaces.idl.types import declared_type, read_type
from rosidl_adapter_proto.interfaces.idl.values import fitted
from rosidl_adapter_proto.interfaces.model import BasicType, Constant, ScalarValue, StringType

_ENUM_TYPE = BasicType("uint32")


def read_definitions(file: File, scope: FullName, definitions: list[Node]) -> None:
    """Read the definitions of a file or a module into `file` (rules 1 to 3)."""
    for each in definitions:
        if not isinstance(each, str) and each.data in _DEFINITION_READERS:
            _DEFINITION_READERS[each.data](file, scope, each)


def _read_module(file: File, scope: FullName, node: Node) -> None:
    _, identifier, *definitions = node.children
    if len(scope) == MAX_NESTING:
        raise file.problem(f"modules are nested more than {MAX_NESTING} deep", identifier)
    read_definitions(file, (*scope, plain_name(identifier)), definitions)


def _read_constant(file: File, scope: FullName, node: Node) -> None:
    annotations, type_node, identifier, expression = node.children
    type = read_type(file, scope, type_node).type
    if not isinstance(type, (BasicType, StringType)):  # rule 6
        message = f"constant '{identifier}' must be a number, a boolean, a character or a string"
        raise file.problem(message, type_node)
    value = constant_value(file, scope, expression, complement_mask(type))
    with placed(file, expression, f"constant '{identifier}': "):
        value = fitted(value, type)
    path = (*scope, plain_name(identifier))
    _declare_value(file, path, value, identifier)
    notes = read_notes(file, scope, annotations)
    file.constants[path] = Constant(
        path[-1], type, value, notes.comment, notes.unit, file.location(identifier)
    )


def _read_enum(file: File, scope: FullName, node: Node) -> None:
    """Read an enum as what it is in CDR: `uint32`, with its enumerators as constants."""
    _, identifier, *enumerators = node.children
    constants: list[Constant] = []
    for each in enumerators:
        annotations, enumerator = each.children
        notes = read_notes(file, scope, annotations)
        following = int(constants[-1].value) + 1 if constants else 0
        values = (dict(note.parameters).get("value") for note in notes.others if note.name == "value")
        with placed(file, enumerator, f"enumerator '{enumerator}': "):
            value = fitted(next((v for v in values if v is not None), following), _ENUM_TYPE)
        path = (*scope, plain_name(enumerator))
        _declare_value(file, path, value, enumerator)
        constants.append(
            Constant(path[-1], _ENUM_TYPE, value, notes.comment, notes.unit, file.location(enumerator))
        )
    _declare_type(file, (*scope, plain_name(identifier)), Type(_ENUM_TYPE, tuple(constants)), identifier)


def _read_typedef(file: File, scope: FullName, node: Node) -> None:
    _, type_node, *declarators = node.children
    base = read_type(file, scope, type_node)
    for each in declarators:
        identifier = each.children[0]
        _declare_type(
            file, (*scope, plain_name(identifier)), declared_type(file, scope, base, each), identifier
        )


def _read_struct(file: File, scope: FullName, node: Node) -> None:
    identifier = node.children[1]
    path = (*scope, plain_name(identifier))
    for each in node.find_data("base_struct"):
        message = "inheritance is not supported by ROS 2: repeat the members of the base struct"
        raise file.problem(message, each)
    if path in file.structs:
        raise file.problem(f"struct '{identifier}' is defined twice: remove one", identifier)
    file.structs[path] = node


_DEFINITION_READERS = {
    "module_dcl": _read_module,
    "const_dcl": _read_constant,
    "enum_dcl": _read_enum,
    "typedef_dcl": _read_typedef,
    "struct_def": _read_struct,
}


def _declare_value(file: File, path: FullName, value: ScalarValue, identifier: Node) -> None:
    if path in file.values:
        raise file.problem(f"constant '{identifier}' is defined twice: remove or rename one", identifier)
    file.values[path] = value


def _declare_type(file: File, path: FullName, type: Type, identifier: Node) -> None:
    if path in file.messages:
        message = f"type '{identifier}' is used before it is defined: move its definition up"
        raise file.problem(message, file.messages[path])
    if file.types.setdefault(path, type) != type:
        message = f"type '{identifier}' is defined twice, not in the same way: remove or rename one"
        raise file.problem(message, identifier)
    file.typedefs.setdefault(path[-1], type)
