"""Renders templates and formats Python: the only place that touches Jinja and black.

They are imported when they are first needed: they are slow to import, and a run with nothing to do does not need them.
"""

from __future__ import annotations

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
    return environment


def render(template: str, **values: Any) -> str:
    """Render a template, such as `proto/interface.proto.jinja`."""
    return _environment().get_template(template).render(**values)


def format_python(text: str, *, stub: bool = False) -> str:
    """Format Python as black does by default, which takes long."""
    import black

    return black.format_str(text, mode=black.Mode(is_pyi=stub))
