"""How things are called in generated Python."""

from __future__ import annotations

from dataclasses import dataclass

from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.model import TypeName, parts
from rosidl_adapter_proto.schema.proto import ProtoFile


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
