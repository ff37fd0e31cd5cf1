"""What generated modules call when they are imported: to bring their descriptors, and to export names lazily."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from google.protobuf import descriptor_pool

if TYPE_CHECKING:
    from google.protobuf.descriptor import FileDescriptor

descriptor_modules: set[str] = set()
"""The files of all modules that have brought a descriptor."""

_registered: dict[str, str] = {}


def add_descriptor_file(name: str, serialized: bytes, module_file: str) -> FileDescriptor:
    """Add a `.proto` file's descriptor to the default pool of this process.

    Args:
        name: The path of the `.proto` file, as imports name it.
        serialized: Its FileDescriptorProto.
        module_file: The module that brings it.

    Raises:
        ImportError: Another file of the same name is in the pool already.
    """
    descriptor_modules.add(module_file)
    pool = descriptor_pool.Default()  # type: ignore[no-untyped-call, unused-ignore]
    try:
        descriptor: FileDescriptor = pool.AddSerializedFile(serialized)
    except TypeError as error:
        raise _different_file(name, module_file, str(error)) from None
    # The pure-Python runtime keeps what was there first without a word.
    if descriptor is None:
        descriptor = pool.FindFileByName(name)
    if descriptor.serialized_pb != serialized:
        raise _different_file(name, module_file, "the contents differ")
    _registered.setdefault(name, module_file)
    return descriptor


def _different_file(name: str, module_file: str, detail: str) -> ImportError:
    other = _registered.get(name) or _module_of(name) or "another module"
    return ImportError(
        f"{module_file} and {other} bring different versions of {name} into one process ({detail}); "
        "generate both from the same definitions, with the same options"
    )


def _module_of(proto_name: str) -> str | None:
    for module in list(sys.modules.values()):
        descriptor = getattr(module, "__dict__", {}).get("DESCRIPTOR")
        if getattr(descriptor, "name", None) == proto_name:
            return getattr(module, "__file__", None) or module.__name__
    return None


def lazy_exports(
    package: str, modules: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package that imports its modules when a name is first asked for.

    Args:
        package: The name of the package.
        modules: The module, relative to the package, of each exported name.
    """

    def load(name: str) -> Any:
        module = modules.get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(f"{package}.{module}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted({*vars(sys.modules[package]), *modules})
