"""The fingerprint of a run: as long as it is the same, so is the output, and nothing needs to be parsed or written."""

from __future__ import annotations

import json
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

import rosidl_adapter_proto
from rosidl_adapter_proto.generate.manifest import digest
from rosidl_adapter_proto.generate.render import templates_folder
from rosidl_adapter_proto.generate.request import Request
from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.model import TypeName


def fingerprint(
    request: Request, catalog: Catalog, options: Options, lock_text: str | None, names: Iterable[TypeName]
) -> str:
    """Return a digest of everything that the generated files depend on.

    The closure of a request follows from the text of what is in it and from what else its packages have: as long as
    these are the same, nothing needs to be parsed.
    """
    names = sorted({*names, *_IN_EVERY_SERVICE})
    packages = {name.package: sorted(map(str, catalog.packages.get(name.package, ()))) for name in names}
    known = [name for name in names if name in catalog.packages.get(name.package, ())]
    content = {
        "tool": _tool_digest(),
        "request": [sorted(request.packages), sorted(map(str, request.types)), request.dependencies],
        "options": options.changing_output(),
        "lock": lock_text,
        "packages": packages,
        "definitions": {str(name): digest(catalog.definition(name).text.encode()) for name in known},
    }
    return digest(json.dumps(content).encode())


_IN_EVERY_SERVICE = (
    TypeName("service_msgs", "msg", "ServiceEventInfo"),
    TypeName("builtin_interfaces", "msg", "Time"),
)
"""The type hash of a service covers its `_Event`, even where that is not generated."""


def _tool_digest() -> str:
    """Return a digest of this program: what it generates may change with any of its files and libraries."""
    parts = [file.name + digest(file.read_bytes()) for file in program_files()]
    parts += [version(library) for library in ("black", "grpcio-tools", "jinja2")]
    return digest("".join(parts).encode())


def program_files() -> list[Path]:
    """Return every file of this program: which of them decide what is generated may change."""
    folders = {Path(rosidl_adapter_proto.__file__).resolve().parent, templates_folder()}
    files = sorted({file for folder in folders for file in folder.rglob("*.*")})
    return [file for file in files if file.suffix in (".py", ".jinja", ".lark")]
