"""Settings from `[tool.rosidl-proto]` of a pyproject.toml."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import click

from rosidl_adapter_proto.cli.options import is_path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SECTION = "rosidl-proto"

_NOT_SETTINGS = ("check", "verbose")


class ConfiguredGroup(click.Group):
    """A group of commands whose options take their defaults from the configuration."""

    def invoke(self, context: click.Context) -> Any:
        """Give every command the defaults of the configuration, and run the one that was asked for."""
        found = find_configuration(Path.cwd())
        if found is not None:
            context.default_map = dict.fromkeys(self.commands, _defaults(self, *found))
        return super().invoke(context)


def find_configuration(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """Return the nearest pyproject.toml with our section, in `folder` or above, and the section.

    Raises:
        click.UsageError: A pyproject.toml cannot be read.
    """
    for candidate in (folder, *folder.parents):
        file = candidate / "pyproject.toml"
        if not file.is_file():
            continue
        try:
            tools = tomllib.loads(file.read_text(encoding="utf-8")).get("tool", {})
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise click.UsageError(f"cannot read {file}: {error}") from None
        if isinstance(tools, dict) and SECTION in tools:
            if not isinstance(tools[SECTION], dict):
                raise click.UsageError(f"{file}: [tool.{SECTION}] must be a table")
            return file, tools[SECTION]
    return None


def _defaults(group: click.Group, file: Path, section: dict[str, Any]) -> dict[str, Any]:
    """Return the default of each option by the name of its parameter.

    A setting is named like the option; what to generate is `packages`.
    """
    known = {
        name: parameter
        for command in group.commands.values()
        for parameter in command.params
        if (name := _setting_name(parameter))
    }
    values: dict[str, Any] = {}
    for parameter in known.values():
        # A path that is not set is beside the configuration too, wherever the program runs.
        if isinstance(parameter.type, click.Path) and not parameter.multiple and parameter.name:
            values[parameter.name] = _path(str(parameter.default), file)
    for name, value in section.items():
        if name not in known:
            raise click.UsageError(
                f"{file}: [tool.{SECTION}] has no setting {name!r}; it has {', '.join(sorted(known))}"
            )
        values[str(known[name].name)] = _value(known[name], name, value, file)
    return values


def _setting_name(parameter: click.Parameter) -> str | None:
    """Return how a parameter is called in the configuration, or None if it is not a setting."""
    if parameter.name in _NOT_SETTINGS:
        return None
    if isinstance(parameter, click.Argument):
        return "packages" if parameter.nargs == -1 else None
    return parameter.opts[0].removeprefix("--")


def _value(parameter: click.Parameter, name: str, value: Any, file: Path) -> Any:
    """Return a setting as click takes a default; relative paths are relative to the configuration.

    Raises:
        click.UsageError: It is not of the type that the parameter has.
    """
    place = f"{file}: [tool.{SECTION}] {name}"
    if parameter.multiple or parameter.nargs == -1:
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            raise click.UsageError(f"{place} must be a list of strings")
        is_paths = isinstance(parameter.type, click.Path)
        return [_path(each, file) if is_paths or is_path(each) else each for each in value]
    if isinstance(parameter, click.Option) and parameter.is_flag:
        if not isinstance(value, bool):
            raise click.UsageError(f"{place} must be true or false")
        return value
    if not isinstance(value, str):
        raise click.UsageError(f"{place} must be a string")
    if isinstance(parameter.type, click.Choice) and value not in parameter.type.choices:
        choices = " or ".join(map(repr, parameter.type.choices))
        raise click.UsageError(f"{place} must be {choices}, not {value!r}")
    return _path(value, file) if isinstance(parameter.type, click.Path) else value


def _path(text: str, file: Path) -> str:
    """Return a path that is relative to the configuration as one that is relative to the current folder."""
    path = os.path.relpath(file.parent / text)
    return str(file.parent / text) if path.startswith("..") else os.path.join(".", path)
