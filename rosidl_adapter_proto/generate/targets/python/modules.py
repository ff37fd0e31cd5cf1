"""From a `.proto` file to its Python modules, as plain data in which everything is decided.

Each interface gets three modules: `<Name>_pb2.py` with the protobuf classes, `<Name>_pb2.pyi` with their types, and
`<Name>_adapter.py` with the adapters. What a conversion does for each kind of field is decided here, one line of
Python at a time; the templates only put the lines into place.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from rosidl_adapter_proto.adapter import TypeAdapter
from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.description import field_type_description
from rosidl_adapter_proto.interfaces.model import (
    EMPTY_STRUCT_FIELD,
    Action,
    ArrayType,
    BasicType,
    FieldType,
    Interface,
    Message,
    SequenceType,
    Service,
    StringType,
    TypeName,
    Value,
    references,
    value_type,
)
from rosidl_adapter_proto.schema.proto import ProtoField, ProtoFile, ProtoMessage
from rosidl_adapter_proto.schema.typemap import proto_full_name

# What array.array calls the numeric types whose ROS arrays are array.array (sequences) or numpy (fixed arrays).
TYPECODES = {
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float": "f",
    "double": "d",
}
_NARROW_INTEGERS = ("int8", "uint8", "int16", "uint16")
_FIXED_WIDTH = ("int32", "uint32", "int64", "uint64", "float", "double")
_LARGEST_CHARACTER = {"char": 0x7F, "wchar": 0xFFFF}


@dataclass(frozen=True)
class AdapterField:
    """One field of an adapter.

    Attributes:
        name: Its name.
        info: The arguments of its `FieldInfo` after the name, as Python text.
        to_custom: The lines that convert it to protobuf.
        to_ros: The lines that convert it to ROS.
    """

    name: str
    info: str
    to_custom: tuple[str, ...]
    to_ros: tuple[str, ...]


@dataclass(frozen=True)
class AdapterConstant:
    """A constant of the ROS message, which becomes an attribute of the adapter class."""

    name: str
    value: str
    comment: tuple[str, ...]


@dataclass(frozen=True)
class MessageAdapter:
    """The adapter class of one message."""

    class_name: str
    custom: str
    custom_full_name: str
    type_name: str
    type_hash: str
    ros_class: str
    comment: tuple[str, ...]
    constants: tuple[AdapterConstant, ...]
    packed_numbers: tuple[int, ...]
    fields: tuple[AdapterField, ...]
    defaults: str
    has_defaults: bool

    @property
    def converted(self) -> tuple[AdapterField, ...]:
        """The fields that ROS has in Python: not the one that stands for an empty struct."""
        return tuple(each for each in self.fields if each.to_custom)


@dataclass(frozen=True)
class GroupAdapter:
    """The class that groups the adapters of a service or an action.

    Attributes:
        base: `ServiceAdapter` or `ActionAdapter`.
        parameters: The protobuf classes that the base is parametrized with.
        parts: What it has, and the class that each is.
    """

    class_name: str
    base: str
    parameters: tuple[str, ...]
    type_name: str
    type_hash: str
    ros_class: str
    parts: tuple[tuple[str, str], ...]


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
    """A message class in the type stub; fields named like keywords of Python are only in `all_names`."""

    name: str
    comment: tuple[str, ...]
    fields: tuple[StubField, ...]
    all_names: tuple[str, ...]
    self_name: str

    @property
    def attributes(self) -> tuple[StubField, ...]:
        """The fields that are plain attributes."""
        return tuple(each for each in self.fields if each.is_attribute)

    @property
    def properties(self) -> tuple[StubField, ...]:
        """The fields that cannot be assigned: messages and repeated fields."""
        return tuple(each for each in self.fields if not each.is_attribute)

    @property
    def message_fields(self) -> tuple[StubField, ...]:
        """The fields that can be asked for with `HasField`."""
        return tuple(each for each in self.fields if each.is_message)


@dataclass(frozen=True)
class PythonModules:
    """The Python modules of one interface.

    Attributes:
        name: The name of the interface; the modules are `<name>_pb2` and `<name>_adapter`.
        package: The Python package they are in.
        proto_path: The path of the `.proto` file.
        type_name: The ROS name of the interface.
        pb2_imports: Modules of the files that the `.proto` file imports.
        helpers: What the adapters use of `rosidl_adapter_proto.adapter`.
        adapter_imports: Module and class of other adapters that are used, and what the class is called here.
        custom_names: The protobuf classes.
        messages: Adapter classes.
        groups: Classes that group adapters.
        stubs: Message classes for the type stub.
    """

    name: str
    package: str
    proto_path: str
    type_name: str
    pb2_imports: tuple[str, ...]
    helpers: tuple[str, ...]
    adapter_imports: tuple[tuple[str, str, str], ...]
    custom_names: tuple[str, ...]
    messages: tuple[MessageAdapter, ...]
    groups: tuple[GroupAdapter, ...]
    stubs: tuple[StubMessage, ...]

    @property
    def stub_imports(self) -> tuple[tuple[str, str], ...]:
        """The modules that the type stub imports, and what each is called there."""
        return tuple((module, _stub_alias(module)) for module in self.pb2_imports)

    @property
    def has_containers(self) -> bool:
        """Whether the type stub has a repeated field."""
        return any("_containers." in field.type for message in self.stubs for field in message.fields)


@dataclass(frozen=True)
class Names:
    """How things are called in generated Python.

    Attributes:
        root: The namespace package at the top, such as `rosidl_proto`.
        catalog: Knows every type.
    """

    root: str
    catalog: Catalog

    def package(self, name: TypeName) -> str:
        """Return the Python package of a type."""
        return f"{self.root}.{name.package}.{name.namespace}"

    def module(self, name: TypeName, suffix: str) -> str:
        """Return the module of the interface that a type is part of."""
        owner = self.catalog.definition_name(name)
        return f"{self.package(owner)}.{owner.name}_{suffix}"

    def adapter(self, name: TypeName) -> str:
        """Return the class name of an adapter; not that of a message which happens to be called the same."""
        package = self.catalog.package(name.package)
        class_name = f"{name.name}Adapter"
        while TypeName(name.package, name.namespace, class_name) in package:
            class_name += "_"
        return class_name


def python_modules(file: ProtoFile, names: Names) -> PythonModules:
    """Decide what the Python modules of a `.proto` file are.

    Raises:
        SchemaError: A name is a keyword of Python.
    """
    source = file.source
    for part in (source.name.package, source.name.name):
        if keyword.iskeyword(part):
            raise SchemaError(f"{source.name}: {part!r} is a keyword of Python; rename it")
    local = _local_adapter_names(file, names)
    adapters = tuple(_message_adapter(each, source, names, local) for each in file.messages)
    groups = _groups(source, names)
    return PythonModules(
        name=source.name.name,
        package=names.package(source.name),
        proto_path=file.path,
        type_name=str(source.name),
        pb2_imports=tuple(
            f"{names.root}.{path.removesuffix('.proto').replace('/', '.')}_pb2" for path in file.imports
        ),
        helpers=_helpers(adapters),
        adapter_imports=tuple(
            (names.module(name, "adapter"), names.adapter(name), local_name)
            for name, local_name in local.items()
            if names.catalog.definition_name(name) != source.name
        ),
        custom_names=tuple(each.name for each in file.messages),
        messages=adapters,
        groups=groups,
        stubs=tuple(_stub(each, source, names) for each in file.messages),
    )


def exports(file: ProtoFile, names: Names) -> dict[str, str]:
    """Return every public name of the modules of a file, and the module, relative to the package, that has it."""
    interface = file.source
    groups: tuple[TypeName, ...] = ()
    if isinstance(interface, Service):
        groups = (interface.name,)
    elif isinstance(interface, Action):
        groups = (interface.send_goal.name, interface.get_result.name, interface.name)
    own = [each.source.name for each in file.messages]
    return {
        **dict.fromkeys((each.name for each in own), f"{interface.name.name}_pb2"),
        **dict.fromkeys((names.adapter(each) for each in (*own, *groups)), f"{interface.name.name}_adapter"),
    }


# --- Adapters ---


def _message_adapter(
    proto: ProtoMessage, interface: Interface, names: Names, local: Mapping[TypeName, str]
) -> MessageAdapter:
    message = proto.source
    packed_numbers = _packed_numbers(proto)
    return MessageAdapter(
        class_name=names.adapter(message.name),
        custom=proto.name,
        custom_full_name=proto_full_name(message.name),
        type_name=str(message.name),
        type_hash=names.catalog.hash(message.name),
        ros_class=_ros_class(message.name, interface),
        comment=_docstring_lines(message.comment),
        constants=tuple(
            AdapterConstant(
                _constant_name(each.name), _python_literal(each.value), _plain_lines(each.comment)
            )
            for each in message.constants
        ),
        packed_numbers=packed_numbers,
        fields=tuple(_adapter_field(each, local, packed_numbers) for each in proto.fields),
        defaults=_defaults(message),
        has_defaults=_has_defaults(message, names),
    )


def _constant_name(name: str) -> str:
    """Return the attribute of a constant; not one that adapters have already, as an `.idl` may name it."""
    return f"{name}_" if hasattr(TypeAdapter, name) or name in TypeAdapter.__annotations__ else name


def _ros_class(name: TypeName, interface: Interface) -> str:
    """Return where ROS has the Python class of a type: `module:Class`."""
    path = interface.name.name
    if isinstance(interface, Service):
        path += _ros_part(name, interface)
    elif isinstance(interface, Action):
        implementation = {
            interface.send_goal: "SendGoalService",
            interface.get_result: "GetResultService",
        }
        parts = {
            interface.goal.name: "Goal",
            interface.result.name: "Result",
            interface.feedback.name: "Feedback",
            interface.feedback_message.name: "Impl.FeedbackMessage",
        }
        if name in parts:
            path += f".{parts[name]}"
        for service, service_class in implementation.items():
            if name.name.startswith(service.name.name):
                path += f".Impl.{service_class}{_ros_part(name, service)}"
    return f"{interface.name.package}.{interface.name.namespace}:{path}"


def _ros_part(name: TypeName, service: Service) -> str:
    part = name.name.removeprefix(service.name.name).removeprefix("_")
    return f".{part}" if part else ""


def _groups(interface: Interface, names: Names) -> tuple[GroupAdapter, ...]:
    if isinstance(interface, Message):
        return ()
    if isinstance(interface, Service):
        return (_service_group(interface, interface, names),)
    services = (interface.send_goal, interface.get_result)
    parts = {
        "goal": interface.goal.name,
        "result": interface.result.name,
        "feedback": interface.feedback.name,
        "send_goal": interface.send_goal.name,
        "get_result": interface.get_result.name,
        "feedback_message": interface.feedback_message.name,
    }
    return (
        *(_service_group(each, interface, names) for each in services),
        GroupAdapter(
            class_name=names.adapter(interface.name),
            base="ActionAdapter",
            parameters=(interface.goal.name.name, interface.result.name.name, interface.feedback.name.name),
            type_name=str(interface.name),
            type_hash=names.catalog.hash(interface.name),
            ros_class=_ros_class(interface.name, interface),
            parts=tuple((part, names.adapter(name)) for part, name in parts.items()),
        ),
    )


def _service_group(service: Service, interface: Interface, names: Names) -> GroupAdapter:
    return GroupAdapter(
        class_name=names.adapter(service.name),
        base="ServiceAdapter",
        parameters=(service.request.name.name, service.response.name.name),
        type_name=str(service.name),
        type_hash=names.catalog.hash(service.name),
        ros_class=_ros_class(service.name, interface),
        parts=(
            ("request", names.adapter(service.request.name)),
            ("response", names.adapter(service.response.name)),
        ),
    )


def _helpers(adapters: Iterable[MessageAdapter]) -> tuple[str, ...]:
    """Return the functions of `rosidl_adapter_proto.adapter` that the lines of a module call."""
    lines = [
        line for adapter in adapters for field in adapter.fields for line in field.to_custom + field.to_ros
    ]
    called = {name for line in lines for name in re.findall(r"(?<![\w.])(\w+)\(", line)}
    passed = {name for line in lines for name in re.findall(r"\beach\((\w+),", line)}
    used_by_all = {"check_custom", "conversion_error", "finish_custom", "finish_ros_message"}
    if any(adapter.packed_numbers for adapter in adapters):
        called.add("packed_fields")
    return tuple(sorted((called | passed | used_by_all) - {"list", "getattr", "setattr"}))


def _local_adapter_names(file: ProtoFile, names: Names) -> dict[TypeName, str]:
    """Return what the adapters that a module refers to are called in it.

    An adapter of another package keeps its name unless the module has another use for it.
    """
    own = {message.source.name for message in file.messages}
    local = {name: names.adapter(name) for name in own}
    taken = {*local.values(), *(name.name for name in own), names.adapter(file.source.name)}
    referred = {name for message in file.messages for _, name in references(message.source)}
    for name in sorted(referred - own):
        class_name = names.adapter(name)
        if class_name in taken:
            class_name = f"{name.package}_{name.namespace}_{class_name}"
        local[name] = class_name
        taken.add(class_name)
    return dict(sorted(local.items()))


def _packed_numbers(proto: ProtoMessage) -> tuple[int, ...]:
    """Return the numbers of the fields that are read with `packed_fields`, all in one go.

    Not in a message that holds many others: these would be serialized here, and once more each for itself.
    """
    if any(each.repeated and isinstance(value_type(each.source.type), TypeName) for each in proto.fields):
        return ()
    return tuple(each.number for each in proto.fields if _is_packed(each))


def _is_packed(field: ProtoField) -> bool:
    element = value_type(field.source.type)
    return field.repeated and isinstance(element, BasicType) and element.name in _FIXED_WIDTH


def _adapter_field(
    proto: ProtoField, local: Mapping[TypeName, str], packed_numbers: tuple[int, ...]
) -> AdapterField:
    field = proto.source
    description = field_type_description(field.type)
    element = value_type(field.type)
    info = [str(description["type_id"])]
    if isinstance(element, TypeName):
        info += [str(description["capacity"]), "0", local[element]]
    elif description["string_capacity"]:
        info += [str(description["capacity"]), str(description["string_capacity"])]
    elif description["capacity"]:
        info += [str(description["capacity"])]
    if field.name == EMPTY_STRUCT_FIELD:
        return AdapterField(field.name, ", ".join(info), (), ())
    to_custom, to_ros = _conversion(proto, local, packed_numbers)
    return AdapterField(field.name, ", ".join(info), to_custom, to_ros)


Lines = tuple[str, ...]


def _conversion(
    proto: ProtoField, local: Mapping[TypeName, str], packed_numbers: tuple[int, ...]
) -> tuple[Lines, Lines]:
    """Return the lines that convert a field, to protobuf and to ROS."""
    field = proto.source
    source, target = _read("source", field.name), _read("message", field.name)
    if not isinstance(field.type, (ArrayType, SequenceType)):
        if isinstance(field.type, TypeName):
            adapter = local[field.type]
            return (
                (f"{adapter}.fill_custom({source}, {target})",),
                (f"{adapter}.fill_ros_message({source}, {target})",),
            )
        to_custom, to_ros = _scalar(field.type)
        return (
            (_assign(field.name, to_custom.format(source)),),
            (_assign(field.name, to_ros.format(source)),),
        )
    element = field.type.value_type
    checked = _checked(field.type, source, from_custom=False)
    received = _checked(field.type, source, from_custom=True)
    if isinstance(element, TypeName):
        adapter = local[element]
        to_custom_line = f"fill_each({adapter}.fill_custom, {checked}, {target})"
        if isinstance(field.type, ArrayType):
            value = f"ros_message_array({adapter}, {source}, {field.type.size})"
        else:
            value = f"ros_messages({adapter}, {received})"
        return (to_custom_line,), (_assign(field.name, value),)
    if isinstance(element, BasicType) and element.name in TYPECODES:
        return _numeric_array(proto, element, checked, packed_numbers)
    return _list(proto, element, checked, received)


def _numeric_array(
    proto: ProtoField, element: BasicType, checked: str, packed_numbers: tuple[int, ...]
) -> tuple[Lines, Lines]:
    field = proto.source
    source, target = _read("source", field.name), _read("message", field.name)
    code = TYPECODES[element.name]
    values = f'numbers({checked}, "{code}")'
    if proto.type == "bytes":
        to_custom = _assign(field.name, f"{values}.tobytes()")
    elif element.name in _FIXED_WIDTH:
        to_custom = f"message.MergeFromString(packed({proto.number}, {values}))"
    else:
        to_custom = f"{target}.extend({values}.tolist())"
    if proto.number in packed_numbers:
        data = f"arrays[{packed_numbers.index(proto.number)}]"
        array = f'array_of({data}, "{code}")'
    elif proto.type == "bytes":
        data, array = source, f'numbers({source}, "{code}")'
    else:
        array = f'elements({source}, "{code}")'
        data = f"{array}.tobytes()"
    if isinstance(field.type, ArrayType):
        return (to_custom,), (f"fill_array({target}, {array})",)
    bound = field.type.bound if isinstance(field.type, SequenceType) else None
    check = (f"at_most({source}, {bound})",) if bound else ()
    # A new ROS message has an empty array here, unless the definition has a default value.
    clear = (f"del {target}[:]",) if field.default else ()
    return (to_custom,), (*check, *clear, f"{target}.frombytes({data})")


def _list(
    proto: ProtoField, element: BasicType | StringType, checked: str, received: str
) -> tuple[Lines, Lines]:
    field = proto.source
    target = _read("message", field.name)
    zero = '""'
    if isinstance(element, BasicType) and element.name in ("octet", *_LARGEST_CHARACTER):
        if element.name == "octet":
            to_custom, to_ros, zero = f"octets({checked})", f"ros_octets({received})", 'b"\\0"'
        else:
            largest = _LARGEST_CHARACTER[element.name]
            to_custom, to_ros = f"characters({checked}, {largest})", f"ros_characters({received}, {largest})"
            zero = '"\\0"'
        to_custom_line = _assign(field.name, to_custom)
    else:
        convert, convert_back = _scalar(element)
        checked = f"sequence({checked})"
        if isinstance(element, BasicType):
            zero = "False" if element.name == "boolean" else "0.0"
        to_custom_line = f"{target}.extend({_each(convert, checked)})"
        to_ros = _each(convert_back, received)
    if isinstance(field.type, ArrayType):
        to_ros = f"{to_ros} or [{zero}] * {field.type.size}"
    return (to_custom_line,), (_assign(field.name, to_ros),)


def _each(convert: str, values: str) -> str:
    """Return the list of converted elements, where `convert` is a format with the element in it."""
    if convert == "{}":
        return f"list({values})"
    if match := re.fullmatch(r"(\w+)\(\{\}\)", convert):
        return f"each({match[1]}, {values})"
    return f"each(lambda value: {convert.format('value')}, {values})"


def _scalar(element: BasicType | StringType) -> tuple[str, str]:
    """Return how one value is converted, to protobuf and to ROS, with `{}` for the value."""
    if isinstance(element, StringType):
        to_custom, to_ros = ("wide({})", "ros_wide({})") if element.wide else ("string({})", "ros_string({})")
        if element.bound is None:
            return to_custom, to_ros
        return to_custom.format(f"text({{}}, {element.bound})"), f"text({to_ros}, {element.bound})"
    if element.name in _NARROW_INTEGERS:
        lowest, highest = element.scalar.range
        check = f"in_range({{}}, {lowest}, {highest})"
        return check, check
    if element.name in _LARGEST_CHARACTER:
        largest = _LARGEST_CHARACTER[element.name]
        return f"character({{}}, {largest})", f"ros_character({{}}, {largest})"
    return {
        "octet": ("octet({})", "ros_octet({})"),
        "float": ("float32({})", "{}"),
        "boolean": ("boolean({})", "{}"),
    }.get(element.name, ("{}", "{}"))


def _checked(field_type: ArrayType | SequenceType, values: str, *, from_custom: bool) -> str:
    """Return the values with a check of their number, where there is one."""
    if isinstance(field_type, ArrayType):
        return f"{'absent_or_exactly' if from_custom else 'exactly'}({values}, {field_type.size})"
    return f"at_most({values}, {field_type.bound})" if field_type.bound else values


def _read(owner: str, name: str) -> str:
    return f'getattr({owner}, "{name}")' if keyword.iskeyword(name) else f"{owner}.{name}"


def _assign(name: str, value: str) -> str:
    if keyword.iskeyword(name):
        return f'setattr(message, "{name}", {value})'
    return f"message.{name} = {value}"


# --- Default values and constants ---


def _defaults(message: Message) -> str:
    """Return the default values of a message as the Python text of a dictionary, in terms of protobuf."""
    items = [
        f"{each.name!r}: {_proto_literal(each.type, each.default)}"
        for each in message.fields
        if each.default is not None
    ]
    return "{" + ", ".join(items) + "}" if items else ""


def _has_defaults(message: Message, names: Names) -> bool:
    if any(each.default is not None for each in message.fields):
        return True
    # A sequence is empty by default, whatever its elements are.
    return any(
        _has_defaults(names.catalog.message(name), names)
        for field, name in references(message)
        if not isinstance(field.type, SequenceType)
    )


def _proto_literal(field_type: FieldType, value: Value) -> str:
    element = value_type(field_type)
    if isinstance(value, tuple):
        if isinstance(element, BasicType) and element.name in ("octet", "uint8", "int8"):
            return repr(bytes(int(each) & 0xFF for each in value))
        if isinstance(element, BasicType) and element.name in _LARGEST_CHARACTER:
            return repr("".join(chr(int(each)) for each in value))
        return "[" + ", ".join(_proto_literal(element, each) for each in value) + "]"
    if isinstance(element, StringType) and element.wide:
        return repr(str(value).encode("utf-16-le"))
    return _python_literal(value)


def _python_literal(value: Value) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return repr(value)


# --- Type stubs ---

_SCALAR_TYPES: Mapping[str, str] = {
    "bool": "_builtins.bool",
    "string": "_builtins.str",
    "bytes": "_builtins.bytes",
    "float": "_builtins.float",
    "double": "_builtins.float",
    **dict.fromkeys(("int32", "uint32", "fixed32", "sfixed32", "fixed64", "sfixed64"), "_builtins.int"),
}


def _stub(proto: ProtoMessage, interface: Interface, names: Names) -> StubMessage:
    return StubMessage(
        proto.name,
        _docstring_lines(proto.comment),
        tuple(
            _stub_field(each, interface, names) for each in proto.fields if not keyword.iskeyword(each.name)
        ),
        tuple(each.name for each in proto.fields),
        "_self" if any(each.name == "self" for each in proto.fields) else "self",
    )


def _stub_field(proto: ProtoField, interface: Interface, names: Names) -> StubField:
    element = value_type(proto.source.type)
    if isinstance(element, TypeName):
        plain = element.name
        if names.catalog.definition_name(element) != interface.name:
            plain = f"{_stub_alias(names.module(element, 'pb2'))}.{element.name}"
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
        _docstring_lines(proto.comment),
    )


def _stub_alias(module: str) -> str:
    """Return what a module is called in a type stub: no field can be called so, as the package itself could be."""
    return "_" + "_".join(module.split(".")[-3:])


def _plain_lines(lines: Iterable[str]) -> tuple[str, ...]:
    return tuple(part.rstrip() for line in lines for part in line.splitlines() or [""])


def _docstring_lines(lines: Iterable[str]) -> tuple[str, ...]:
    """Return lines that can stand in a docstring."""
    return tuple(line.replace("\\", "\\\\").replace('"""', r"\"\"\"") for line in _plain_lines(lines))
