"""Renders templates and formats Python: the only place that touches Jinja and black."""

from __future__ import annotations

import multiprocessing
import os
import re
import signal
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import black
import jinja2

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.python import PythonModules


@cache
def templates_folder() -> Path:
    """Return the folder of the templates: in the installed package, or at the top of a checkout."""
    package = Path(__file__).resolve().parent.parent
    for folder in (package / "templates", package.parent / "templates"):
        if folder.is_dir():
            return folder
    raise GenerateError(f"the templates are missing from {package}; install rosidl-adapter-proto again")


# Black has nothing to do for what is laid out as it does, and then takes half the time.


def import_from(module: str, name: str, indent: str = "") -> str:
    """Return an import as black lays it out."""
    line = f"{indent}from {module} import {name}"
    if len(line) <= _LINE_LENGTH:
        return line
    return f"{indent}from {module} import (\n{indent}    {name},\n{indent})"


def wrapped(line: str, indent: str = "") -> str:
    """Return a line as black lays it out: if it is long, what is in its parentheses gets a line of its own."""
    if len(indent + line) <= _LINE_LENGTH or "(" not in line or ")" not in line:
        return indent + line
    head, _, rest = line.partition("(")
    inner, _, tail = rest.rpartition(")")
    return f"{indent}{head}(\n{indent}    {inner}\n{indent}){tail}"


_LINE_LENGTH = black.Mode().line_length


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(templates_folder()),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.globals.update(import_from=import_from, wrapped=wrapped)
    return environment


def render(template: str, **values: Any) -> str:
    """Render a template, such as `proto/interface.proto.jinja`."""
    return _environment().get_template(template).render(**values)


def render_python(template: str, *, stub: bool = False, **values: Any) -> str:
    """Render a template to Python that is formatted as black does by default."""
    text = _TRAILING_SPACE.sub("", render(template, **values))
    return black.format_str(text, mode=black.Mode(is_pyi=stub))


_TRAILING_SPACE = re.compile(r"[ \t]+$", re.MULTILINE)


def render_modules(
    modules: Sequence[PythonModules], descriptors: Mapping[str, bytes]
) -> Iterator[dict[str, bytes]]:
    """Yield the files of each interface's Python modules, by path in the output folder.

    Args:
        modules: What to render.
        descriptors: The serialized FileDescriptorProto of each `.proto` file.
    """
    serialized = [descriptors[each.proto_path] for each in modules]
    # Formatting takes nearly all the time. Forking is only safe while there is one thread.
    workers = os.cpu_count() or 1
    if (
        len(modules) < _WORTH_FORKING
        or workers == 1
        or threading.active_count() > 1
        or not hasattr(os, "fork")
    ):
        yield from map(_render_module, modules, serialized)
        return
    ignore_interrupts = (signal.signal, (signal.SIGINT, signal.SIG_IGN))  # they are for the parent
    with ProcessPoolExecutor(workers, multiprocessing.get_context("fork"), *ignore_interrupts) as pool:
        yield from pool.map(_render_module, modules, serialized, chunksize=4)


_WORTH_FORKING = 16


def _render_module(modules: PythonModules, serialized: bytes) -> dict[str, bytes]:
    base = f"python/{modules.package.replace('.', '/')}/{modules.name}"
    texts = {
        f"{base}_pb2.py": render_python("python/pb2.py.jinja", modules=modules, serialized=serialized),
        f"{base}_pb2.pyi": render_python("python/pb2.pyi.jinja", stub=True, modules=modules),
        f"{base}_adapter.py": render_python("python/adapter.py.jinja", modules=modules),
    }
    return {path: text.encode() for path, text in texts.items()}


def render_packages(
    modules: Iterable[PythonModules], python_root: str, requested: Iterable[str]
) -> dict[str, bytes]:
    """Return what packages have beside the modules: `__init__.py`, `py.typed`, and the project file of the folder.

    Args:
        modules: The modules of all packages.
        python_root: The namespace package that they are in.
        requested: The packages that were asked for; the project is named after them.
    """
    exports: dict[str, dict[str, str]] = {}
    for each in modules:
        exports.setdefault(each.package, {}).update(each.exports)
    files: dict[str, bytes] = {}
    for package, names in sorted(exports.items()):
        folder = f"python/{package.replace('.', '/')}"
        text = render_python("python/init.py.jinja", package=package, exports=sorted(names.items()))
        files[f"{folder}/__init__.py"] = text.encode()
        files[f"{folder}/py.typed"] = b""
    packages = sorted({package.split(".")[-2] for package in exports})
    name = "-".join([python_root, *sorted(requested)]).replace("_", "-")
    files["pyproject.toml"] = render(
        "python/pyproject.toml.jinja", name=name, packages=packages, python_root=python_root
    ).encode()
    return files
