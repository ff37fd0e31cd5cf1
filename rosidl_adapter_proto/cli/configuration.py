"""Settings from `[tool.rosidl-proto]` of a pyproject.toml."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SECTION = "rosidl-proto"


class ConfiguredGroup(click.Group):
    """A group of commands whose options take their defaults from the configuration."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """Give every command the defaults of the configuration."""
        extra.setdefault("default_map", _default_map(self, find_configuration(Path.cwd())))
        return super().make_context(info_name, args, parent, **extra)


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
            content = tomllib.loads(file.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise click.UsageError(f"cannot read {file}: {error}") from None
        section = content.get("tool", {}).get(SECTION)
        if section is not None:
            return file, section
    return None


def _default_map(group: click.Group, found: tuple[Path, dict[str, Any]] | None) -> dict[str, Any]:
    """Return the defaults of each command; a setting is named like the option, or is `packages`."""
    if found is None:
        return {}
    file, section = found
    known = {
        name: parameter
        for command in group.commands.values()
        for parameter in command.params
        for name in _setting_names(parameter)
    }
    values: dict[str, Any] = {}
    for name, value in section.items():
        parameter = known.get(name)
        if parameter is None or parameter.name is None:
            raise click.UsageError(
                f"{file}: [tool.{SECTION}] has no setting {name!r}; it has {', '.join(sorted(known))}"
            )
        values[parameter.name] = _value(parameter, name, value, file)
    return {command: values for command in group.commands}


def _setting_names(parameter: click.Parameter) -> list[str]:
    if parameter.name in _NOT_SETTINGS:
        return []
    if isinstance(parameter, click.Argument):
        return ["packages"] if parameter.name == "what" else []
    return [option.removeprefix("--") for option in parameter.opts if option.startswith("--")]


_NOT_SETTINGS = ("check", "verbose", "shell", "help")


def _value(parameter: click.Parameter, name: str, value: Any, file: Path) -> Any:
    """Return a setting as click takes a default; relative paths are relative to the configuration."""
    several = parameter.multiple or parameter.nargs == -1
    if several != isinstance(value, list):
        raise click.UsageError(f"{file}: [tool.{SECTION}] {name} must {'' if several else 'not '}be a list")
    if isinstance(parameter.type, click.Path):
        if several:
            return [str(file.parent / each) for each in value]
        return str(file.parent / value)
    if name == "packages":
        return [str(file.parent / each) if _looks_like_path(each) else each for each in value]
    return value


def _looks_like_path(text: str) -> bool:
    return text.startswith((".", "/")) or text.endswith((".msg", ".srv", ".action", ".idl"))
