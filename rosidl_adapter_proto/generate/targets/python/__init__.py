"""The target `python`: protobuf classes, their type stubs, and adapters."""

from __future__ import annotations

from typing import Any

from rosidl_adapter_proto.adapter.contract import CONTRACT_VERSION
from rosidl_adapter_proto.generate.render import format_python, render
from rosidl_adapter_proto.generate.targets import Files, Generation
from rosidl_adapter_proto.generate.targets.python.layout import Layout, quoted
from rosidl_adapter_proto.generate.targets.python.modules import python_modules
from rosidl_adapter_proto.generate.targets.python.names import Names, exports
from rosidl_adapter_proto.schema.proto import ProtoFile


def interface_files(generation: Generation, file: ProtoFile) -> Files:
    """Return the Python modules of an interface.

    Raises:
        SchemaError: A name is a keyword of Python.
    """
    modules = python_modules(file, _names(generation))
    base = f"{modules.package.replace('.', '/')}/{modules.name}"
    serialized = generation.descriptors[file.path]
    texts = {
        f"{base}_pb2.py": _module("python/pb2.py.jinja", modules=modules, serialized=quoted(serialized)),
        f"{base}_pb2.pyi": _module("python/pb2.pyi.jinja", stub=True, modules=modules),
        f"{base}_adapter.py": _module("python/adapter.py.jinja", modules=modules),
    }
    return {path: text.encode() for path, text in texts.items()}


def package_files(generation: Generation) -> Files:
    """Return what packages have beside the modules: `__init__.py` and `py.typed`."""
    names = _names(generation)
    packages: dict[str, dict[str, str]] = {}
    for file in generation.files:
        packages.setdefault(names.package(file.source.name), {}).update(exports(file, names))
    files: dict[str, bytes] = {}
    for package, exported in sorted(packages.items()):
        folder = package.replace(".", "/")
        text = _module("python/init.py.jinja", package=package, exports=sorted(exported.items()))
        files[f"{folder}/__init__.py"] = text.encode()
        files[f"{folder}/py.typed"] = b""
    return files


def _module(template: str, *, stub: bool = False, **values: Any) -> str:
    """Render a module as black formats it. Black itself is only asked if there is something that it may change."""
    layout = Layout()
    text = render(template, layout=layout, contract_version=CONTRACT_VERSION, **values)
    return text if layout.is_complete(text) else format_python(text, stub=stub)


def _names(generation: Generation) -> Names:
    return Names(generation.options.python_root, generation.catalog)
