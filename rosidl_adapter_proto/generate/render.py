"""Renders templates and formats Python: the only place that touches Jinja and black.

They are imported when they are first needed: they are slow to import, and a run with nothing to do does not need them.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.errors import GenerateError

if TYPE_CHECKING:
    import jinja2


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


_LINE_LENGTH = 88
"""That of black."""


@cache
def _environment() -> jinja2.Environment:
    import jinja2

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
    import black

    text = _TRAILING_SPACE.sub("", render(template, **values))
    return black.format_str(text, mode=black.Mode(is_pyi=stub))


_TRAILING_SPACE = re.compile(r"[ \t]+$", re.MULTILINE)
