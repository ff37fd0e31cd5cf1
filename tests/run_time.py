"""Adapters made at run time beside generated ones."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.adapter import ActionAdapter, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source

MADE_LATER = ("codec", "transcoder", "ros_message_type", "ros_service_type", "ros_action_type")
ADAPTERS = (TypeAdapter, ServiceAdapter, ActionAdapter)


def made_at_run_time(things: SimpleNamespace) -> SimpleNamespace:
    """Return the package `things` with adapters made at run time in the place of the generated ones."""
    registry = registry_of(things.folder.parent / "things")

    def made(value: Any) -> Any:
        return adapter_for(value.type_name, registry) if is_adapter(value) else value

    modules = {
        name: SimpleNamespace(**{each: made(getattr(module, each)) for each in module.__all__})
        for name, module in vars(things).items()
        if name != "folder"
    }
    return SimpleNamespace(folder=things.folder, **modules)


@cache
def registry_of(folder: Path) -> TypeRegistry:
    """Return a registry of a package, which is the same one each time."""
    return TypeRegistry(Catalog((folder_source(folder), store_source())))


def is_adapter(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, ADAPTERS)


def check_attributes(made: Any, generated: Any) -> None:
    """Check that two adapters have the same attributes, and that the protobuf class is one and the same."""
    names = sorted(attribute_names(made) | attribute_names(generated))
    assert {each: shown(getattr(made, each)) for each in names} == {
        each: shown(getattr(generated, each)) for each in names
    }
    if issubclass(made, TypeAdapter):
        assert made.custom_type is generated.custom_type
        assert made.type_description() == generated.type_description()


def attribute_names(adapter: Any) -> set[str]:
    """Return what an adapter has besides its methods, and besides what is only made when it is first asked for."""
    return {
        name
        for name, value in vars(adapter).items()
        if not name.startswith("_") and not isinstance(value, staticmethod) and name not in MADE_LATER
    }


def shown(value: Any) -> str:
    """Return a value as text in which adapters are the types that they are for, and NaN equals itself."""
    if is_adapter(value):
        return f"<adapter of {value.type_name}>"
    if isinstance(value, tuple):
        return f"({', '.join(map(shown, value))})"
    return repr(value)
