"""How things are called in generated Python."""

from __future__ import annotations

import keyword
from dataclasses import dataclass

from rosidl_adapter_proto import adapter
from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.model import TypeName, parts
from rosidl_adapter_proto.schema.proto import ProtoFile

_NAMES_IN_MODULES = frozenset(
    {
        *(name for name in adapter.__all__ if name.islower()),
        *("adapter", "float", "getattr", "list", "setattr", "staticmethod", "type", "typing"),
        *("arrays", "destination", "error", "field", "message", "source", "type_name"),
        *("DESCRIPTOR", "annotations"),
    }
)
"""What generated modules call something themselves, so that no interface can be called so; `.idl` files might try."""


def check_module_names(name: TypeName) -> None:
    """Check that an interface can have Python modules, with classes of its name.

    Raises:
        SchemaError: It cannot.
    """
    for part in (name.package, name.name):
        if keyword.iskeyword(part):
            raise SchemaError(f"{name}: {part!r} is a keyword of Python; rename it")
    if name.name in _NAMES_IN_MODULES:
        raise SchemaError(
            f"{name}: generated modules use the name {name.name!r} themselves; "
            "rename the interface, in ROS's style with an upper case letter first"
        )


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


def exports(file: ProtoFile, names: Names) -> dict[str, str]:
    """Return every public name of the modules of a file, and the module, relative to the package, that has it."""
    interface = file.source
    own = [each.type_name for each in file.messages]
    groups = parts(interface)
    of_adapters = (*map(names.adapter, (*own, *groups)), *(each.name for each in groups))
    return {
        **dict.fromkeys((each.name for each in own), f"{interface.name.name}_pb2"),
        **dict.fromkeys(of_adapters, f"{interface.name.name}_adapter"),
    }
