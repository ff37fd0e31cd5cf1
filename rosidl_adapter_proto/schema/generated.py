"""Where generated Python code is."""

from __future__ import annotations

import importlib
from types import ModuleType

from rosidl_adapter_proto.interfaces.model import TypeName


def generated_module(interface: TypeName, python_root: str) -> str:
    """Return the module that an interface is generated to; `_pb2` or `_adapter` comes behind it.

    Args:
        interface: The message, service or action.
        python_root: The namespace package.
    """
    return f"{python_root}.{interface.package}.{interface.namespace}.{interface.name}"


def import_if_there(module: str) -> ModuleType | None:
    """Import a module; None if there is none.

    Raises:
        ModuleNotFoundError: It is there, but cannot import another one: it is broken, and says so.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise
        return None
