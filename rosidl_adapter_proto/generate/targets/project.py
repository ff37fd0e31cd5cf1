"""The project file: with it, pip installs an output folder."""

from __future__ import annotations

from collections.abc import Mapping

from rosidl_adapter_proto.generate.render import render
from rosidl_adapter_proto.generate.targets import Generation


def project_file(generation: Generation, shared_folders: Mapping[str, str]) -> bytes:
    """Return the pyproject.toml of an output folder.

    Args:
        generation: What is generated; the project is named after what was asked for.
        shared_folders: Where folders that are not Python's go in a prefix.
    """
    request, python_root = generation.request, generation.options.python_root
    requested = {*request.packages, *(name.package for name in request.types)}
    return render(
        "python/pyproject.toml.jinja",
        name="-".join([python_root, *sorted(requested)]).replace("_", "-"),
        packages=sorted({file.source.name.package for file in generation.files}),
        python_root=python_root,
        shared_folders=shared_folders,
    ).encode()
