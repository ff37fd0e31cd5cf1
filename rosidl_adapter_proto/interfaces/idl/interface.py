"""From the definitions of a file to the message, service or action that they are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.idl.annotations import read_notes
from rosidl_adapter_proto.interfaces.idl.expressions import complement_mask
from rosidl_adapter_proto.interfaces.idl.file import File, FullName, Node, Type, placed
from rosidl_adapter_proto.interfaces.idl.mistakes import listed
from rosidl_adapter_proto.interfaces.idl.names import plain_name
from rosidl_adapter_proto.interfaces.idl.types import declared_type, read_type
from rosidl_adapter_proto.interfaces.idl.values import fitted_default
from rosidl_adapter_proto.interfaces.model import (
    EMPTY_STRUCT_FIELD,
    Action,
    Constant,
    Field,
    FieldType,
    Interface,
    Location,
    Message,
    Service,
    TypeName,
    Value,
    value_type,
)

_SERVICE_PARTS = ("_Request", "_Response")
_ACTION_PARTS = ("_Goal", "_Result", "_Feedback")


def read_interface(file: File, name: TypeName, text: str) -> Interface:
    """Return the interface that the structs of a file are.

    Raises:
        DefinitionError: They are none, or not that of `name`.
    """
    if file.structs.keys() == {_path(name)}:
        return _message(file, name, text)
    if service := _messages(file, name, _SERVICE_PARTS):
        request, response = service
        return Service(name, request, response, text)
    if action := _messages(file, name, _ACTION_PARTS):
        goal, result, feedback = action
        return Action(name, goal, result, feedback, text)
    raise _misplaced(file, name)


def _messages(file: File, name: TypeName, suffixes: tuple[str, ...]) -> list[Message]:
    """Return the messages of a service or an action, or none if these are not the structs of the file."""
    names = [name.sibling(suffix) for suffix in suffixes]
    complete = file.structs.keys() == {_path(each) for each in names}
    return [_message(file, each) for each in names] if complete else []


def _misplaced(file: File, name: TypeName) -> DefinitionError:
    """Return the error for a file that does not define what its place says."""
    choices = {"a message": ("",), "a service": _SERVICE_PARTS, "an action": _ACTION_PARTS}
    wanted = ", or ".join(
        f"{listed([name.name + suffix for suffix in suffixes], 'and')} ({kind})"
        for kind, suffixes in choices.items()
    )
    message = f"this file must define {wanted}, in module {name.package}::{name.namespace}; it defines"
    if not file.structs:
        return file.problem(f"{message} no struct", Location(file.label, 1))
    found = listed(["::".join(each) for each in [*file.structs][:4]], "and")
    allowed = {_path(name.sibling(suffix)) for suffixes in choices.values() for suffix in suffixes}
    culprit = next((each for each in file.structs if each not in allowed), next(iter(file.structs)))
    return file.problem(f"{message} {found}", file.structs[culprit].children[1])


def _path(name: TypeName) -> FullName:
    return name.package, name.namespace, name.name


def _message(file: File, name: TypeName, text: str = "") -> Message:
    path = _path(name)
    annotations, identifier, *members = file.structs[path].children
    if not members:
        hint = f"add 'uint8 {EMPTY_STRUCT_FIELD};'"
        raise file.problem(f"struct '{identifier}' is empty, which IDL does not allow: {hint}", identifier)
    fields: dict[str, Field] = {}
    enums: dict[int, tuple[Constant, ...]] = {}
    for member in members:
        base = read_type(file, path[:-1], member.children[1])
        enums[id(base.enumerators)] = base.enumerators
        for each in _fields(file, path[:-1], member, base):
            if fields.setdefault(each.name, each) is not each:
                raise file.problem(f"member '{each.name}' is defined twice: rename one", each.location)
    constants = _constants(file, name, enums.values())
    notes = read_notes(file, path[:-1], annotations)
    return Message(name, tuple(fields.values()), constants, notes.comment, notes.others, text)


def _fields(file: File, scope: FullName, member: Node, base: Type) -> Iterator[Field]:
    """Yield the fields that a member declares: more than one for `long a, b[3];`."""
    annotations, _, *declarators = member.children
    notes = read_notes(file, scope, annotations, complement_mask(value_type(base.type)))
    defaults: dict[FieldType, Value] = {}
    for declarator in declarators:
        identifier = declarator.children[0]
        type = declared_type(file, scope, base, declarator).type
        if notes.default and type not in defaults:
            with placed(file, notes.default[1], f"default of '{identifier}': "):
                defaults[type] = fitted_default(notes.default[0], type)
        location = file.location(identifier)
        default = defaults.get(type)
        yield Field(plain_name(identifier), type, default, notes.comment, notes.unit, notes.others, location)


def _constants(file: File, name: TypeName, enums: Iterable[tuple[Constant, ...]]) -> tuple[Constant, ...]:
    """Return the constants of a message: those of the module named after it, and of its enums."""
    module = (f"{name.name}_Constants",)
    declared = (constant for path, constant in file.constants.items() if path[-2:-1] == module)
    constants: dict[str, Constant] = {}
    for each in chain(declared, chain.from_iterable(enums)):
        if constants.setdefault(each.name, each) != each:
            message = f"{name.name} has two constants '{each.name}': rename one"
            raise file.problem(message, each.location)
    return tuple(constants.values())
