"""From a `.proto` file to its Python modules, as plain data in which everything is decided.

Each interface gets three modules: `<Name>_pb2.py` with the protobuf classes, `<Name>_pb2.pyi` with their types, and
`<Name>_adapter.py` with the adapters. The templates only put into place what stands here.
"""

from __future__ import annotations

import keyword
from dataclasses import dataclass

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.generate.targets.python.adapters import (
    GroupAdapter,
    MessageAdapter,
    group_adapter,
    message_adapter,
)
from rosidl_adapter_proto.generate.targets.python.conversions import Writer
from rosidl_adapter_proto.generate.targets.python.names import Names
from rosidl_adapter_proto.generate.targets.python.stubs import StubMessage, stub, stub_alias
from rosidl_adapter_proto.interfaces.model import TypeName, parts, references
from rosidl_adapter_proto.schema.proto import ProtoFile


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
        return tuple((module, stub_alias(module)) for module in self.pb2_imports)

    @property
    def has_containers(self) -> bool:
        """Whether the type stub has a repeated field."""
        return any("_containers." in field.type for message in self.stubs for field in message.fields)


def python_modules(file: ProtoFile, names: Names) -> PythonModules:
    """Decide what the Python modules of a `.proto` file are.

    Raises:
        SchemaError: A name is a keyword of Python.
    """
    source = file.source
    for part in (source.name.package, source.name.name):
        if keyword.iskeyword(part):
            raise SchemaError(f"{source.name}: {part!r} is a keyword of Python; rename it")
    adapter_names = _local_adapter_names(file, names)
    writer = Writer(adapter_names)
    adapters = tuple(message_adapter(each, source, names, writer) for each in file.messages)
    groups = list(parts(source).items())
    groups.sort(key=lambda each: each[0] == source.name)  # an action refers to its services
    return PythonModules(
        name=source.name.name,
        package=names.package(source.name),
        proto_path=file.path,
        type_name=str(source.name),
        pb2_imports=tuple(
            f"{names.root}.{path.removesuffix('.proto').replace('/', '.')}_pb2" for path in file.imports
        ),
        helpers=tuple(sorted({*_USED_BY_ALL, *writer.helpers})),
        adapter_imports=tuple(
            (names.module(name, "adapter"), names.adapter(name), local_name)
            for name, local_name in adapter_names.items()
            if names.catalog.definition_name(name) != source.name
        ),
        custom_names=tuple(each.name for each in file.messages),
        messages=adapters,
        groups=tuple(group_adapter(name, group, source, names) for name, group in groups),
        stubs=tuple(stub(each, source, names) for each in file.messages),
    )


_USED_BY_ALL = ("check_custom", "conversion_error", "finish_custom", "finish_ros_message")


def _local_adapter_names(file: ProtoFile, names: Names) -> dict[TypeName, str]:
    """Return what the adapters that a module refers to are called in it.

    An adapter of another package keeps its name unless the module has another use for it.
    """
    own = {message.source.name for message in file.messages}
    local = {name: names.adapter(name) for name in own}
    groups = parts(file.source)
    taken = {*local.values(), *map(names.adapter, groups), *(name.name for name in (*own, *groups))}
    referred = {name for message in file.messages for _, name in references(message.source)}
    for name in sorted(referred - own):
        class_name = names.adapter(name)
        if class_name in taken:
            class_name = f"{name.package}_{name.namespace}_{class_name}"
        local[name] = class_name
        taken.add(class_name)
    return dict(sorted(local.items()))
