"""Finds the adapter of what a user hands over: an adapter, a protobuf class, or a ROS type, which has none."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

from google.protobuf.message import Message

from rosidl_adapter_proto.adapter import ActionAdapter, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.errors import Error

DEFAULT_PYTHON_ROOT = "rosidl_proto"
"""The namespace package of generated code, unless it was generated with another one."""

CUSTOM_TYPE: dict[type, Callable[[Any], Any]] = {
    TypeAdapter: lambda adapter: adapter.custom_type,
    ServiceAdapter: lambda adapter: adapter.request.custom_type,
    ActionAdapter: lambda adapter: adapter.goal.custom_type,
}
"""The protobuf class that stands for an adapter of each kind."""

NAMES: dict[type, str] = {
    TypeAdapter: "a message, such as StringAdapter or String",
    ServiceAdapter: "a service, such as SetBoolAdapter or SetBool_Request",
    ActionAdapter: "an action, such as FibonacciAdapter or Fibonacci_Goal",
}


class AdapterNotFoundError(Error, TypeError):
    """A protobuf class has no adapter of the kind that is needed, or more than one."""


_found: dict[tuple[type, type], Any] = {}


def find_adapter(kind: type, given: object) -> Any:
    """Return the adapter of what a user gave to create something with.

    Args:
        kind: What is needed: `TypeAdapter`, `ServiceAdapter` or `ActionAdapter`.
        given: An adapter or a protobuf class (of a service its request, of an action its goal), or anything else.

    Returns:
        The adapter; None if `given` is neither, such as a ROS type.

    Raises:
        AdapterNotFoundError: It has none, or is one of another kind.
    """
    if not isinstance(given, type):
        return None
    if issubclass(given, kind):
        return given
    if issubclass(given, tuple(CUSTOM_TYPE)):
        raise AdapterNotFoundError(f"{given.__name__} is not the adapter of {NAMES[kind]}")
    if not issubclass(given, Message):
        return None
    if (kind, given) not in _found:
        _found[kind, given] = _search(kind, given)
    return _found[kind, given]


def _search(kind: type, custom_type: type[Message]) -> Any:
    for module in _adapter_modules(custom_type):
        for adapter in vars(module).values():
            if (
                isinstance(adapter, type)
                and issubclass(adapter, kind)
                and _is_for(kind, adapter, custom_type)
            ):
                return adapter
    imported = [adapter for adapter in _subclasses(kind) if _is_for(kind, adapter, custom_type)]
    if len(imported) == 1:
        return imported[0]
    name = f"{custom_type.__module__}.{custom_type.__qualname__}"
    if imported:
        found = " and ".join(f"{adapter.__module__}.{adapter.__qualname__}" for adapter in imported)
        raise AdapterNotFoundError(f"{name} has more than one adapter: {found}; pass the one to use")
    raise AdapterNotFoundError(
        f"{name} has no adapter for {NAMES[kind]}; pass the adapter, or import it first, "
        "or generate one with rosidl-proto generate"
    )


def _adapter_modules(custom_type: type[Message]) -> Iterator[ModuleType]:
    """Yield where an adapter was generated: beside the protobuf class, or where its `.proto` file belongs."""
    descriptor_path = custom_type.DESCRIPTOR.file.name.removesuffix(".proto").replace("/", ".")
    for name in (
        str(custom_type.__module__).removesuffix("_pb2"),
        f"{DEFAULT_PYTHON_ROOT}.{descriptor_path}",
    ):
        module_name = f"{name}_adapter"
        try:
            yield importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            # A module that is there, but cannot import another one, is broken, and says so.
            if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
                raise


def _subclasses(base: type) -> Iterator[Any]:
    subclasses: list[type] = base.__subclasses__()
    for subclass in subclasses:
        yield subclass
        yield from _subclasses(subclass)


def _is_for(kind: type, adapter: Any, custom_type: type[Message]) -> bool:
    try:
        return CUSTOM_TYPE[kind](adapter) is custom_type
    except AttributeError:  # a base class of adapters, which has no types yet
        return False
